// Which kernel does what.
#if defined(SIM_TRANSFER_KERNELS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_KERNELS_INL_H
#undef SIM_TRANSFER_KERNELS_INL_H
#else
#define SIM_TRANSFER_KERNELS_INL_H
#endif

#include "sim/transfer/gather_lanes-inl.h"
#include "sim/transfer/scatter_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

template <int n, bool faces>
Kernels find(int modes) {
  switch (modes) {
    case 1: return {scatter_block<Shape<n, 1, faces>>, gather_block<Shape<n, 1, faces>>};
    case 4: return {scatter_block<Shape<n, 4, faces>>, gather_block<Shape<n, 4, faces>>};
    case 8: return {scatter_block<Shape<n, 8, faces>>, gather_block<Shape<n, 8, faces>>};
    case 27:
      if constexpr (n == 3) return {scatter_block<Shape<n, 27, faces>>, gather_block<Shape<n, 27, faces>>};
      break;
  }
  return {};
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
