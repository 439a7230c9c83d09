#include "sim/fluid/open_faces.h"

#include <algorithm>
#include <cmath>
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

/// Distances this near to 0 [cells] are 0. A collider whose side lies in the plane of faces closes them, whatever rounding says; and where it ends so
/// short of the plane that what it leaves open on the way there counts as closed.
constexpr double kOnSurface = kLeastOpening;

template <int D>
class Cutter {
 public:
  Cutter(const Solids<D>& solids, const Cell<D>& block) : solids_(solids), first_(Lattice<D>::cell_in(block, 0)) {
    constexpr double half = 0.5 * Lattice<D>::kBlock;
    const base::Vec3 middle = solids.place_in(first_, half);
    for (std::size_t n = 0; n < solids.shapes.size(); ++n) {
      if (solids.shapes[n].distance(middle) > (half * std::sqrt(double(D)) + 1) * solids.cell) continue;
      const double thick = thickness(solids.shapes[n], D) / solids.cell;
      near_.push_back({&solids.shapes[n], solids.motions[n], thick < 1 - 1e-6 ? int(std::ceil(4 / thick)) + 1 : 0});
      is_one_motion_ = is_one_motion_ && near_.back().motion == near_.front().motion;
    }
    const Lattice<D>& lattice = solids.lattice;
    for (int a = 0; a < D; ++a)
      touches_wall_ = touches_wall_ || (!lattice.periodic[a] && ((first_[a] <= 0 && !solids.open[std::size_t(a)][0]) ||
                                                                 (first_[a] + Lattice<D>::kBlock > lattice.cells[a] && !solids.open[std::size_t(a)][1])));
  }
  bool touches_solid() const { return touches_wall_ || !near_.empty(); }

  double fraction(int local, int axis) const {
    if (in_wall(local, axis)) return 0;
    return open_to(local, axis, nullptr);
  }
  /// What a wall covers rests, whatever collider is near. What a collider covers of a wall's face moves with it, as a piston's that has not come out yet;
  /// not what another one covers that moves otherwise.
  double pushed(int local, int axis, double fraction) const {
    if (near_.empty()) return 0;
    const double open = in_wall(local, axis) ? open_to(local, axis, nullptr) : fraction;
    if (open == 1) return 0;
    base::Vec3 middle = solids_.origin;   // of the face
    const Cell<D> at = place(local);
    for (int a = 0; a < D; ++a) middle[a] += (at[a] + (a == axis ? 0 : 0.5)) * solids_.cell;
    if (is_one_motion_) return (1 - open) * near_.front().motion.at(middle)[axis];
    double sum = 0;
    for (std::size_t n = 0; n < near_.size(); ++n) {
      const RigidMotion& motion = near_[n].motion;
      const bool was_asked = std::any_of(near_.begin(), near_.begin() + std::ptrdiff_t(n), [&](const Near& other) { return other.motion == motion; });
      if (const double pushed = motion.at(middle)[axis]; pushed != 0 && !was_asked) sum += (open_to(local, axis, &motion) - open) * pushed;
    }
    return sum;
  }

 private:
  struct Near {
    const Shape* shape;
    RigidMotion motion;
    int looks;             // along a cell's edge, that miss nothing of a collider thinner than that; 0: it is no such one
  };
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
  /// The part of a face that colliders leave open, but those that move with `motion`, where one is given.
  double open_to(int local, int axis, const RigidMotion* motion) const {
    const auto counts = [&](const Near& n) { return !motion || n.motion != *motion; };
    if (std::none_of(near_.begin(), near_.end(), counts)) return 1;
    const Cell<D> at = place(local);
    for (const Near& n : near_)
      if (n.looks > 0 && counts(n) && parts_middles(n, at, axis)) return 0;
    const double open = cut(at, axis, counts);
    return open < kLeastOpening ? 0 : open;
  }
  /// Whether a collider thinner than a cell, which may lie between faces and cut none, crosses the way between the middles of a face's cells.
  bool parts_middles(const Near& n, const Cell<D>& place, int axis) const {
    base::Vec3 from = solids_.origin;
    for (int a = 0; a < D; ++a) from[a] += (place[a] + (a == axis ? -0.5 : 0.5)) * solids_.cell;
    if (n.shape->distance(from) > solids_.cell) return false;
    for (int k = 0; k <= n.looks; ++k)
      if (n.shape->distance(from + double(k) / n.looks * solids_.cell * base::Vec3::Unit(axis)) < 0) return true;
    return false;
  }
  /// Distance [cells] at a place's lower corner, moved by halves of a cell.
  template <class Counts>
  double distance(const Cell<D>& place, const std::array<int, D>& halves, const Counts& counts) const {
    base::Vec3 at = solids_.origin;
    for (int a = 0; a < D; ++a) at[a] += (place[a] + 0.5 * halves[std::size_t(a)]) * solids_.cell;
    double least = 1e9;
    for (const Near& n : near_)
      if (counts(n)) least = std::min(least, n.shape->distance(at) / solids_.cell);
    return std::abs(least) < kOnSurface ? 0 : least;
  }
  template <class Counts>
  [[gnu::noinline]] double cut(const Cell<D>& place, int axis, const Counts& counts) const {
    std::array<int, D> middle{};
    for (int a = 0; a < D; ++a) middle[std::size_t(a)] = a != axis;
    const double centre = distance(place, middle, counts);
    if constexpr (D == 2) {
      std::array<int, D> end{};
      end[std::size_t(1 - axis)] = 2;
      return 0.5 * (positive_part(distance(place, {}, counts), centre) + positive_part(centre, distance(place, end, counts)));
    } else {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      std::array<double, 4> corner;
      for (int c = 0; c < 4; ++c) {
        std::array<int, D> halves{};
        halves[std::size_t(u)] = c == 1 || c == 2 ? 2 : 0;
        halves[std::size_t(v)] = c >= 2 ? 2 : 0;
        corner[std::size_t(c)] = distance(place, halves, counts);
      }
      double sum = 0;
      for (std::size_t c = 0; c < 4; ++c) sum += positive_part(centre, corner[c], corner[(c + 1) % 4]);
      return sum / 4;
    }
  }

  const Solids<D>& solids_;
  Cell<D> first_;
  std::vector<Near> near_;
  bool is_one_motion_ = true;       // of all that are near
  bool touches_wall_ = false;
};

/// Of the lower face of a block's place.
template <int D>
std::optional<double> held_at(const Sources<D>& sources, const Cell<D>& block, int local, int axis) {
  const Cell<D> above = Lattice<D>::cell_in(block, local);
  Cell<D> below = above;
  --below[std::size_t(axis)];
  return sources.held(below, above, axis);
}

}  // namespace

template <int D>
void OpenFaces<D>::update(const Solids<D>& solids, const ActiveBlocks<D>& blocks, const Sources<D>* sources) {
  const bool pours = sources && sources->acts(), moves = pours || solids.speed() > 0;
  const std::int64_t generation = sources ? sources->generation() : 0;
  if ((solids.speed() > 0 && solids.time() != time_) || generation != generation_) keys_.clear(), pushed_.clear(), held_.clear();
  if (keys_ == blocks.keys()) return;
  generation_ = generation;
  time_ = solids.time();
  std::vector<Fractions> before_pushed = std::move(pushed_);
  std::vector<Flags> before_held = std::move(held_);
  pushed_.clear(), held_.clear();
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
      if (pours) held_.push_back(before_held[std::size_t(part_[old])]);
    }
  }
  std::vector<Fractions> made(changed.size()), made_pushed(moves ? changed.size() : 0);
  std::vector<Flags> made_held(pours ? changed.size() : 0);
  std::vector<std::uint8_t> is_open(changed.size());
  base::parallel_chunks(changed.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Cutter<D> cutter(solids, blocks.block(changed[n]));
      bool open = true;
      const bool solid = cutter.touches_solid();
      if (solid || (pours && sources->touches(blocks.block(changed[n]))))
        for (int a = 0; a < D; ++a)
          for (int local = 0; local < int(kPerBlock); ++local) {
            const auto axis = std::size_t(a), place = std::size_t(local);
            const auto w = float(solid ? cutter.fraction(local, a) : 1);
            made[n][axis][place] = w;
            if (moves) made_pushed[n][axis][place] = float(solid ? cutter.pushed(local, a, double(w)) : 0);
            if (const std::optional<double> given = pours && w > 0 ? held_at<D>(*sources, blocks.block(changed[n]), local, a) : std::nullopt)
              made[n][axis][place] = 0, made_pushed[n][axis][place] += w * float(*given), made_held[n][axis].set(place);
            open = open && made[n][axis][place] == 1;
          }
      is_open[n] = open;
    }
  });
  for (std::size_t n = 0; n < changed.size(); ++n) {
    part[changed[n]] = is_open[n] ? kOpen : std::int32_t(fractions_.size());
    if (is_open[n]) continue;
    fractions_.push_back(made[n]);
    if (moves) pushed_.push_back(made_pushed[n]);
    if (pours) held_.push_back(made_held[n]);
  }
  part_ = std::move(part);
  keys_ = blocks.keys();
}

template class OpenFaces<2>;
template class OpenFaces<3>;

}  // namespace sim
