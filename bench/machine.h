#pragma once
// What this machine can do at best, measured in the run whose figures are compared with it.
#include <cstddef>

namespace bench {

struct Ceilings {
  double bytes_per_second = 0;        // STREAM triad, a[i] = b[i] + s c[i], three words an entry counted
  double operations_per_second = 0;   // single precision, a fused multiply-add counted as two; in vectors of eight
};

/// With that many threads; measured at the first call.
const Ceilings& ceilings(int threads);

/// The time in which bytes and operations could be done at best, each at its ceiling and at the same time [s].
double roofline(double bytes, double operations, int threads);

}  // namespace bench
