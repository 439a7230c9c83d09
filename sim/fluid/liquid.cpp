#include "sim/fluid/liquid.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "base/error.h"
#include "base/parallel.h"
#include "sim/effects/gravity.h"
#include "sim/fluid/advect.h"
#include "sim/fluid/pressure.h"
#include "sim/fluid/seeding.h"
#include "sim/random.h"

namespace sim {
namespace {

template <int D>
Lattice<D> make_lattice(const Options& o) {
  Cell<D> cells;
  for (int a = 0; a < D; ++a) cells[a] = int(std::lround(o.domain.size()[a] / o.cell));
  return Lattice<D>(cells);
}

template <int D, class Real>
class Liquid final : public Simulation {
 public:
  Liquid(const Scene& scene, double fps)
      : options_(scene.options), fps_(fps), gravity_(gravity(scene)), lattice_(make_lattice<D>(scene.options)), solids_(scene, lattice_),
        transfer_(lattice_, options_.kernel, mode_set<D>(options_.transfer, options_.kernel, options_.modes)),
        particles_(seed_particles<D, Real>(scene, lattice_, solids_, int(transfer_.modes().size()))) {
    if (particles_.size() == 0)
      throw base::Error({.key = "body", .message = "no particle: every body lies outside the domain or inside a collider"});
    counters_.pushed_out = push_out(solids_, particles_);
    particle_volume_ = std::pow(options_.cell, D) / double(options_.particles_per_cell);
  }

  bool advance(base::Ledger& ledger, const std::function<bool()>& interrupted) override {
    counters_ = {};
    for (double left = 1 / fps_; left > 0;) {
      if (interrupted && interrupted()) return false;
      left -= step(left, ledger);
    }
    ++frame_;
    return true;
  }

  Frame frame() const override;
  Totals totals() const override;
  State state() const override;
  void restore(const State&) override;

 private:
  /// One step of at most `left` [s]; returns its length.
  double step(double left, base::Ledger& ledger) {
    const auto particle_bytes = std::int64_t(particles_.size() * (sizeof(Cell<D>) + sizeof(Vec<D, Real>) + particles_.row() * sizeof(Real)));
    const auto grid_bytes = std::int64_t(lattice_.size * D * sizeof(Real));
    CellRanges ranges;
    {
      const auto pass = ledger.pass("sort", 2 * particle_bytes);
      ranges = order_.sort(particles_, lattice_);
    }
    {
      const auto pass = ledger.pass("p2g", particle_bytes + 4 * grid_bytes);
      transfer_.scatter(particles_, ranges, grid_);
    }
    {
      const auto pass = ledger.pass("extrapolate", 2 * grid_bytes);
      fill_empty_faces();
      scattered_ = grid_.velocity;
    }
    const std::vector<CellKind> kind = classify_cells(ranges, solids_);
    double dt = first_guess(left);
    while (!try_velocity(dt, kind, ledger)) {
      dt /= 2;
      if (dt < kShortestStep / fps_)
        throw base::Error({.code = base::Exit::unstable, .hint = "raise sim.cfl or shot.fps, or take a coarser sim.cell",
                           .message = fmt::format("pressure: frame {}: a velocity would cross more than {:.3g} cells in {:.1g} of a frame",
                                                  frame_ + 1, 2 * options_.cfl, kShortestStep)});
    }
    {
      const auto pass = ledger.pass("extrapolate", 2 * grid_bytes);
      extrapolate(grid_.velocity, valid_, lattice_, layers());
    }
    {
      const auto pass = ledger.pass("g2p", particle_bytes + grid_bytes);
      transfer_.gather(grid_.velocity, &scattered_, gather_rule(dt), particles_);
    }
    {
      const auto pass = ledger.pass("advect", particle_bytes + 2 * grid_bytes);
      advect(transfer_, grid_.velocity, dt, solids_, particles_);
    }
    {
      const auto pass = ledger.pass("collide", particle_bytes);
      counters_.pushed_out += push_out(solids_, particles_);
    }
    ++counters_.substeps;
    return dt >= left ? left : dt;
  }

  /// Cells that a particle may cross in a step, rounded up, and a margin for the kernel: how deep the field must reach into the air.
  int layers() const { return int(std::ceil(std::sqrt(3.0) * options_.cfl)) + 3; }

  /// Faces that no particle reached take their neighbours' velocity; FLIP needs the field as deep as the one it will be compared with.
  void fill_empty_faces() {
    constexpr int kShallow = 2;
    for (int a = 0; a < D; ++a) {
      valid_[a].resize(lattice_.size);
      for (std::size_t i = 0; i < lattice_.size; ++i) valid_[a][i] = double(grid_.mass[a][i]) > kLightestNode;
    }
    extrapolate(grid_.velocity, valid_, lattice_, options_.transfer == Transfer::flip ? layers() : kShallow);
  }

  /// The step in which the fastest particle, falling freely, crosses cfl cells; the rest of the frame is cut in two rather than leave a sliver.
  double first_guess(double left) const {
    const double v = max_speed(), g = gravity_.norm(), reach = options_.cfl * options_.cell;
    const double dt = v > 0 || g > 0 ? 2 * reach / (v + std::sqrt(v * v + 4 * g * reach)) : left;
    if (dt >= left) return left;
    return 2 * dt > left ? left / 2 : dt;
  }

  /// Forces and projection over dt. False when the projected field would carry a face's velocity more than twice as far as cfl allows:
  /// an impact the guess could not know of.
  bool try_velocity(double dt, const std::vector<CellKind>& kind, base::Ledger& ledger) {
    {
      const auto pass = ledger.pass("forces", std::int64_t(2 * lattice_.size * D * sizeof(Real)));
      for (int a = 0; a < D; ++a) {
        const Real change = Real(dt * gravity_[a]);
        base::parallel_chunks(lattice_.size, 65536, [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) grid_.velocity[a][i] = scattered_[a][i] + change;
        });
      }
    }
    const auto pass = ledger.pass("pressure");
    const PressureReport report = project(grid_.velocity, kind, lattice_, options_.pressure_tolerance, valid_);
    counters_.pressure_iterations += report.iterations;
    counters_.max_divergence = report.max_divergence / options_.cell;
    double fastest = 0;
    for (int a = 0; a < D; ++a)
      for (std::size_t i = 0; i < lattice_.size; ++i)
        if (valid_[a][i]) fastest = std::max(fastest, std::abs(double(grid_.velocity[a][i])));
    return fastest * dt <= 2 * options_.cfl * options_.cell;
  }

  GatherRule gather_rule(double dt) const {
    if (options_.transfer != Transfer::flip) return {};
    const double fall = std::sqrt(2 * gravity_.norm() * options_.domain.size().z());
    const double reference = std::max(fall, max_speed());
    const double time = options_.flip_time.value_or(reference > 0 ? 49.75 * options_.cell / reference : 1 / fps_);
    return {true, std::exp(-dt / time)};
  }

  double max_speed() const {
    return base::ordered_reduce(particles_.size(), 16384, 0.0, [&](std::size_t begin, std::size_t end) {
      double most = 0;
      for (std::size_t p = begin; p < end; ++p) most = std::max(most, particles_.velocity(p).template cast<double>().norm());
      return most;
    }, [](double a, double b) { return std::max(a, b); });
  }

  std::uint64_t state_hash() const;

  static constexpr double kShortestStep = 1e-4;   // [frames]
  Options options_;
  double fps_;
  base::Vec3 gravity_;
  Lattice<D> lattice_;
  Solids<D> solids_;
  MacTransfer<D, Real> transfer_;
  Particles<D, Real> particles_;
  CanonicalOrder<D, Real> order_;
  double particle_volume_ = 0;
  MacVelocity<D, Real> grid_;
  FaceField<D, Real> scattered_;   // the field after P2G, before forces
  FaceMask<D> valid_;
  std::int64_t frame_ = 1;
  Totals counters_;
};

template <int D, class Real>
Frame Liquid<D, Real>::frame() const {
  Frame f;
  f.number = frame_;
  f.time = double(frame_ - 1) / fps_;
  f.pscale = std::cbrt(3 * particle_volume_ / (4 * M_PI));
  const std::size_t n = particles_.size();
  f.position.resize(n), f.velocity.resize(n), f.id.resize(n);
  base::parallel_chunks(n, 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const auto to = std::size_t(particles_.id[p]);   // ids count from 0 without gaps
      base::Vec3 x = options_.domain.lower;
      x.head<D>() += options_.cell * particles_.place(p);
      base::Vec3f v = base::Vec3f::Zero();
      v.head<D>() = particles_.velocity(p).template cast<float>();
      f.position[to] = x.cast<float>();
      f.velocity[to] = v;
      f.id[to] = particles_.id[p];
    }
  });
  return f;
}

template <int D, class Real>
Totals Liquid<D, Real>::totals() const {
  Totals t = counters_;
  const std::size_t n = particles_.size();
  t.time = double(frame_ - 1) / fps_;
  t.particles = std::int64_t(n);
  t.mass = particles_.mass * double(n);
  t.volume = particle_volume_ * double(n);
  const auto sums = transfer_.sums(particles_, options_.cell);
  t.kinetic_energy = sums.kinetic_energy;
  t.linear_momentum = sums.linear_momentum;
  t.angular_momentum = sums.angular_momentum;
  t.potential_energy = -particles_.mass * base::ordered_reduce(n, 16384, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t p = begin; p < end; ++p) sum += options_.cell * gravity_.head<D>().dot(particles_.place(p));
    return sum;
  }, [](double a, double b) { return a + b; });
  t.max_speed = max_speed();
  t.state_hash = state_hash();
  return t;
}

template <int D, class Real>
State Liquid<D, Real>::state() const {
  State s;
  s.frame = frame_;
  s.columns.push_back(make_column<std::int32_t>("cell", particles_.cell, D));
  s.columns.push_back(make_column<Real>("offset", particles_.offset, D));
  s.columns.push_back(make_column<Real>("coefficients", particles_.coefficients, std::int64_t(particles_.row())));
  s.columns.push_back(make_column<std::int64_t>("id", particles_.id, 1));
  return s;
}

template <int D, class Real>
void Liquid<D, Real>::restore(const State& s) {
  const Column* const id = s.find("id");
  Particles<D, Real> p;
  p.modes = particles_.modes, p.mass = particles_.mass;
  const std::int64_t n = id ? id->rows : 0;
  const bool fits = s.frame >= 1 && read_column<std::int64_t>(s, "id", n, 1, p.id) && read_column<std::int32_t>(s, "cell", n, D, p.cell) &&
                    read_column<Real>(s, "offset", n, D, p.offset) &&
                    read_column<Real>(s, "coefficients", n, std::int64_t(p.row()), p.coefficients) &&
                    std::all_of(p.cell.begin(), p.cell.end(), [&](const Cell<D>& c) { return lattice_.inside(c); });
  if (!fits) throw base::Error({.message = "the state does not fit the scene"});
  particles_ = std::move(p);
  frame_ = s.frame;
  counters_ = {};
}

/// A hash of each particle's id, place and coefficients, summed: the order of storage does not matter.
template <int D, class Real>
std::uint64_t Liquid<D, Real>::state_hash() const {
  const auto bits = [](Real v) {
    std::uint64_t b = 0;
    std::memcpy(&b, &v, sizeof v);
    return b;
  };
  return base::ordered_reduce(particles_.size(), 16384, std::uint64_t{0}, [&](std::size_t begin, std::size_t end) {
    std::uint64_t sum = 0;
    for (std::size_t p = begin; p < end; ++p) {
      std::uint64_t h = scramble(std::uint64_t(particles_.id[p]));
      for (int a = 0; a < D; ++a) h = scramble(scramble(h ^ std::uint64_t(particles_.cell[p][a])) ^ bits(particles_.offset[p][a]));
      for (int a = 0; a < D; ++a)
        for (const Real c : particles_.component(p, a)) h = scramble(h ^ bits(c));
      sum += h;
    }
    return sum;
  }, [](std::uint64_t a, std::uint64_t b) { return a + b; });
}

}  // namespace

std::unique_ptr<Simulation> make_liquid(const Scene& scene, double fps) {
  if (scene.options.precision == Precision::double_precision) return std::make_unique<Liquid<3, double>>(scene, fps);
  return std::make_unique<Liquid<3, float>>(scene, fps);
}

}  // namespace sim
