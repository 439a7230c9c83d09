// ./polypic bench [OPTIONS]: Google Benchmark's own options; --benchmark_filter=transfer/3d chooses, --benchmark_format=json prints JSON.
#include <benchmark/benchmark.h>

#include <immintrin.h>

#include "sim/instructions.h"

int main(int argc, char** argv) {
  _mm_setcsr(_mm_getcsr() | 0x8040);   // denormals are zero, as in the program
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::AddCustomContext("vectors", sim::instructions());
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
