// The transfers as a step uses them: particles that a mixing flow has scattered, sorted anew each time, partial batches and all.
//
// A step: sort, P2G, G2P; on nodes with `F` also the update of a deformation gradient, F += dt grad v F. Between steps the flow moves the
// particles by up to half a cell; that is not counted. Start: a periodic box with 8 particles in every cell, jittered, then 100 steps.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "base/parallel.h"
#include "base/past_caches.h"
#include "bench/machine.h"
#include "sim/random.h"
#include "sim/solid/rows.h"
#include "sim/transfer/mac_transfer.h"
#include "sim/transfer/node_transfer.h"
#include "sim/transfer/tiles.h"

namespace bench {
namespace {

using namespace sim;
using Particle3 = Particles<3, float>;

constexpr int kPerCell = 8, kMixingSteps = 100;
constexpr float kCfl = 0.5f;

/// A sine by table: the flow costs nothing beside what is measured.
class Wave {
 public:
  Wave() {
    for (std::size_t i = 0; i < table_.size(); ++i) table_[i] = float(std::sin(2 * M_PI * double(i) / double(kSize)));
  }
  float sine(float turns) const {
    const float at = (turns - std::floor(turns)) * float(kSize);
    const auto i = std::size_t(at);
    return table_[i] + (at - float(i)) * (table_[i + 1] - table_[i]);
  }
  float cosine(float turns) const { return sine(turns + 0.25f); }

 private:
  static constexpr std::size_t kSize = 1024;
  std::array<float, kSize + 2> table_;
};

/// The ABC flow, whose paths are chaotic, moved on a little each step. Velocity in cells a step, at most kCfl a component.
struct Flow {
  Wave wave;
  float wavelength;   // [cells]
  Vec<3, float> at(const Vec<3, double>& place) const {
    const float x = float(place[0]) / wavelength, y = float(place[1]) / wavelength, z = float(place[2]) / wavelength;
    return kCfl / 2 * Vec<3, float>(wave.sine(z) + wave.cosine(y), wave.sine(x) + wave.cosine(z), wave.sine(y) + wave.cosine(x));
  }
  void move(Particle3& particles, const Lattice<3>& lattice) const {
    base::parallel_chunks(particles.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        const Vec<3, double> place = particles.place(p);
        Site<3, float> site{particles.cell[p], particles.offset[p]};
        site.move(at(place + 0.5 * at(place).cast<double>()));
        particles.cell[p] = lattice.wrapped(site.cell);
        particles.offset[p] = site.offset;
      }
    });
  }
};

struct Crowd {
  Lattice<3> lattice;
  Flow flow;
  Particle3 particles;   // mixed; coefficients of one mode
};

/// `margin` times as many cells along each axis as the particles fill.
Crowd make_crowd(int edge, int margin) {
  Crowd crowd;
  const int cells = edge * margin;
  crowd.lattice = Lattice<3>({cells, cells, cells}, {margin == 1, margin == 1, margin == 1});
  crowd.flow.wavelength = float(edge);
  const auto count = std::size_t(edge) * std::size_t(edge) * std::size_t(edge) * kPerCell;
  crowd.particles.mass = 1;
  crowd.particles.resize(count);
  base::parallel_chunks(count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      crowd.particles.id[p] = std::int64_t(p);
      for (int a = 0, cell = int(p / kPerCell); a < 3; ++a, cell /= edge) {
        crowd.particles.cell[p][std::size_t(a)] = cell % edge;
        crowd.particles.offset[p][a] = std::min(0.999999f, 0.5f * float(double(p >> a & 1) + uniform(1, p, std::uint64_t(a))));
      }
    }
  });
  const Lattice<3> box({edge, edge, edge}, {true, true, true});
  CanonicalOrder<3, float> order;
  for (int step = 0; step < kMixingSteps; ++step) {
    order.sort(crowd.particles, box);
    crowd.flow.move(crowd.particles, box);
  }
  return crowd;
}

const Crowd& crowd_of(int edge, int margin) {
  static std::map<std::pair<int, int>, std::unique_ptr<Crowd>> made;
  auto& crowd = made[{edge, margin}];
  if (!crowd) crowd = std::make_unique<Crowd>(make_crowd(edge, margin));
  return *crowd;
}

/// The part of the batches' lanes that hold a particle.
double lane_use(const CellRanges& ranges) {
  std::size_t lanes = 0;
  for (std::size_t k = 0; k + 1 < ranges.begin.size(); ++k) lanes += (ranges.begin[k + 1] - ranges.begin[k] + 7) / 8 * 8;
  return double(ranges.begin.back()) / double(lanes);
}

struct Case {
  std::string name = {};   // made of the rest
  Kernel kernel;
  int modes;
  bool deformation = false;
  int edge = 52;   // whole blocks
  int threads = 2;
  int margin = 1;
  bool plain = false;
};

/// Bytes a step cannot do without, a particle: what a sort moves (cell, offset, id, row: read and written), offsets for both transfers,
/// coefficients read and written, masses and velocities of the grid (written by P2G, divided, read by G2P), F read and written.
double bytes_of(const Case& c, int lattices) {
  const double sort = 2 * (12 + 12 + 8 + 4), particle = 2 * 12 + 2 * 12.0 * c.modes, grid = (4.0 * lattices * 3 + 12 * 4) / kPerCell;
  return sort + particle + grid + (c.deformation ? 2 * 36 : 0);
}

/// Multiply-adds of sum factorisation with stencils of n nodes an axis, counted as two operations, a particle; P2G and G2P.
double operations_of(const Case& c) {
  const int n = c.kernel == Kernel::linear ? 2 : 3;
  const int a = c.modes == 1 ? 1 : c.modes > 8 ? 3 : 2;
  const int pairs = c.modes == 4 ? 3 : c.modes == 10 ? 6 : a * a;                       // of modes of two axes that are kept
  const double one = n * n * n * a + n * n * pairs + n * c.modes;   // of one component, one way
  const double mass = n * n * n + n * n;
  return 2 * (2 * 3 * one + mass) + (c.deformation ? 2 * 27.0 : 0);
}

/// A deformation gradient for each particle, and how a solid updates it: F stays in the row where the last gather left it, and is written in order.
class Deformations {
 public:
  Deformations(std::size_t count, int modes) : F_(count, {1, 0, 0, 0, 1, 0, 0, 0, 1}), next_(F_), kernels_(lanes::nodes_quadratic_of_solids(modes)) {}

  /// G2P, and F += dt grad v F block by block, eight particles at a time.
  void gather(const CellRanges& ranges, const ActiveBlocks<3>& blocks, const NodeField<3, float>& velocity, Particle3& particles) {
    constexpr std::size_t per_block = Lattice<3>::kCellsPerBlock;
    constexpr int tile = Lattice<3>::kBlock + 3;
    rows_.swap(particles.rows);
    particles.rows.clear();
    base::parallel_chunks(ranges.occupied.size(), 1, [&](std::size_t b, std::size_t) {
      const std::uint32_t* const begin_of = &ranges.begin[b * per_block];
      const std::size_t begin = begin_of[0], end = begin_of[per_block];
      std::array<float, 3 * tile * tile * tile> nodes{};
      load_tile<NodeLayout<3, float>, tile>(blocks, blocks.lattice().block_at(ranges.occupied[b]), velocity, nodes.data());
      std::array<std::uint32_t, per_block + 1> local;
      for (std::size_t k = 0; k <= per_block; ++k) local[k] = std::uint32_t(begin_of[k] - begin);
      thread_local std::vector<float> v, gradient;
      const std::size_t room = end - begin + lanes::kMotionSlack;
      v.resize(3 * room), gradient.resize(9 * room);
      kernels_.gather({.begin = local.data(), .offset = particles.offset[begin].data(), .row = nullptr,
                       .coefficients = &particles.coefficients[begin * particles.row()],
                       .streams = particles.coefficients.size() * sizeof(float) > base::kHeldByCaches},
                      nodes.data(), {.velocity = v.data(), .gradient = gradient.data(), .stride = room, .wanted = {
                                     .rows = reinterpret_cast<const char*>(F_.data() + (rows_.empty() ? begin : 0)), .bytes = sizeof(Nine),
                                     .row = rows_.empty() ? nullptr : &rows_[begin]}});
      update(begin, end, gradient.data(), room);
    });
    F_.swap(next_);
    particles.rows.swap(rows_), particles.rows.clear();
  }

 private:
  using Nine = std::array<float, 9>;

  void update(std::size_t begin, std::size_t end, const float* gradient, std::size_t stride) {
    constexpr std::size_t kWidth = sim::Lanes::kWidth;
    const sim::Lanes dt(0.01f);
    RowWriter<sim::Lanes, 9> written(next_[begin].data(), next_.size() * sizeof(Nine) > base::kHeldByCaches);
    for (std::size_t p = begin; p < end; p += kWidth) {
      RowsAt<sim::Lanes, const float> from;
      for (std::size_t l = 0; l < kWidth; ++l) from[l] = F_[row_of(std::min(p + l, end - 1))].data();
      std::array<sim::Lanes, 9> change, old, now;
      load_columns(gradient + (p - begin), stride, change), load_rows(from, old);
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k)
          now[3 * i + k] = old[3 * i + k] + dt * (change[3 * i] * old[k] + change[3 * i + 1] * old[3 + k] + change[3 * i + 2] * old[6 + k]);
      written.write(now, int(std::min(kWidth, end - p)));
    }
    written.finish();
  }
  std::size_t row_of(std::size_t p) const { return rows_.empty() ? p : rows_[p]; }

  std::vector<Nine> F_, next_;
  std::vector<std::uint32_t> rows_;
  lanes::MovingKernels kernels_;
};

template <class Layout>
void run(benchmark::State& state, const Case& c) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(c.threads));
  const Crowd& crowd = crowd_of(c.edge, c.margin);
  const Lattice<3>& lattice = crowd.lattice;
  const Lattice<3> box({c.edge, c.edge, c.edge}, {true, true, true});
  std::vector<ModeIndex<3>> modes = ordered_modes<3>(c.kernel == Kernel::linear ? 1 : 2);
  modes.resize(std::size_t(c.modes));
  if (c.modes == 10) modes = mode_set<3>(Transfer::polypic, c.kernel, {0, "quadratic"});
  const GridTransfer<Layout> transfer(c.kernel, modes, c.plain ? Path::plain : Path::fast);
  Particle3 particles = crowd.particles;
  particles.modes = c.modes;
  particles.coefficients.assign(particles.size() * particles.row(), 0.01f);
  std::optional<Deformations> deformations;
  if (c.deformation) deformations.emplace(particles.size(), c.modes);
  CanonicalOrder<3, float> order;
  ActiveBlocks<3> blocks(lattice);
  typename GridTransfer<Layout>::Grid grid;
  CellRanges ranges;
  double seconds[3] = {};   // sort, P2G, G2P
  const auto step = [&] {
    const auto start = std::chrono::steady_clock::now();
    ranges = order.sort(particles, lattice, transfer.home());
    blocks.cover(ranges, 2);
    const auto sorted = std::chrono::steady_clock::now();
    transfer.scatter(particles, ranges, blocks, grid);
    const auto scattered = std::chrono::steady_clock::now();
    if constexpr (std::is_same_v<Layout, NodeLayout<3, float>>) {
      if (deformations) deformations->gather(ranges, blocks, grid.velocity, particles);
    }
    if (!deformations) transfer.gather(ranges, blocks, grid.velocity, nullptr, {}, particles);
    const auto gathered = std::chrono::steady_clock::now();
    const auto add = [](double& sum, auto from, auto to) { sum += std::chrono::duration<double>(to - from).count(); };
    add(seconds[0], start, sorted), add(seconds[1], sorted, scattered), add(seconds[2], scattered, gathered);
  };
  step();
  std::fill(std::begin(seconds), std::end(seconds), 0.0);
  for (auto _ : state) {
    state.PauseTiming();
    crowd.flow.move(particles, box);
    state.ResumeTiming();
    step();
  }
  const double count = double(particles.size()), scale = 1e9 / double(state.iterations()) / count;
  const double ns = scale * (seconds[0] + seconds[1] + seconds[2]);
  const double best = 1e9 * roofline(bytes_of(c, Layout::kLattices), operations_of(c), c.threads);
  state.counters["ns_per_particle"] = ns;
  state.counters["sort"] = scale * seconds[0], state.counters["p2g"] = scale * seconds[1], state.counters["g2p"] = scale * seconds[2];
  state.counters["roofline_ns"] = best;
  state.counters["times_roofline"] = ns / best;
  state.counters["lane_use"] = lane_use(ranges);
  state.counters["particles"] = count;
  state.counters["grid_bytes_per_particle"] = 4.0 * (Layout::kLattices + 3) * double(blocks.size()) / count;
}

std::string scheme(int modes) { return modes == 1 ? "pic" : modes == 4 ? "apic" : "polypic" + std::to_string(modes); }

template <class Layout>
void add(const std::string& layout, Case c) {
  c.name = "transfer/3d/" + std::string(c.kernel == Kernel::linear ? "linear/" : "quadratic/") + layout + "/" + scheme(c.modes) +
           (c.deformation ? "_F" : "") + (c.plain ? "/plain" : "") + (c.edge == 52 ? "" : "/" + std::to_string(kPerCell * c.edge * c.edge * c.edge)) +
           (c.margin == 1 ? "" : "/in_a_domain_8_times_as_wide") + (c.threads == 2 ? "" : "/threads:" + std::to_string(c.threads));
  const auto one = [c](benchmark::State& state) { run<Layout>(state, c); };
  benchmark::RegisterBenchmark(c.name.c_str(), one)->Unit(benchmark::kMillisecond);
}

using Faces = FaceLayout<3, float>;
using Nodes = NodeLayout<3, float>;

const int kRegistered = [] {
  for (const int modes : {1, 4, 8, 10, 27}) {
    add<Nodes>("nodes", {.kernel = Kernel::quadratic, .modes = modes});
    add<Faces>("faces", {.kernel = Kernel::quadratic, .modes = modes});
    if (modes > 8) continue;
    add<Nodes>("nodes", {.kernel = Kernel::linear, .modes = modes});
    add<Faces>("faces", {.kernel = Kernel::linear, .modes = modes});
  }
  add<Nodes>("nodes", {.kernel = Kernel::quadratic, .modes = 4, .deformation = true});
  add<Nodes>("nodes", {.kernel = Kernel::quadratic, .modes = 27, .deformation = true});
  for (const int modes : {4, 27}) {
    add<Nodes>("nodes", {.kernel = Kernel::quadratic, .modes = modes, .threads = 1});
    add<Faces>("faces", {.kernel = Kernel::quadratic, .modes = modes, .threads = 1});
    add<Nodes>("nodes", {.kernel = Kernel::quadratic, .modes = modes, .edge = 100});
    add<Faces>("faces", {.kernel = Kernel::quadratic, .modes = modes, .edge = 100});
    add<Nodes>("nodes", {.kernel = Kernel::quadratic, .modes = modes, .margin = 8});
    add<Faces>("faces", {.kernel = Kernel::quadratic, .modes = modes, .margin = 8});
    add<Nodes>("nodes", {.kernel = Kernel::quadratic, .modes = modes, .plain = true});
    add<Faces>("faces", {.kernel = Kernel::quadratic, .modes = modes, .plain = true});
  }
  return 0;
}();

}  // namespace
}  // namespace bench
