#define HWY_TARGET_INCLUDE "sim/transfer/lanes_stress.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/stress_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
MovingKernels find_stress(int set) { return find_moving<1, 4, 8>(set); }
}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_stress);
MovingKernels nodes_quadratic_of_solids(int set) { return set <= 8 ? HWY_DYNAMIC_DISPATCH(find_stress)(set) : nodes_bent_of_solids(set); }
}  // namespace sim::lanes
#endif
