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

/// Those of the first of some sets that has `set` modes.
template <int n, bool faces, int count, int... more>
Kernels find(int set) {
  if (set == count) return {scatter_block<Shape<n, count, faces>>, gather_block<Shape<n, count, faces>>};
  if constexpr (sizeof...(more) > 0) return find<n, faces, more...>(set);
  else return {};
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
