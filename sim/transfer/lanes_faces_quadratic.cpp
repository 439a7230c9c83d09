#define HWY_TARGET_INCLUDE "sim/transfer/lanes_faces_quadratic.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
Kernels find_faces_quadratic(int set) { return find<3, true, 1, 4, 8>(set); }
}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_faces_quadratic);
Kernels faces_quadratic(int set) { return HWY_DYNAMIC_DISPATCH(find_faces_quadratic)(set); }
}  // namespace sim::lanes
#endif
