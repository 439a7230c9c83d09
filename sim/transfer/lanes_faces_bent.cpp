#define HWY_TARGET_INCLUDE "sim/transfer/lanes_faces_bent.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
Kernels find_faces_bent(int set) { return find<3, true, 10, 27>(set); }
}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_faces_bent);
Kernels faces_bent(int set) { return HWY_DYNAMIC_DISPATCH(find_faces_bent)(set); }
}  // namespace sim::lanes
#endif
