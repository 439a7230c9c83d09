#include "sim/fluid/births.h"

#include <algorithm>
#include <cmath>

#include "sim/effects/potential.h"
#include "sim/seeding.h"

namespace sim {
namespace {

template <int D>
Cell<D> cell_at(const Vec<D, double>& place) {
  Cell<D> cell;
  for (int a = 0; a < D; ++a) cell[std::size_t(a)] = int(std::floor(place[a]));
  return cell;
}

/// Room for so many, and a little more each time: vectors that grow by themselves double.
template <int D, class Real>
void reserve(std::size_t count, Particles<D, Real>& particles) {
  if (count <= particles.id.capacity()) return;
  const std::size_t room = count + count / 8;
  particles.cell.reserve(room), particles.offset.reserve(room), particles.id.reserve(room), particles.coefficients.reserve(room * particles.row());
}

}  // namespace

template <int D, class Real>
auto Births<D, Real>::until(double time, const Particles<D, Real>& particles) -> std::vector<Born> {
  std::vector<Born> born;
  for (int s = 0; s < sources_.count(); ++s) {
    double& until = given_.until[std::size_t(s)];
    if (!sources_.has_begun(s, time)) continue;
    if (until < sources_.start(s)) {
      until = sources_.start(s);
      std::vector<Cell<D>> taken;
      for (const Cell<D>& cell : particles.cell)
        if (sources_.holds(s, cell)) taken.push_back(cell);
      std::sort(taken.begin(), taken.end());
      for (const Born& b : sources_.fill(s, time))
        if (!std::binary_search(taken.begin(), taken.end(), cell_at<D>(b.seed))) born.push_back(b);
    }
    const std::vector<Born> came = sources_.pour(s, until, time);
    born.insert(born.end(), came.begin(), came.end());
    until = std::max(until, time);
  }
  std::sort(born.begin(), born.end());
  return born;
}

template <int D, class Real>
void Births<D, Real>::bear(const std::vector<Born>& born, Particles<D, Real>& particles) {
  if (born.empty()) return;
  particles.settle();
  const std::size_t before = particles.size();
  reserve(before + born.size(), particles);
  for (const Born& b : born) {
    const std::int64_t id = given_.next_id++;
    Moving<D, Real> particle{{solids_.lattice.wrapped(cell_at<D>(b.place)), {}}, Vec<D, Real>::Zero()};
    base::Vec3 at = options_.domain.lower;
    for (int a = 0; a < D; ++a) {
      const double within = b.place[a] - std::floor(b.place[a]);
      particle.site.offset[a] = std::min(Real(within), std::nextafter(Real(1), Real(0)));
      at[a] += options_.cell * (particle.site.cell[std::size_t(a)] + within);
    }
    if (any_holds(solids_.shapes, at)) continue;
    solids_.push_out(particle);
    if (!solids_.lattice.inside(particle.site.cell)) continue;
    const base::Vec3 velocity = sources_.velocity(b.source);
    particles.cell.push_back(particle.site.cell), particles.offset.push_back(particle.site.offset), particles.id.push_back(id);
    particles.coefficients.resize(particles.coefficients.size() + particles.row(), Real(0));
    for (int a = 0; a < D; ++a) particles.component(particles.size() - 1, a)[0] = Real(velocity[a]);
    given_.energy += particles.mass * (0.5 * velocity.squaredNorm() + energy_of_place<D>(b.place, down_, options_));
  }
  given_.count += std::int64_t(particles.size() - before);
}

template class Births<2, float>;
template class Births<2, double>;
template class Births<3, float>;
template class Births<3, double>;

}  // namespace sim
