// P2G's kernels alone, of one thread: a block of cells with 8 particles each on the average, whose rows stay in the second cache, and a tile that goes nowhere.
// What the transfers of transfer.cpp take beyond that is memory and the grid.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "sim/instructions.h"
#include "sim/scene.h"
#include "sim/transfer/lanes.h"

namespace bench {
namespace {

using namespace sim;

struct Case {
  bool faces;
  Kernel kernel;
  int modes;
  bool avx512;
};

lanes::Scatter kernel_of(const Case& c) {
  if (c.kernel == Kernel::linear) return (c.faces ? lanes::faces_linear(c.modes) : lanes::nodes_linear(c.modes)).scatter;
  if (c.modes > 8) return (c.faces ? lanes::faces_bent(c.modes) : lanes::nodes_bent(c.modes)).scatter;
  return (c.faces ? lanes::faces_quadratic(c.modes) : lanes::nodes_quadratic(c.modes)).scatter;
}

void run(benchmark::State& state, const Case& c) {
  constexpr int kCells = Lattice<3>::kCellsPerBlock;
  std::mt19937 random(1);
  std::poisson_distribution<std::uint32_t> in_cell(8);
  std::uniform_real_distribution<float> number(0, 0.999f);
  std::vector<std::uint32_t> begin(kCells + 1, 0), row;
  for (int cell = 0; cell < kCells; ++cell) begin[std::size_t(cell) + 1] = begin[std::size_t(cell)] + in_cell(random);
  const std::size_t count = begin.back();
  for (std::size_t p = 0; p < count; ++p) row.push_back(std::uint32_t(p));
  std::shuffle(row.begin(), row.end(), random);
  std::vector<float> offsets(3 * count), coefficients(3 * count * std::size_t(c.modes));
  for (float& x : offsets) x = number(random);
  for (float& x : coefficients) x = number(random) - 0.5f;
  const int edge = Lattice<3>::kBlock + (c.kernel == Kernel::linear ? 2 : 3);
  std::vector<float> tile(std::size_t((c.faces ? 6 : 4) * edge * edge * edge + lanes::kTileSlack));

  if (c.avx512 && instructions() != std::string("avx512")) return state.SkipWithError("no AVX-512 here");
  lanes::allow_avx512(c.avx512);
  const lanes::Scatter scatter = kernel_of(c);
  lanes::allow_avx512(true);
  const lanes::Block block{.begin = begin.data(), .offset = offsets.data(), .row = row.data(), .coefficients = coefficients.data()};
  for (auto _ : state) {
    scatter(block, tile.data());
    benchmark::DoNotOptimize(tile.data());
    benchmark::ClobberMemory();
  }
  state.counters["per_particle"] = benchmark::Counter(double(count), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

const int kRegistered = [] {
  for (const bool avx512 : {true, false})
    for (const Kernel kernel : {Kernel::quadratic, Kernel::linear})
      for (const bool faces : {false, true})
        for (const int modes : {1, 4, 8, 10, 27}) {
          if (kernel == Kernel::linear && modes > 8) continue;
          const std::string name = std::string("p2g_kernel/") + (kernel == Kernel::linear ? "linear/" : "quadratic/") + (faces ? "faces/" : "nodes/") +
                                   std::to_string(modes) + (avx512 ? "" : "/avx2");
          benchmark::RegisterBenchmark(name.c_str(), run, Case{faces, kernel, modes, avx512})->Unit(benchmark::kMicrosecond);
        }
  return 0;
}();

}  // namespace
}  // namespace bench
