#include "sim/fluid/open_faces.h"

#include <algorithm>
#include <cmath>
#include <memory>
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

double integral_of_rest(std::array<double, 2> d, std::array<double, 2> v) {
  if (d[0] > d[1]) std::swap(d[0], d[1]), std::swap(v[0], v[1]);
  const double rest = 1 - positive_part(d[0], d[1]);
  return rest * (v[0] + rest / 2 * (v[1] - v[0]));
}

double integral_of_rest(std::array<double, 3> d, std::array<double, 3> v) {
  for (const auto& [m, n] : {std::pair(0, 1), {1, 2}, {0, 1}})
    if (d[std::size_t(m)] > d[std::size_t(n)]) std::swap(d[std::size_t(m)], d[std::size_t(n)]), std::swap(v[std::size_t(m)], v[std::size_t(n)]);
  const auto corner = [&](std::size_t tip, std::size_t b, std::size_t c) {   // of the part on the tip's side of 0
    const double to_b = d[tip] / (d[tip] - d[b]), to_c = d[tip] / (d[tip] - d[c]);
    return to_b * to_c * (v[tip] + (to_b * (v[b] - v[tip]) + to_c * (v[c] - v[tip])) / 3);
  };
  const double all = (v[0] + v[1] + v[2]) / 3;
  if (d[2] <= 0) return all;
  if (d[0] >= 0) return 0;
  return d[1] > 0 ? corner(0, 1, 2) : all - corner(2, 0, 1);
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
  bool touches_collider() const { return !near_.empty(); }
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
    const Cell<D> at = place(local);
    const base::Vec3 middle = place_at(at, middle_of(axis));
    const auto is_swept = [&](const RigidMotion& motion) { return open > 0 && !motion.spin.isZero(0); };
    if (is_one_motion_) {
      const RigidMotion& motion = near_.front().motion;
      return is_swept(motion) ? swept(at, axis, motion, nullptr) : (1 - open) * motion.at(middle)[axis];
    }
    double sum = 0;
    for (std::size_t n = 0; n < near_.size(); ++n) {
      const RigidMotion& motion = near_[n].motion;
      const bool was_asked = std::any_of(near_.begin(), near_.begin() + std::ptrdiff_t(n), [&](const Near& other) { return other.motion == motion; });
      if (was_asked || motion.rests()) continue;
      sum += is_swept(motion) ? swept(at, axis, motion, nullptr) - swept(at, axis, motion, &motion) : (open_to(local, axis, &motion) - open) * motion.at(middle)[axis];
    }
    return sum;
  }
  /// Of the collider nearest to a face's middle; none of a wall's face.
  typename OpenFaces<D>::Plane plane(int local, int axis) const {
    typename OpenFaces<D>::Plane found;
    if (in_wall(local, axis)) return found;
    const base::Vec3 middle = place_at(place(local), middle_of(axis));
    double least = 1e9;
    for (const Near& n : near_) {
      base::Vec3 normal;
      const double distance = n.shape->distance(middle, &normal);
      if (distance >= least) continue;
      least = distance;
      const base::Vec3 velocity = n.motion.at(middle);
      for (int a = 0; a < D; ++a) found.normal[std::size_t(a)] = float(normal[a]), found.velocity[std::size_t(a)] = float(velocity[a]);
    }
    return found;
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
  static constexpr std::size_t kCorners = D == 2 ? 2 : 4;   // of a face
  using Halves = std::array<int, std::size_t(D)>;           // of a cell, from a place's lower corner
  static Halves middle_of(int axis) {
    Halves halves{};
    for (int a = 0; a < D; ++a) halves[std::size_t(a)] = a != axis;
    return halves;
  }
  /// The corners of a face, in turn.
  static Halves corner_of(int axis, std::size_t c) {
    Halves halves{};
    halves[std::size_t((axis + 1) % D)] = c == 1 || c == 2 ? 2 : 0;
    if constexpr (D == 3) halves[std::size_t((axis + 2) % 3)] = c >= 2 ? 2 : 0;
    return halves;
  }
  /// [m]
  base::Vec3 place_at(const Cell<D>& place, const Halves& halves) const {
    base::Vec3 at = solids_.origin;
    for (int a = 0; a < D; ++a) at[a] += (place[a] + 0.5 * halves[std::size_t(a)]) * solids_.cell;
    return at;
  }
  /// [cells] from the nearest of the colliders that count.
  template <class Counts>
  double distance(const Cell<D>& place, const Halves& halves, const Counts& counts) const {
    const base::Vec3 at = place_at(place, halves);
    double least = 1e9;
    for (const Near& n : near_)
      if (counts(n)) least = std::min(least, n.shape->distance(at) / solids_.cell);
    return std::abs(least) < kOnSurface ? 0 : least;
  }
  template <class Counts>
  [[gnu::noinline]] double cut(const Cell<D>& place, int axis, const Counts& counts) const {
    const double centre = distance(place, middle_of(axis), counts);
    std::array<double, kCorners> corner;
    for (std::size_t c = 0; c < kCorners; ++c) corner[c] = distance(place, corner_of(axis, c), counts);
    double sum = 0;
    for (std::size_t c = 0; c < kCorners; ++c) {
      if constexpr (D == 2) sum += positive_part(corner[c], centre);
      else sum += positive_part(centre, corner[c], corner[(c + 1) % kCorners]);
    }
    return sum / double(kCorners);
  }

  /// What goes through the part of a face that colliders cover, all but those that move with `without`, where all move with a motion that turns [m/s]:
  /// of a ball about its middle as much in as out.
  double swept(const Cell<D>& place, int axis, const RigidMotion& motion, const RigidMotion* without) const {
    const auto counts = [&](const Near& n) { return !without || n.motion != *without; };
    std::array<double, kCorners> distances, speeds;
    for (std::size_t c = 0; c < kCorners; ++c) {
      const Halves corner = corner_of(axis, c);
      distances[c] = distance(place, corner, counts), speeds[c] = motion.at(place_at(place, corner))[axis];
    }
    const double centre = distance(place, middle_of(axis), counts), central = motion.at(place_at(place, middle_of(axis)))[axis];
    double sum = 0;
    for (std::size_t c = 0; c < kCorners; ++c) {
      const std::size_t next = (c + 1) % kCorners;
      if constexpr (D == 2) sum += integral_of_rest(std::array{distances[c], centre}, std::array{speeds[c], central});
      else sum += integral_of_rest(std::array{distances[c], distances[next], centre}, std::array{speeds[c], speeds[next], central});
    }
    return sum / double(kCorners);
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
  std::vector<Planes> before_planes = std::move(planes_);
  const std::vector<std::int32_t> before_at = std::move(planes_at_);
  std::vector<std::int32_t> part(blocks.count(), kNew);
  std::vector<std::size_t> changed;
  fractions_.clear(), planes_.clear(), planes_at_.clear();
  const auto add_planes = [&](const Planes* planes) {
    planes_at_.push_back(planes ? std::int32_t(planes_.size()) : kOpen);
    if (planes) planes_.push_back(*planes);
  };
  for (std::size_t slot = 0, old = 0; slot < blocks.count(); ++slot) {
    while (old < keys_.size() && keys_[old] < blocks.keys()[slot]) ++old;
    if (old == keys_.size() || keys_[old] != blocks.keys()[slot]) {
      changed.push_back(slot);
    } else {
      part[slot] = part_[old];
      if (part_[old] < 0) continue;
      part[slot] = std::int32_t(fractions_.size());
      fractions_.push_back(before[std::size_t(part_[old])]);
      const std::int32_t at = before_at[std::size_t(part_[old])];
      add_planes(at < 0 ? nullptr : &before_planes[std::size_t(at)]);
      if (moves) pushed_.push_back(before_pushed[std::size_t(part_[old])]);
      if (pours) held_.push_back(before_held[std::size_t(part_[old])]);
    }
  }
  std::vector<Fractions> made(changed.size()), made_pushed(moves ? changed.size() : 0);
  std::vector<Flags> made_held(pours ? changed.size() : 0);
  std::vector<std::unique_ptr<Planes>> made_planes(changed.size());
  std::vector<std::uint8_t> is_open(changed.size());
  base::parallel_chunks(changed.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Cutter<D> cutter(solids, blocks.block(changed[n]));
      bool open = true;
      const bool solid = cutter.touches_solid();
      if (cutter.touches_collider()) made_planes[n] = std::make_unique<Planes>();
      if (solid || (pours && sources->touches(blocks.block(changed[n]))))
        for (int a = 0; a < D; ++a)
          for (int local = 0; local < int(kPerBlock); ++local) {
            const auto axis = std::size_t(a), place = std::size_t(local);
            const auto w = float(solid ? cutter.fraction(local, a) : 1);
            made[n][axis][place] = w;
            if (made_planes[n] && w < 1) (*made_planes[n])[axis][place] = cutter.plane(local, a);
            if (moves) made_pushed[n][axis][place] = float(solid ? cutter.pushed(local, a, double(w)) : 0);
            if (const std::optional<double> given = pours && w > 0 ? held_at<D>(*sources, blocks.block(changed[n]), local, a) : std::nullopt)
              made[n][axis][place] = 0, made_pushed[n][axis][place] += w * float(*given), made_held[n][axis].set(place);
            if (made_planes[n] && made[n][axis][place] != w) (*made_planes[n])[axis][place] = {};
            open = open && made[n][axis][place] == 1;
          }
      is_open[n] = open;
    }
  });
  for (std::size_t n = 0; n < changed.size(); ++n) {
    part[changed[n]] = is_open[n] ? kOpen : std::int32_t(fractions_.size());
    if (is_open[n]) continue;
    fractions_.push_back(made[n]);
    add_planes(made_planes[n].get());
    if (moves) pushed_.push_back(made_pushed[n]);
    if (pours) held_.push_back(made_held[n]);
  }
  part_ = std::move(part);
  keys_ = blocks.keys();
}

template class OpenFaces<2>;
template class OpenFaces<3>;

}  // namespace sim
