#define HWY_TARGET_INCLUDE "sim/transfer/lanes_stress_bent.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/stress_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
MovingKernels find_stress_bent(int set) { return find_moving<10, 27>(set); }
}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_stress_bent);
MovingKernels nodes_bent_of_solids(int set) { return HWY_DYNAMIC_DISPATCH(find_stress_bent)(set); }
}  // namespace sim::lanes
#endif
