#pragma once
// The instructions that transfers are made of on this machine. All give the same bits.

namespace sim {

/// "avx2" or "avx512": of transfers found from now on.
const char* instructions();

}  // namespace sim
