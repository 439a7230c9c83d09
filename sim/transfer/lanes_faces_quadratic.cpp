#define HWY_TARGET_INCLUDE "sim/transfer/lanes_faces_quadratic.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
Kernels find_faces_quadratic(int modes) { return find<3, true>(modes); }
}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_faces_quadratic);
Kernels faces_quadratic(int modes) { return HWY_DYNAMIC_DISPATCH(find_faces_quadratic)(modes); }
}  // namespace sim::lanes
#endif
