#include "sim/transfer/lanes.h"

#include <hwy/targets.h>

#include "sim/instructions.h"

namespace sim::lanes {

void allow_avx512(bool allowed) { hwy::SetSupportedTargetsForTest(allowed ? 0 : HWY_AVX2); }

}  // namespace sim::lanes

const char* sim::instructions() { return hwy::SupportedTargets() & HWY_AVX3 ? "avx512" : "avx2"; }
