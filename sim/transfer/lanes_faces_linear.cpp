#define HWY_TARGET_INCLUDE "sim/transfer/lanes_faces_linear.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
Kernels find_faces_linear(int set) { return find<2, true, 1, 4, 8>(set); }
}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_faces_linear);
Kernels faces_linear(int set) { return HWY_DYNAMIC_DISPATCH(find_faces_linear)(set); }
}  // namespace sim::lanes
#endif
