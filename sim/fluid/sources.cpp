#include "sim/fluid/sources.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "sim/random.h"
#include "sim/seeding.h"

namespace sim {
namespace {

constexpr double kEdge = 1e-6;   // [cells] that a middle is moved by, off the edge of a shape

template <int D>
Cell<D> stepped(Cell<D> at, int axis, int by) {
  at[std::size_t(axis)] += by;
  return at;
}

}  // namespace

template <int D>
bool Sources<D>::Born::operator<(const Born& other) const {
  const auto key = [](const Born& b) { return std::tie(b.time, b.source); };
  if (key(*this) != key(other)) return key(*this) < key(other);
  return std::lexicographical_compare(seed.data(), seed.data() + D, other.seed.data(), other.seed.data() + D);
}

template <int D>
Sources<D>::Sources(const Scene& scene, const Solids<D>& solids, double slack)
    : options_(scene.options), lattice_(solids.lattice), slack_(slack), edge_(places_along_edge<D>(scene.options)), acting_(scene.sources.size(), 0) {
  for (const sim::Source& source : scene.sources) {
    Source s{.velocity = source.velocity, .way = source.velocity.head<D>() / options_.cell, .start = source.start,
             .end = source.end.value_or(std::numeric_limits<double>::infinity()), .cells = {}, .lower = {}, .upper = {}, .upstream = {}, .shut = {}};
    const std::vector<Shape> shapes = with_images(source.shape, options_);
    for (const std::int64_t number : cells_around<D>(shapes, options_, lattice_)) {
      const Cell<D> at = cell_of<D>(number, lattice_);
      const bool taken = std::any_of(sources_.begin(), sources_.end(), [&](const Source& other) { return other.overlaps(s) && other.holds(at); });
      if (!taken && any_holds(shapes, solids.place_in(at, 0.5 + kEdge)) && !solids.solid(at)) s.cells.push_back(at);
    }
    std::sort(s.cells.begin(), s.cells.end());
    if (!s.cells.empty()) s.lower = s.upper = s.cells.front();
    for (const Cell<D>& at : s.cells)
      for (std::size_t a = 0; a < std::size_t(D); ++a) s.lower[a] = std::min(s.lower[a], at[a]), s.upper[a] = std::max(s.upper[a], at[a]);
    for (const Cell<D>& at : s.cells)
      for (int a = 0; a < D; ++a)
        if (s.way[a] != 0 && !s.holds(lattice_.wrapped(stepped<D>(at, a, s.way[a] > 0 ? -1 : 1)))) s.upstream.push_back({at, a});
    sources_.push_back(std::move(s));
  }
}

template <int D>
std::vector<Cell<D>> Sources<D>::shut(int source, const Solids<D>& solids) const {
  const Source& s = one(source);
  std::vector<Cell<D>> found;
  const auto blocks = [&](const Cell<D>& next) {
    if (s.holds(next)) return std::binary_search(found.begin(), found.end(), next);
    const auto is_other = [&](const Source& o) { return &o != &s && o.overlaps(s) && o.velocity != s.velocity && o.holds(next); };
    const bool other = std::any_of(sources_.begin(), sources_.end(), is_other);
    return other || solids.solid(next);
  };
  for (std::size_t before = found.size() + 1; before != found.size();) {   // a cell behind one that is shut is shut, too
    before = found.size();
    std::vector<Cell<D>> more;
    for (const Cell<D>& cell : s.cells)
      for (int a = 0; a < D; ++a)
        if (s.way[a] != 0 && blocks(lattice_.wrapped(stepped<D>(cell, a, s.way[a] > 0 ? 1 : -1)))) {
          more.push_back(cell);
          break;
        }
    found = std::move(more);
  }
  return found;
}

template <int D>
double Sources<D>::next_change(double time) const {
  double next = std::numeric_limits<double>::infinity();
  for (const Source& s : sources_)
    for (const double change : {s.start, s.end})
      if (change > time + slack_) next = std::min(next, change);
  return next;
}

template <int D>
void Sources<D>::begin_step(double time, const Solids<D>& solids) {
  std::vector<std::uint8_t> acting;
  for (const Source& s : sources_) acting.push_back(s.start <= time + slack_ && time + slack_ < s.end);
  const bool moves = solids.speed() > 0;
  if (acting == acting_ && !moves) return;
  acting_ = std::move(acting);
  std::vector<Owned> owned;
  for (std::size_t s = 0; s < sources_.size(); ++s) {
    if (!acting_[s]) continue;
    Source& source = sources_[s];
    if (moves) source.shut = shut(int(s), solids);
    for (const Cell<D>& cell : source.cells)
      if (!std::binary_search(source.shut.begin(), source.shut.end(), cell)) owned.push_back({cell, int(s)});
  }
  std::sort(owned.begin(), owned.end(), [](const Owned& one, const Owned& other) { return one.cell < other.cell; });
  if (owned == owned_) return;
  owned_ = std::move(owned);
  ++generation_;
  if (!owned_.empty()) lower_ = upper_ = owned_.front().cell;
  for (const Owned& one : owned_)
    for (std::size_t a = 0; a < std::size_t(D); ++a) lower_[a] = std::min(lower_[a], one.cell[a]), upper_[a] = std::max(upper_[a], one.cell[a]);
}

template <int D>
double Sources<D>::speed() const {
  double most = 0;
  for (std::size_t s = 0; s < sources_.size(); ++s)
    if (acting_[s]) most = std::max(most, sources_[s].velocity.norm());
  return most;
}

template <int D>
bool Sources<D>::touches(const Cell<D>& block) const {
  constexpr int n = Lattice<D>::kBlock;
  for (std::size_t s = 0; s < sources_.size(); ++s) {
    bool touches = acting_[s] && !sources_[s].cells.empty();
    for (std::size_t a = 0; touches && a < std::size_t(D); ++a) {
      const bool round = lattice_.periodic[a] && block[a] == 0 && sources_[s].upper[a] == lattice_.cells[a] - 1;   // the first block is above the last
      touches = round || (block[a] * n <= sources_[s].upper[a] + 1 && (block[a] + 1) * n > sources_[s].lower[a]);
    }
    if (touches) return true;
  }
  return false;
}

template <int D>
std::optional<double> Sources<D>::held(const Cell<D>& below, const Cell<D>& above, int axis) const {
  const int under = at(lattice_.wrapped(below)), over = at(lattice_.wrapped(above));
  if (under == kNone && over == kNone) return {};
  if (under == kNone) return std::min(velocity(over)[axis], 0.0);   // what comes in here is born, and drawn from nowhere
  if (over == kNone) return std::max(velocity(under)[axis], 0.0);
  return 0.5 * (velocity(under)[axis] + velocity(over)[axis]);
}

template <int D>
template <class Real>
void Sources<D>::push_out(const Solids<D>& solids, Site<D, Real>& site) const {
  constexpr Real kSkin = Real(1e-3);   // [cells]
  Real nearest = 1;
  Vec<D, Real> way = Vec<D, Real>::Zero();
  for (int a = 0; a < D; ++a)
    for (const int side : {-1, 1}) {
      const Cell<D> beyond = lattice_.wrapped(stepped<D>(site.cell, a, side));
      const Real far = side < 0 ? site.offset[a] : 1 - site.offset[a];
      if (far >= nearest || at(beyond) != kNone || solids.solid(beyond)) continue;
      nearest = far, way = Real(side) * (far + kSkin) * Vec<D, Real>::Unit(a);
    }
  site.move(way);
  site.cell = lattice_.wrapped(site.cell);
}

template <int D>
double Sources<D>::rate(int source) const {
  double cells = 0;
  for (const Side& side : one(source).upstream) cells += std::abs(one(source).way[side.axis]);
  return cells * double(options_.particles_per_cell);
}

template <int D>
template <class Visit>
void Sources<D>::for_seeds(int source, const Vec<D, double>& lower, const Vec<D, double>& upper, const Visit& visit) const {
  using Place = std::array<std::int64_t, std::size_t(D)>;
  Place first, last;
  for (int a = 0; a < D; ++a)
    first[std::size_t(a)] = std::int64_t(std::floor(lower[a])), last[std::size_t(a)] = std::int64_t(std::floor(upper[a]));
  const std::uint64_t seed = scramble(std::uint64_t(options_.seed) ^ scramble(std::uint64_t(source) + 1));
  for (Place at = first; at[0] <= last[0];) {
    std::uint64_t number = 0;
    for (const std::int64_t along : at) number = scramble(number ^ std::uint64_t(along));
    for (int sub = 0; sub < int(options_.particles_per_cell); ++sub) {
      Vec<D, double> place;
      for (int a = D - 1, rest = sub; a >= 0; --a, rest /= edge_) {
        const double within = options_.seeding == Seeding::regular ? 0.5 : uniform(seed, number, std::uint64_t(sub * D + a));
        place[a] = double(at[std::size_t(a)]) + (rest % edge_ + within) / edge_;
      }
      visit(place);
    }
    std::size_t a = std::size_t(D) - 1;
    while (a > 0 && at[a] == last[a]) at[a] = first[a], --a;
    ++at[a];
  }
}

template <int D>
auto Sources<D>::fill(int source, double now) const -> std::vector<Born> {
  const Source& s = one(source);
  std::vector<Born> all;
  now = std::max(now, s.start);
  for (const Cell<D>& cell : s.cells) {
    Vec<D, double> at;
    for (int a = 0; a < D; ++a) at[a] = cell[std::size_t(a)];
    for_seeds(source, at, at, [&](const Vec<D, double>& seed) { all.push_back({s.start, source, seed, seed + (now - s.start) * s.way}); });
  }
  std::sort(all.begin(), all.end());
  return all;
}

/// [cells] A row of places that meets a periodic side exactly has an image at the other one, and rounding must not put both outside.
constexpr double kRounding = 1e-9;

template <int D>
auto Sources<D>::pour(int source, double from, double to) const -> std::vector<Born> {
  const Source& s = one(source);
  std::vector<Born> all;
  const double first = from - s.start, last = std::min(to, s.end) - s.start, now = to - s.start;   // [s] since it began
  if (!(last > first)) return all;
  for (const auto& [cell, axis] : s.upstream) {
    const Cell<D> outside = lattice_.wrapped(stepped<D>(cell, axis, s.way[axis] > 0 ? -1 : 1));
    if (std::binary_search(s.shut.begin(), s.shut.end(), cell) || at(outside) != kNone) continue;   // what another source brings is no birth
    const double plane = cell[std::size_t(axis)] + (s.way[axis] > 0 ? 0 : 1);
    Vec<D, double> lower, upper;   // of the seeds that may cross this side
    for (int a = 0; a < D; ++a) {
      const double low = a == axis ? plane : cell[std::size_t(a)], high = a == axis ? plane : cell[std::size_t(a)] + 1;
      lower[a] = low - std::max(first * s.way[a], last * s.way[a]), upper[a] = high - std::min(first * s.way[a], last * s.way[a]);
    }
    for_seeds(source, lower, upper, [&, axis = axis, cell = cell](const Vec<D, double>& seed) {
      const double crossed = (plane - seed[axis]) / s.way[axis];   // [s] since it began
      if (!(crossed > first && crossed <= last)) return;
      for (int a = 0; a < D; ++a)
        if (a != axis && int(std::floor(seed[a] + crossed * s.way[a] + kRounding)) != cell[std::size_t(a)]) return;
      Vec<D, double> place = seed + now * s.way;   // behind the side that it has crossed, whatever rounding says
      place[axis] = s.way[axis] > 0 ? std::max(place[axis], plane) : std::min(place[axis], std::nextafter(plane, -1.0));
      all.push_back({s.start + crossed, source, seed, place});
    });
  }
  std::sort(all.begin(), all.end());
  return all;
}

template class Sources<2>;
template class Sources<3>;
template void Sources<2>::push_out(const Solids<2>&, Site<2, float>&) const;
template void Sources<2>::push_out(const Solids<2>&, Site<2, double>&) const;
template void Sources<3>::push_out(const Solids<3>&, Site<3, float>&) const;
template void Sources<3>::push_out(const Solids<3>&, Site<3, double>&) const;

}  // namespace sim
