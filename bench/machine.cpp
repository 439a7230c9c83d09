#include "bench/machine.h"

#include <benchmark/benchmark.h>
#include <immintrin.h>
#include <tbb/global_control.h>

#include <chrono>
#include <map>
#include <string_view>
#include <vector>

#include "base/parallel.h"
#include "sim/instructions.h"

namespace bench {
namespace {

double seconds_of(const auto& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double best_of(int repeats, const auto& body) {
  double best = seconds_of(body);
  for (int r = 1; r < repeats; ++r) best = std::min(best, seconds_of(body));
  return best;
}

double stream(int threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
  constexpr std::size_t kCount = 24 << 20;   // far more than caches hold
  struct Octet {
    alignas(32) float at[8];
  };
  std::vector<Octet> a(kCount / 8), b(kCount / 8, Octet{{1, 1, 1, 1, 1, 1, 1, 1}}), c = b;
  const double s = best_of(7, [&] {
    base::parallel_chunks(a.size(), 1 << 13, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        _mm256_stream_ps(a[i].at, _mm256_fmadd_ps(_mm256_set1_ps(3.0f), _mm256_load_ps(c[i].at), _mm256_load_ps(b[i].at)));
    });
  });
  return 3.0 * sizeof(float) * double(kCount) / s;
}

constexpr std::size_t kRounds = 4 << 20, kChains = 12;   // as many chains as hide the latency

/// Eight numbers a vector, or sixteen as the transfers have them where the processor does.
void eight_wide(float* sink) {
  __m256 x[kChains];
  for (std::size_t k = 0; k < kChains; ++k) x[k] = _mm256_set1_ps(float(k));
  const __m256 m = _mm256_set1_ps(0.999f), d = _mm256_set1_ps(1e-3f);
  for (std::size_t r = 0; r < kRounds; ++r) {
#pragma GCC unroll 12
    for (std::size_t k = 0; k < kChains; ++k) x[k] = _mm256_fmadd_ps(x[k], m, d);
    benchmark::ClobberMemory();
  }
  for (std::size_t k = 1; k < kChains; ++k) x[0] = _mm256_add_ps(x[0], x[k]);
  _mm256_storeu_ps(sink, x[0]);
}
[[gnu::target("avx512f")]] void sixteen_wide(float* sink) {
  __m512 x[kChains];
  for (std::size_t k = 0; k < kChains; ++k) x[k] = _mm512_set1_ps(float(k));
  const __m512 m = _mm512_set1_ps(0.999f), d = _mm512_set1_ps(1e-3f);
  for (std::size_t r = 0; r < kRounds; ++r) {
#pragma GCC unroll 12
    for (std::size_t k = 0; k < kChains; ++k) x[k] = _mm512_fmadd_ps(x[k], m, d);
    benchmark::ClobberMemory();
  }
  for (std::size_t k = 1; k < kChains; ++k) x[0] = _mm512_add_ps(x[0], x[k]);
  _mm512_storeu_ps(sink, x[0]);
}

double multiply_adds(int threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
  const bool wide = std::string_view(sim::instructions()) == "avx512";
  std::vector<float> sinks(64 * std::size_t(threads));
  const double s = best_of(5, [&] {
    base::parallel_chunks(std::size_t(threads), 1, [&](std::size_t t, std::size_t) { (wide ? sixteen_wide : eight_wide)(&sinks[64 * t]); });
  });
  benchmark::DoNotOptimize(sinks.data());
  return 2.0 * (wide ? 16 : 8) * double(kRounds * kChains) * threads / s;
}

void stream_benchmark(benchmark::State& state, int threads) {
  for (auto _ : state) benchmark::DoNotOptimize(ceilings(threads));
  state.counters["GB_per_second"] = ceilings(threads).bytes_per_second * 1e-9;
}

void multiply_add_benchmark(benchmark::State& state, int threads) {
  for (auto _ : state) benchmark::DoNotOptimize(ceilings(threads));
  state.counters["Gflop_per_second"] = ceilings(threads).operations_per_second * 1e-9;
}

const int kRegistered = [] {
  for (const int threads : {1, 2}) {
    benchmark::RegisterBenchmark(("machine/stream/threads:" + std::to_string(threads)).c_str(), stream_benchmark, threads);
    benchmark::RegisterBenchmark(("machine/multiply_add/threads:" + std::to_string(threads)).c_str(), multiply_add_benchmark, threads);
  }
  return 0;
}();

}  // namespace

const Ceilings& ceilings(int threads) {
  static std::map<int, Ceilings> found;
  const auto [at, is_new] = found.try_emplace(threads);
  if (is_new) at->second = {stream(threads), multiply_adds(threads)};
  return at->second;
}

double roofline(double bytes, double operations, int threads) {
  const Ceilings& most = ceilings(threads);
  return std::max(bytes / most.bytes_per_second, operations / most.operations_per_second);
}

}  // namespace bench
