#define HWY_TARGET_INCLUDE "sim/transfer/lanes_nodes_quadratic.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
Kernels find_nodes_quadratic(int set) { return find<3, false, 1, 4, 8>(set); }
}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_nodes_quadratic);
Kernels nodes_quadratic(int set) { return HWY_DYNAMIC_DISPATCH(find_nodes_quadratic)(set); }
}  // namespace sim::lanes
#endif
