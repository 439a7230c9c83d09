#include "sim/fluid/open_faces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.h"

namespace sim {

double positive_part(double a, double b) {
  if (a <= 0 && b <= 0) return 0;
  if (a >= 0 && b >= 0) return 1;
  return std::max(a, b) / std::abs(a - b);
}

double positive_part(double a, double b, double c) {
  if (a < b) std::swap(a, b);
  if (b < c) std::swap(b, c);
  if (a < b) std::swap(a, b);
  if (a <= 0) return 0;
  if (c >= 0) return 1;
  if (b <= 0) return a / (a - b) * (a / (a - c));
  return 1 - c / (c - a) * (c / (c - b));
}

namespace {

/// Distances this near to 0 [cells] are 0: a collider whose side lies in the plane of faces closes them, whatever rounding says.
constexpr double kOnSurface = 1e-6;

template <int D>
class Cutter {
 public:
  Cutter(const Solids<D>& solids, const Cell<D>& block) : solids_(solids), first_(Lattice<D>::cell_in(block, 0)) {
    constexpr double half = 0.5 * Lattice<D>::kBlock;
    base::Vec3 middle = solids.origin;
    for (int a = 0; a < D; ++a) middle[a] += (first_[a] + half) * solids.cell;
    for (const Shape& shape : solids.shapes)
      if (shape.distance(middle) <= half * std::sqrt(double(D)) * solids.cell) near_.push_back(std::size_t(&shape - solids.shapes.data()));
    const Lattice<D>& lattice = solids.lattice;
    for (int a = 0; a < D; ++a)
      touches_wall_ = touches_wall_ || (!lattice.periodic[a] && ((first_[a] <= 0 && !solids.open[std::size_t(a)][0]) ||
                                                                 (first_[a] + Lattice<D>::kBlock > lattice.cells[a] && !solids.open[std::size_t(a)][1])));
  }
  bool touches_solid() const { return touches_wall_ || !near_.empty(); }

  double fraction(int local, int axis) const {
    if (in_wall(local, axis)) return 0;
    if (near_.empty()) return 1;
    const double open = cut(place(local), axis);
    return open < kLeastOpening ? 0 : open;
  }
  /// What a wall covers rests, whatever collider is near. What a collider covers of a wall's face moves with it, as a piston's that has not come out yet.
  double pushed(int local, int axis, double fraction) const {
    if (near_.empty()) return 0;
    const double open = in_wall(local, axis) ? cut(place(local), axis) : fraction;
    return open < 1 ? (1 - open) * solid_speed(local, axis) : 0;
  }

 private:
  Cell<D> place(int local) const {
    Cell<D> at = Lattice<D>::cell_in(Cell<D>{}, local);
    for (int a = 0; a < D; ++a) at[a] += first_[a];
    return at;
  }
  bool in_wall(int local, int axis) const {
    const Cell<D> at = place(local);
    for (int a = 0; a < D; ++a) {
      const bool below = at[a] < (a == axis), above = at[a] >= solids_.lattice.cells[a];
      if ((below || above) && !solids_.lattice.periodic[a] && !solids_.open[std::size_t(a)][above]) return true;
    }
    return false;
  }
  /// Along the axis, of the collider that is nearest to a face's middle [m/s].
  double solid_speed(int local, int axis) const {
    base::Vec3 at = solids_.origin;
    const Cell<D> lower = place(local);
    for (int a = 0; a < D; ++a) at[a] += (lower[a] + (a == axis ? 0 : 0.5)) * solids_.cell;
    double least = std::numeric_limits<double>::infinity(), speed = 0;
    for (const std::size_t s : near_)
      if (const double far = solids_.shapes[s].distance(at); far < least) least = far, speed = solids_.velocities[s][axis];
    return speed;
  }
  /// Distance [cells] at a place's lower corner, moved by halves of a cell.
  double distance(const Cell<D>& place, const std::array<int, D>& halves) const {
    base::Vec3 at = solids_.origin;
    for (int a = 0; a < D; ++a) at[a] += (place[a] + 0.5 * halves[std::size_t(a)]) * solids_.cell;
    double least = 1e9;
    for (const std::size_t s : near_) least = std::min(least, solids_.shapes[s].distance(at) / solids_.cell);
    return std::abs(least) < kOnSurface ? 0 : least;
  }
  [[gnu::noinline]] double cut(const Cell<D>& place, int axis) const {
    std::array<int, D> middle{};
    for (int a = 0; a < D; ++a) middle[std::size_t(a)] = a != axis;
    const double centre = distance(place, middle);
    if constexpr (D == 2) {
      std::array<int, D> end{};
      end[std::size_t(1 - axis)] = 2;
      return 0.5 * (positive_part(distance(place, {}), centre) + positive_part(centre, distance(place, end)));
    } else {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      std::array<double, 4> corner;
      for (int c = 0; c < 4; ++c) {
        std::array<int, D> halves{};
        halves[std::size_t(u)] = c == 1 || c == 2 ? 2 : 0;
        halves[std::size_t(v)] = c >= 2 ? 2 : 0;
        corner[std::size_t(c)] = distance(place, halves);
      }
      double sum = 0;
      for (std::size_t c = 0; c < 4; ++c) sum += positive_part(centre, corner[c], corner[(c + 1) % 4]);
      return sum / 4;
    }
  }

  const Solids<D>& solids_;
  Cell<D> first_;
  std::vector<std::size_t> near_;   // places in Solids::shapes
  bool touches_wall_ = false;
};

}  // namespace

template <int D>
void OpenFaces<D>::update(const Solids<D>& solids, const ActiveBlocks<D>& blocks) {
  const bool moves = solids.speed() > 0;
  if (moves && solids.time() != time_) keys_.clear(), pushed_.clear();
  if (keys_ == blocks.keys()) return;
  time_ = solids.time();
  std::vector<Fractions> before_pushed = std::move(pushed_);
  pushed_.clear();
  std::vector<Fractions> before = std::move(fractions_);
  std::vector<std::int32_t> part(blocks.count(), kNew);
  std::vector<std::size_t> changed;
  fractions_.clear();
  for (std::size_t slot = 0, old = 0; slot < blocks.count(); ++slot) {
    while (old < keys_.size() && keys_[old] < blocks.keys()[slot]) ++old;
    if (old == keys_.size() || keys_[old] != blocks.keys()[slot]) {
      changed.push_back(slot);
    } else {
      part[slot] = part_[old];
      if (part_[old] < 0) continue;
      part[slot] = std::int32_t(fractions_.size());
      fractions_.push_back(before[std::size_t(part_[old])]);
      if (moves) pushed_.push_back(before_pushed[std::size_t(part_[old])]);
    }
  }
  std::vector<Fractions> made(changed.size()), made_pushed(moves ? changed.size() : 0);
  std::vector<std::uint8_t> is_open(changed.size());
  base::parallel_chunks(changed.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Cutter<D> cutter(solids, blocks.block(changed[n]));
      bool open = true;
      if (cutter.touches_solid())
        for (int a = 0; a < D; ++a)
          for (int local = 0; local < int(kPerBlock); ++local) {
            const auto w = float(cutter.fraction(local, a));
            made[n][std::size_t(a)][std::size_t(local)] = w;
            open = open && w == 1;
            if (moves) made_pushed[n][std::size_t(a)][std::size_t(local)] = float(cutter.pushed(local, a, double(w)));
          }
      is_open[n] = open;
    }
  });
  for (std::size_t n = 0; n < changed.size(); ++n) {
    part[changed[n]] = is_open[n] ? kOpen : std::int32_t(fractions_.size());
    if (is_open[n]) continue;
    fractions_.push_back(made[n]);
    if (moves) pushed_.push_back(made_pushed[n]);
  }
  part_ = std::move(part);
  keys_ = blocks.keys();
}

template class OpenFaces<2>;
template class OpenFaces<3>;

}  // namespace sim
