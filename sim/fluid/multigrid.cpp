#include "sim/fluid/multigrid.h"

#include <cmath>

#include "sim/fluid/multigrid_level.h"
#include "sim/fluid/poisson.h"

namespace sim {
namespace {

using Vector = std::vector<double>;

/// Levels of at most this many unknowns are factorised.
constexpr std::int64_t kCoarsestUnknowns = 700;
/// Where a level has no coarser one and is too large to factorise, its cells hang together in clumps of a few: this often smoothed.
constexpr int kLonelySweeps = 4;

/// The roots of the Chebyshev polynomial of degree 2 over [lowest, highest] are the places where the smoother deletes; D^-1 A has no
/// eigenvalue above 2, and what is below the lowest is smooth enough for the coarser level.
constexpr double kLowest = 0.45, kHighest = 2.0;
const float kFirstStep = float(1 / ((kHighest + kLowest) / 2 + (kHighest - kLowest) / 2 * std::sqrt(0.5)));
const float kSecondStep = float(1 / ((kHighest + kLowest) / 2 - (kHighest - kLowest) / 2 * std::sqrt(0.5)));

double add(double a, double b) { return a + b; }

/// The unknowns of a level, numbered, and their equations as a list of links.
template <int D>
struct Numbered {
  PoissonSystem system;
  std::vector<std::ptrdiff_t> cell;   // of each unknown: place in the level's arrays
};

template <int D>
Numbered<D> number_unknowns(const Level<D>& level) {
  using T = Tile<D>;
  constexpr int E = T::kEdge;
  Numbered<D> out;
  std::vector<std::int32_t> number(level.size(), PoissonSystem::kNone);
  for (std::size_t n = 0; n < level.tile.size(); ++n)
    for (int i = 0; i < T::kCells; ++i)
      if (!level.coefficients[n] || level.coefficients[n]->kind[std::size_t(i)] == PoissonCell::unknown) {
        const std::ptrdiff_t at = level.begin(std::int32_t(n)) + i;
        number[std::size_t(at)] = std::int32_t(out.cell.size());
        out.cell.push_back(at);
      }
  PoissonSystem& s = out.system;
  s.dimension = D;
  s.neighbour.resize(out.cell.size()), s.weight.resize(out.cell.size()), s.diagonal.resize(out.cell.size());
  base::parallel_chunks(out.cell.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t u = begin; u < end; ++u) {
      const auto n = std::size_t(out.cell[u] / T::kCells);
      const int cell = int(out.cell[u] % T::kCells);
      const std::array<int, 3> at{cell / (E * E), cell / E % E, cell % E};
      const TileCoefficients<D>* k = level.coefficients[n].get();
      s.neighbour[u].fill(PoissonSystem::kNone), s.weight[u].fill(0);
      double sum = k ? double(k->extra[std::size_t(cell)]) : 0;
      for (int a = 0; a < D; ++a)
        for (int side = 0; side < 2; ++side) {
          const auto along = std::size_t(a + 3 - D);
          std::array<int, 3> f = at, other = at;
          f[along] += side, other[along] += side ? 1 : -1;
          double w = double(level.face);
          if (k) w = a == D - 1   ? k->face[D - 1][std::size_t(T::template face<D - 1>(f[0], f[1], f[2]))]
                     : a == D - 2 ? k->face[D - 2][std::size_t(T::template face<D - 2>(f[0], f[1], f[2]))]
                                  : k->face[0][std::size_t(T::template face<0>(f[0], f[1], f[2]))];
          sum += w;
          auto tile = std::int32_t(n);
          if (other[along] < 0 || other[along] >= level.extent(level.tile[n], a)) {
            tile = level.neighbour[n][std::size_t(neighbour_index<D>(a, side))];
            if (tile < 0) continue;
            other[along] = side ? 0 : level.extent(level.tile[std::size_t(tile)], a) - 1;
          }
          const std::int32_t there = number[std::size_t(level.begin(tile) + T::cell(other[0], other[1], other[2]))];
          if (there == std::int32_t(u)) sum -= w;   // around a periodic axis of one cell: no difference, no link
          if (w <= 0 || there == std::int32_t(u)) continue;
          s.neighbour[u][std::size_t(2 * a + side)] = there;
          if (s.neighbour[u][std::size_t(2 * a + side)] >= 0) s.weight[u][std::size_t(2 * a + side)] = w;
        }
      s.diagonal[u] = sum;
    }
  });
  find_closed_pockets(s);
  return out;
}

/// What is done to the cells of a level, chunk by chunk of tiles.
template <int D, class Body>
void for_cells(const Level<D>& level, const Body& body) {
  base::parallel_chunks(level.tile.size(), kTilesAtOnce, [&](std::size_t begin, std::size_t end) {
    body(begin * std::size_t(Tile<D>::kCells), end * std::size_t(Tile<D>::kCells));
  });
}
template <int D, class Body>
double sum_cells(const Level<D>& level, const Body& body) {
  return base::ordered_reduce(level.tile.size(), kTilesAtOnce, 0.0, [&](std::size_t begin, std::size_t end) {
    constexpr std::size_t E = Tile<D>::kEdge;
    double lane[E] = {}, sum = 0;
    for (std::size_t i = begin * std::size_t(Tile<D>::kCells); i < end * std::size_t(Tile<D>::kCells); i += E)
      for (std::size_t l = 0; l < E; ++l) lane[l] += body(i + l);
    for (const double v : lane) sum += v;
    return sum;
  }, add);
}

using L = Lanes<double>;

double sum_of(const L::V& v) { return (v[0] + v[1]) + (v[2] + v[3]); }

/// Calls out(place, x there, A x there) for L::kWidth cells at a time of a range of tiles; A x is 0 where nothing is unknown.
template <int D, class Out>
void apply_tiles(const Level<D>& level, const Vector& x, std::size_t begin, std::size_t end, const Out& out) {
  Padded<D, double> padded;
  for (std::size_t n = begin; n < end; ++n) {
    padded.load(level, x.data(), std::int32_t(n));
    Padded<D, double>::call_for(level, x.data(), n + kTilesAhead);
    const std::size_t first = n * std::size_t(Tile<D>::kCells);
    if (const TileCoefficients<D>* k = level.coefficients[n].get())
      visit_lanes<D, double>(padded, k, double(level.face), [&](int at, const L::V& own, const L::V& Ax) {
        out(first + std::size_t(at), own, L::load(k->inverse_diagonal.data() + at) > 0 ? Ax : L::V{});
      });
    else
      visit_lanes<D, double>(padded, nullptr, double(level.face), [&](int at, const L::V& own, const L::V& Ax) {
        out(first + std::size_t(at), own, Ax);
      });
  }
}

}  // namespace

template <int D>
struct PoissonSolver<D>::Parts {
  std::vector<Level<D>> levels;   // finest first
  std::unique_ptr<CholeskyFactor> coarsest;
  Numbered<D> coarsest_unknowns;
  Vector coarse_b, coarse_x;
  Vector x, r, p, q, b;

  void build(const PoissonProblem<D>& problem);
  void factorise_coarsest();
  void cycle(std::size_t at);
  double preconditioned();
  void start_direction(double beta);
  double image_of_direction();
  double step(double alpha);
  double true_residual();
  void set_preconditioner_input();
  void solve_directly(double scale, PoissonReport&);
  void fall_back(double tolerance, PoissonReport&);
};

template <int D>
void PoissonSolver<D>::Parts::build(const PoissonProblem<D>& problem) {
  std::vector<Level<D>> old = std::move(levels);
  levels.clear();
  const auto reused = [&] { return levels.size() < old.size() ? std::move(old[levels.size()]) : Level<D>{}; };
  levels.reserve(24);
  levels.push_back(make_finest(problem, reused(), b));
  find_closed_components(levels.front());
  const bool closed = !levels.front().pieces.empty();
  coarsest.reset();
  if (levels.front().unknowns <= kDirectUnknowns) return;
  while (levels.back().unknowns > kCoarsestUnknowns) {
    Level<D> coarser = make_coarser(levels.back(), reused());
    if (coarser.unknowns == 0) break;
    levels.push_back(std::move(coarser));
    if (closed) find_closed_components(levels.back());
    else levels.back().pieces.clear();
  }
  factorise_coarsest();
  x.resize(b.size()), r.resize(b.size()), p.resize(b.size()), q.resize(b.size());
}

template <int D>
void PoissonSolver<D>::Parts::factorise_coarsest() {
  if (levels.back().unknowns > kCoarsestUnknowns) return;
  coarsest_unknowns = number_unknowns(levels.back());
  coarsest = std::make_unique<CholeskyFactor>(coarsest_unknowns.system);
  if (!coarsest->whole()) coarsest.reset();
}

/// From b and x = omega D^-1 b of a level: the solution's approximation in t.
template <int D>
void PoissonSolver<D>::Parts::cycle(std::size_t at) {
  Level<D>& level = levels[at];
  if (at + 1 == levels.size()) {
    if (coarsest) {
      const std::vector<std::ptrdiff_t>& cell = coarsest_unknowns.cell;
      coarse_b.resize(cell.size());
      for (std::size_t u = 0; u < cell.size(); ++u) coarse_b[u] = level.b[std::size_t(cell[u])];
      remove_constants(coarsest_unknowns.system, coarse_b);
      coarsest->solve(coarse_b, coarse_x);
      remove_constants(coarsest_unknowns.system, coarse_x);
      std::fill(level.t.begin(), level.t.end(), 0.0f);
      for (std::size_t u = 0; u < cell.size(); ++u) level.t[std::size_t(cell[u])] = float(coarse_x[u]);
      return;
    }
    for (int sweep = 0; sweep < kLonelySweeps; ++sweep) {
      smooth(level, level.x, kSecondStep, level.t);
      smooth(level, level.t, kFirstStep, level.x);
    }
    smooth(level, level.x, kSecondStep, level.t);
    return;
  }
  Level<D>& coarser = levels[at + 1];
  smooth(level, level.x, kSecondStep, level.t);
  restrict_residual(level, level.t);
  gather_restricted(level, kFirstStep, coarser);
  if (!coarser.pieces.empty()) {
    remove_means(coarser, coarser.b);
    for_cells(coarser, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin / std::size_t(Tile<D>::kCells); n < end / std::size_t(Tile<D>::kCells); ++n) {
        const TileCoefficients<D>* k = coarser.coefficients[n].get();
        for (std::size_t i = 0; i < std::size_t(Tile<D>::kCells); ++i) {
          const std::size_t c = n * std::size_t(Tile<D>::kCells) + i;
          coarser.x[c] = kFirstStep * (k ? k->inverse_diagonal[i] : coarser.plain_inverse_diagonal()) * coarser.b[c];
        }
      }
    });
  }
  cycle(at + 1);
  if (!coarser.pieces.empty()) remove_means(coarser, coarser.t);
  add_interpolated(coarser, coarser.t, level, level.t);
  if (at == 0) return;   // the last two sweeps are the caller's, who wants a sum with them
  smooth(level, level.t, kSecondStep, level.x);
  smooth(level, level.x, kFirstStep, level.t);
}

/// z = M^-1 r in the finest level's t; returns z . r.
template <int D>
double PoissonSolver<D>::Parts::preconditioned() {
  Level<D>& level = levels.front();
  cycle(0);
  if (levels.size() == 1) return sum_cells(level, [&](std::size_t i) { return r[i] * double(level.t[i]); });
  smooth(level, level.t, kSecondStep, level.x);
  const double rz = smooth_and_dot(level, level.x, kFirstStep, r, level.t);
  if (level.pieces.empty()) return rz;
  remove_means(level, level.t);
  return sum_cells(level, [&](std::size_t i) { return r[i] * double(level.t[i]); });
}

template <int D>
void PoissonSolver<D>::Parts::start_direction(double beta) {
  const float* z = levels.front().t.data();
  for_cells(levels.front(), [&](std::size_t begin, std::size_t end) {
    double* __restrict to = p.data();
    for (std::size_t i = begin; i < end; ++i) to[i] = double(z[i]) + (beta == 0 ? 0.0 : beta * to[i]);
  });
}

/// q = A p; returns p . q.
template <int D>
double PoissonSolver<D>::Parts::image_of_direction() {
  return base::ordered_reduce(levels.front().tile.size(), kTilesAtOnce, 0.0, [&](std::size_t begin, std::size_t end) {
    L::V sum{};
    apply_tiles(levels.front(), p, begin, end, [&](std::size_t at, const L::V& own, const L::V& Ap) {
      L::store(Ap, q.data() + at);
      sum += own * Ap;
    });
    return sum_of(sum);
  }, add);
}

/// What the V-cycle starts from: r in float, and the smoother's first step from zero.
template <int D>
void PoissonSolver<D>::Parts::set_preconditioner_input() {
  step(0);
}

/// x += alpha p, r -= alpha q, and the V-cycle's input; returns r . r.
template <int D>
double PoissonSolver<D>::Parts::step(double alpha) {
  constexpr std::size_t kCells = std::size_t(Tile<D>::kCells), E = std::size_t(Tile<D>::kEdge);
  Level<D>& level = levels.front();
  return base::ordered_reduce(level.tile.size(), kTilesAtOnce, 0.0, [&](std::size_t begin, std::size_t end) {
    double lane[E] = {}, sum = 0;
    for (std::size_t n = begin; n < end; ++n) {
      const TileCoefficients<D>* k = level.coefficients[n].get();
      const float plain = kFirstStep * level.plain_inverse_diagonal();
      double* __restrict xs = x.data() + n * kCells;
      double* __restrict rs = r.data() + n * kCells;
      float* __restrict bs = level.b.data() + n * kCells;
      float* __restrict start = level.x.data() + n * kCells;
      const double* ps = p.data() + n * kCells;
      const double* qs = q.data() + n * kCells;
      if (alpha != 0)
        for (std::size_t i = 0; i < kCells; ++i) xs[i] += alpha * ps[i], rs[i] -= alpha * qs[i];
      for (std::size_t i = 0; i < kCells; i += E)
        for (std::size_t l = 0; l < E; ++l) lane[l] += rs[i + l] * rs[i + l];
      for (std::size_t i = 0; i < kCells; ++i) bs[i] = float(rs[i]);
      if (k)
        for (std::size_t i = 0; i < kCells; ++i) start[i] = kFirstStep * k->inverse_diagonal[i] * bs[i];
      else
        for (std::size_t i = 0; i < kCells; ++i) start[i] = plain * bs[i];
    }
    for (const double v : lane) sum += v;
    return sum;
  }, add);
}

/// r = b - A x; returns its norm.
template <int D>
double PoissonSolver<D>::Parts::true_residual() {
  return std::sqrt(base::ordered_reduce(levels.front().tile.size(), kTilesAtOnce, 0.0, [&](std::size_t begin, std::size_t end) {
    L::V sum{};
    apply_tiles(levels.front(), x, begin, end, [&](std::size_t at, const L::V&, const L::V& Ax) {
      const L::V left = L::load(b.data() + at) - Ax;
      L::store(left, r.data() + at);
      sum += left * left;
    });
    return sum_of(sum);
  }, add));
}

template <int D>
void PoissonSolver<D>::Parts::solve_directly(double scale, PoissonReport& report) {
  const Numbered<D> n = number_unknowns(levels.front());
  Vector rhs(n.cell.size()), solution;
  for (std::size_t u = 0; u < n.cell.size(); ++u) rhs[u] = b[std::size_t(n.cell[u])];
  x.assign(b.size(), 0.0), r.resize(b.size());
  if (scale == 0) return;
  report.converged = sim::solve_directly(n.system, rhs, solution).converged;
  if (!report.converged) return;
  remove_constants(n.system, solution);
  for (std::size_t u = 0; u < n.cell.size(); ++u) x[std::size_t(n.cell[u])] = solution[u];
  report.residual = true_residual() / scale;
}

template <int D>
void PoissonSolver<D>::Parts::fall_back(double tolerance, PoissonReport& report) {
  report.fell_back = true;
  const Numbered<D> n = number_unknowns(levels.front());
  Vector rhs(n.cell.size()), solution(n.cell.size());
  for (std::size_t u = 0; u < n.cell.size(); ++u) rhs[u] = b[std::size_t(n.cell[u])], solution[u] = x[std::size_t(n.cell[u])];
  const SolveReport more = solve_iteratively(n.system, rhs, tolerance, solution);
  for (std::size_t u = 0; u < n.cell.size(); ++u) x[std::size_t(n.cell[u])] = solution[u];
  report.iterations += more.iterations;
  report.converged = more.converged;
}

template <int D>
PoissonReport PoissonSolver<D>::solve(const PoissonProblem<D>& problem, double tolerance) {
  Parts& s = *parts_;
  s.build(problem);
  const Level<D>& finest = s.levels.front();
  PoissonReport report;
  report.unknowns = finest.unknowns;
  report.closed_components = std::int64_t(finest.component_cells.size());
  report.imbalance = remove_means(finest, s.b);
  const double scale = std::sqrt(sum_cells(finest, [&](std::size_t i) { return s.b[i] * s.b[i]; }));
  if (!std::isfinite(scale)) {
    report.converged = false;
    report.residual = scale;
    return report;
  }
  if (finest.unknowns <= kDirectUnknowns) {
    s.solve_directly(scale, report);
    return report;
  }
  for_cells(finest, [&](std::size_t begin, std::size_t end) {
    std::fill(s.x.begin() + std::ptrdiff_t(begin), s.x.begin() + std::ptrdiff_t(end), 0.0);
    std::copy(s.b.begin() + std::ptrdiff_t(begin), s.b.begin() + std::ptrdiff_t(end), s.r.begin() + std::ptrdiff_t(begin));
  });
  if (scale == 0) return report;
  report.residual = 1;
  double rho = 0;
  s.set_preconditioner_input();
  while (report.iterations < kMostCycles) {
    const double rho_new = s.preconditioned();
    if (!(rho_new > 0)) break;   // underflow, or a preconditioner that is none: the other one decides
    s.start_direction(rho > 0 ? rho_new / rho : 0);
    rho = rho_new;
    const double pq = s.image_of_direction();
    if (!(pq > 0)) break;
    report.residual = std::sqrt(s.step(rho / pq)) / scale;
    ++report.iterations;
    if (report.residual > tolerance) continue;
    report.residual = s.true_residual() / scale;
    if (report.residual <= tolerance) {
      remove_means(finest, s.x);
      return report;
    }
    s.set_preconditioner_input();
    rho = 0;
  }
  s.fall_back(tolerance, report);
  remove_means(finest, s.x);
  report.residual = s.true_residual() / scale;
  report.converged = report.residual <= 2 * tolerance;
  return report;
}

template <int D>
std::span<const double> PoissonSolver<D>::solution(std::size_t n) const {
  return {parts_->x.data() + n * std::size_t(Tile<D>::kCells), std::size_t(Tile<D>::kCells)};
}

template <int D>
std::int64_t PoissonSolver<D>::bytes() const {
  const Parts& s = *parts_;
  std::size_t bytes = sizeof(double) * (s.x.capacity() + s.r.capacity() + s.p.capacity() + s.q.capacity() + s.b.capacity());
  for (const Level<D>& level : s.levels) {
    bytes += sizeof(float) * (level.x.capacity() + level.t.capacity() + level.b.capacity() + level.restricted.capacity());
    bytes += level.tile.capacity() * (sizeof(level.tile[0]) + sizeof(level.neighbour[0]) + sizeof(void*) + 3 * sizeof(std::int64_t));
    bytes += level.parents.capacity() * sizeof(level.parents[0]) + level.children.capacity() * sizeof(level.children[0]);
    for (const auto& k : level.coefficients) bytes += k ? sizeof *k : 0;
    bytes += level.masks.capacity() * sizeof(level.masks[0]) + level.pieces.capacity() * sizeof(Piece);
  }
  return std::int64_t(bytes);
}

template <int D> PoissonSolver<D>::PoissonSolver() : parts_(std::make_unique<Parts>()) {}
template <int D> PoissonSolver<D>::~PoissonSolver() = default;
template <int D> PoissonSolver<D>::PoissonSolver(PoissonSolver&&) noexcept = default;
template <int D> PoissonSolver<D>& PoissonSolver<D>::operator=(PoissonSolver&&) noexcept = default;

template class PoissonSolver<2>;
template class PoissonSolver<3>;

}  // namespace sim
