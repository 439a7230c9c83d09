#define HWY_TARGET_INCLUDE "sim/transfer/lanes_nodes_linear.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
Kernels find_nodes_linear(int set) { return find<2, false, 1, 4, 8>(set); }
}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_nodes_linear);
Kernels nodes_linear(int set) { return HWY_DYNAMIC_DISPATCH(find_nodes_linear)(set); }
}  // namespace sim::lanes
#endif
