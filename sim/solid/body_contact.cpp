#include "sim/solid/body_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "sim/transfer/place_set.h"

namespace sim {
namespace {

constexpr double kTouch = 1.2;   // [spacings of particles] twice as far as one reaches to a collider
constexpr std::size_t kBlocksAtOnce = 16;

/// How a body meets others.
Rubbing rubbing_of(const Body& b) {
  if (b.contact == Contact::sticky) return {Contact::sticky, std::numeric_limits<double>::infinity()};
  return {b.contact, b.contact == Contact::separating ? b.friction : 0};
}

/// The particles of a field, by the node that is nearest to them.
template <int D, class Real>
class ByNode {
 public:
  static constexpr std::size_t kNodes = std::size_t(Lattice<D>::kCellsPerBlock);
  PlaceSet<D> occupied;

  ByNode(const ActiveBlocks<D>& blocks, const std::vector<Group<D, Real>>& groups, const std::vector<std::size_t>& bodies) : occupied(blocks) {
    for (const std::size_t body : bodies) {
      const CellRanges& ranges = groups[body].ranges;
      Own& own = own_.emplace_back(Own{groups[body].particles, ranges, std::vector<std::int32_t>(blocks.count(), -1)});
      for (std::size_t b = 0; b < ranges.occupied.size(); ++b) {
        const auto slot = std::size_t(blocks.slot(ranges.occupied[b]));
        own.block[slot] = std::int32_t(b);
        for (std::size_t k = 0; k < kNodes; ++k)
          if (ranges.begin[b * kNodes + k] < ranges.begin[b * kNodes + k + 1]) occupied[slot] |= PlaceBits{1} << k;
        slots_.push_back(slot);
      }
    }
    std::sort(slots_.begin(), slots_.end());
    slots_.erase(std::unique(slots_.begin(), slots_.end()), slots_.end());
  }
  /// Whether any of its nodes is in a set.
  bool meets(const PlaceSet<D>& set) const {
    return std::any_of(slots_.begin(), slots_.end(), [&](std::size_t slot) { return (occupied[slot] & set[slot]) != 0; });
  }
  /// Slots of the blocks that it has particles in.
  const std::vector<std::size_t>& slots() const { return slots_; }
  /// Whether is(place [cells], from the node on) says so of any particle of a node.
  template <class Is>
  bool any(std::size_t node, const Is& is) const {
    for (const Own& own : own_) {
      const std::int32_t block = own.block[node / kNodes];
      if (block < 0) continue;
      const std::uint32_t* const begin = &own.ranges.begin[std::size_t(block) * kNodes + node % kNodes];
      for (std::uint32_t p = begin[0]; p < begin[1]; ++p) {
        Vec<D, Real> place = own.particles.offset[p];
        for (int a = 0; a < D; ++a) place[a] -= Real(place[a] >= Real(0.5));
        if (is(place)) return true;
      }
    }
    return false;
  }

 private:
  struct Own {
    const Particles<D, Real>& particles;
    const CellRanges& ranges;
    std::vector<std::int32_t> block;   // by slot, its number in the ranges; -1 where it holds none
  };
  std::vector<Own> own_;
  std::vector<std::size_t> slots_;
};

/// The set, and all that is beside, along axes and diagonals.
template <int D>
PlaceSet<D> grown(const ActiveBlocks<D>& blocks, PlaceSet<D> set) {
  for (int a = 0; a < D; ++a) {
    PlaceSet<D> wider(blocks);
    for (std::size_t slot = 0; slot < blocks.count(); ++slot)
      wider[slot] = (set[slot] | set.beside(blocks, slot, a, 0) | set.beside(blocks, slot, a, 1)) & PlaceSet<D>::places(blocks, slot);
    set = std::move(wider);
  }
  return set;
}

/// Steps from a node to the 3^D around it, as ActiveBlocks::places_around has them.
template <int D>
constexpr auto kSteps = [] {
  std::array<Cell<D>, std::size_t(ActiveBlocks<D>::kNeighbours)> steps{};
  for (int n = 0; n < ActiveBlocks<D>::kNeighbours; ++n)
    for (int a = D - 1, rest = n; a >= 0; --a, rest /= 3) steps[std::size_t(n)][std::size_t(a)] = rest % 3 - 1;
  return steps;
}();

/// The nodes in contact: those that a particle of each field reaches where the two touch. `near_other`: the nodes whose particles may touch one.
template <int D, class Real>
PlaceSet<D> nodes_in_contact(const ActiveBlocks<D>& blocks, const ByNode<D, Real>& one, const ByNode<D, Real>& other, const PlaceSet<D>& near_other, Real reach) {
  constexpr std::size_t nodes = ByNode<D, Real>::kNodes;
  PlaceSet<D> found(blocks);
  base::parallel_chunks(one.slots().size(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n_slot = begin; n_slot < end; ++n_slot) {
      const std::size_t slot = one.slots()[n_slot];
      for_places(one.occupied[slot] & near_other[slot], [&](std::size_t k) {
        const std::size_t node = slot * nodes + k;
        const auto around = blocks.places_around(node);
        for (std::size_t n = 0; n < around.size(); ++n) {
          if (around[n] < 0 || !other.occupied.has(std::size_t(around[n]))) continue;
          const Cell<D>& apart = kSteps<D>[n];
          const bool touch = one.any(node, [&](const Vec<D, Real>& p) {
            return other.any(std::size_t(around[n]), [&](Vec<D, Real> q) {
              for (int a = 0; a < D; ++a) q[a] += Real(apart[a]) - p[a];
              return q.squaredNorm() < reach * reach;
            });
          });
          if (!touch) continue;
          for (std::size_t m = 0; m < around.size(); ++m) {
            bool both = around[m] >= 0;
            for (int a = 0; a < D; ++a) both = both && std::abs(kSteps<D>[m][a] - apart[a]) <= 1;
            if (both) found.insert_beside_others(std::size_t(around[m]));
          }
        }
      });
    }
  });
  return found;
}

/// Where two fields meet, the normals at the nodes of a block. Each surface's is the slope of its mass, weighted by what is there of the other one, and of
/// the two the flatter surface's counts: the edge of a block that slides on a floor would else plough it.
template <int D, class Real>
class Normals {
 public:
  Normals(const ActiveBlocks<D>& blocks, const Cell<D>& block, const std::vector<Real>& mass, const std::vector<Real>& mass_of_other) {
    std::array<Real, kTile> one{}, other{};
    blocks.template for_tile<int(kEdge), int(kBefore)>(block, [&](int to, std::size_t from, auto count) {
      std::copy_n(&mass[from], int(count), &one[std::size_t(to)]), std::copy_n(&mass_of_other[from], int(count), &other[std::size_t(to)]);
    });
    for (std::size_t i = 0; i < kTile; ++i) {
      bool inner = one[i] > 0 && other[i] > 0;
      for (std::size_t a = 0, rest = i; a < D; ++a, rest /= kEdge) inner = inner && rest % kEdge > 0 && rest % kEdge + 1 < kEdge;
      if (inner) out_of_one_.set(i, -other[i] * slope(one, i)), into_other_.set(i, one[i] * slope(other, i));
    }
  }
  /// From the one to the other, at a node by its number in the block; 0 where nothing says so.
  Vec<D, Real> at(std::size_t node) const {
    constexpr int kSquarings = 7;
    const Vec<D, Real> own = out_of_one_.at(node) + into_other_.at(node);
    const Direction a = out_of_one_.around(node, own), b = into_other_.around(node, own);
    const Real flatter = std::max(a.flatness, b.flatness);
    if (!(flatter > 0)) return Vec<D, Real>::Zero();
    Real share_a = a.flatness / flatter, share_b = b.flatness / flatter;
    for (int k = 0; k < kSquarings; ++k) share_a *= share_a, share_b *= share_b;
    const Vec<D, Real> sum = share_a * a.unit + share_b * b.unit;
    const Real length = sum.norm();
    return length > Real(0.01) ? Vec<D, Real>(sum / length) : Vec<D, Real>(Vec<D, Real>::Zero());
  }

 private:
  static constexpr std::size_t kAround = 2, kBefore = kAround + 1, kEdge = Lattice<D>::kBlock + 2 * kBefore;   // [nodes]
  static constexpr std::size_t kTile = D == 2 ? kEdge * kEdge : kEdge * kEdge * kEdge, kLine = 2 * kAround + 1, kLines = D == 2 ? kLine : kLine * kLine;
  static constexpr std::size_t kMiddle = kAround * (D == 2 ? kEdge + 1 : kEdge * kEdge + kEdge + 1);   // from the first place around a node to itself

  struct Direction {
    Vec<D, Real> unit;
    Real flatness;   // [1] the length of what was summed in the sum of all lengths
  };
  /// What one surface says of the normal.
  class Directions {
   public:
    Directions() { of_.fill(Vec<D, Real>::Zero()); }
    void set(std::size_t at, const Vec<D, Real>& direction) { of_[at] = direction; }
    const Vec<D, Real>& at(std::size_t node) const { return of_[first_around(node) + kMiddle]; }
    /// The mean around a node. Where directions differ much, as on both sides of a thin sheet, of those alone that go as `own` does.
    Direction around(std::size_t node, const Vec<D, Real>& own) const {
      constexpr Real kMuch = Real(0.7);
      const Direction all = mean(node, [](const Vec<D, Real>&) { return true; });
      if (all.flatness > kMuch) return all;
      return mean(node, [&](const Vec<D, Real>& d) { return d.dot(own) > 0; });
    }

   private:
    static std::size_t first_around(std::size_t node) {
      std::size_t first = 0;
      for (int a = 0; a < D; ++a) first = first * kEdge + (node >> 2 * (D - 1 - a) & 3) + kBefore - kAround;
      return first;
    }
    template <class Counts>
    Direction mean(std::size_t node, const Counts& counts) const {
      Vec<D, Real> sum = Vec<D, Real>::Zero();
      Real all = 0;
      for (std::size_t line = 0; line < kLines; ++line) {
        const Vec<D, Real>* const first = &of_[first_around(node) + (line / kLine * kEdge + line % kLine) * kEdge];
        for (std::size_t k = 0; k < kLine; ++k)
          if (counts(first[k])) sum += first[k], all += first[k].norm();
      }
      const Real length = sum.norm();
      if (!(length > 0)) return {Vec<D, Real>::Zero(), 0};
      return {sum / length, std::min(Real(1), length / all)};
    }

    std::array<Vec<D, Real>, kTile> of_;
  };

  /// Of a mass: differences along an axis, averaged across it by (1, 2, 1).
  static Vec<D, Real> slope(const std::array<Real, kTile>& mass, std::size_t at) {
    Vec<D, Real> sum = Vec<D, Real>::Zero();
    for (const Cell<D>& step : kSteps<D>) {
      std::ptrdiff_t i = 0;
      int across = 1;
      for (int a = 0; a < D; ++a) i = i * std::ptrdiff_t(kEdge) + step[a], across *= 2 - std::abs(step[a]);
      const Real m = mass[std::size_t(std::ptrdiff_t(at) + i)];
      for (int a = 0; a < D; ++a) sum[a] += Real(step[a] * across) * m;
    }
    return sum;
  }

  Directions out_of_one_, into_other_;
};

/// Corrects the velocities of nodes in contact: each field gets the share of the change that the other one's mass has. Nodes without a normal stick.
template <int D, class Real>
void hand_over(const ActiveBlocks<D>& blocks, const PlaceSet<D>& nodes, const Rubbing& rubbing, NodeVelocity<D, Real>& one, NodeVelocity<D, Real>& other) {
  base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      if (nodes[slot] == 0) continue;
      const Normals<D, Real> normals(blocks, blocks.block(slot), one.mass, other.mass);
      for_places(nodes[slot], [&](std::size_t k) {
        const std::size_t i = slot * std::size_t(Lattice<D>::kCellsPerBlock) + k;
        const Real mass = one.mass[i], mass_of_other = other.mass[i];
        if (!(double(mass) > kLightestNode && double(mass_of_other) > kLightestNode)) return;
        const Vec<D, Real> normal = normals.at(k), before = other.velocity[i] - one.velocity[i];   // as the one sees the other
        const Vec<D, Real> change = after_contact<D, Real>(normal.isZero(0) ? Rubbing{Contact::sticky, 0} : rubbing, normal, before) - before;
        other.velocity[i] += mass / (mass + mass_of_other) * change;
        one.velocity[i] -= mass_of_other / (mass + mass_of_other) * change;
      });
    }
  });
}

}  // namespace

template <int D, class Real>
BodyContacts<D, Real>::BodyContacts(const Scene& scene) : spacing_(std::pow(double(scene.options.particles_per_cell), -1.0 / D)) {
  std::size_t sticking = scene.bodies.size();   // the field of all that stick
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const Rubbing rubbing = rubbing_of(scene.bodies[b]);
    const bool sticks = rubbing.contact == Contact::sticky, joins = sticks && sticking < fields_.size();
    if (!joins) fields_.push_back({.bodies = {}, .rubbing = rubbing});
    if (sticks && !joins) sticking = fields_.size() - 1;
    of_body_.push_back(joins ? sticking : fields_.size() - 1);
    fields_[of_body_.back()].bodies.push_back(b);
  }
}

template <int D, class Real>
void BodyContacts<D, Real>::apply(const ActiveBlocks<D>& blocks, const std::vector<Group<D, Real>>& groups, std::vector<NodeVelocity<D, Real>>& fields) const {
  constexpr int kSweeps = 6;   // over nodes where more than two meet
  const Real reach = Real(std::min(kTouch * spacing_, 1.0));   // of a particle nearest to one node not beyond the nodes around it
  std::vector<ByNode<D, Real>> by_node;
  for (const Field& f : fields_) by_node.emplace_back(blocks, groups, f.bodies);
  struct Pair {
    std::size_t one, other;
    PlaceSet<D> nodes;
  };
  std::vector<Pair> pairs;
  PlaceSet<D> all(blocks), shared(blocks);   // nodes of any pair, of more than one
  for (std::size_t g = 1; g < fields_.size(); ++g) {
    const PlaceSet<D> near = grown(blocks, by_node[g].occupied);
    for (std::size_t f = 0; f < g; ++f) {
      if (!by_node[f].meets(near)) continue;
      pairs.push_back({f, g, nodes_in_contact<D, Real>(blocks, by_node[f], by_node[g], near, reach)});
      for (std::size_t slot = 0; slot < blocks.count(); ++slot)
        shared[slot] |= all[slot] & pairs.back().nodes[slot], all[slot] |= pairs.back().nodes[slot];
    }
  }
  const auto meet = [&](const Pair& pair) {
    const Rubbing &one = fields_[pair.one].rubbing, &other = fields_[pair.other].rubbing;
    hand_over<D, Real>(blocks, pair.nodes, {std::max(one.contact, other.contact), std::min(one.friction, other.friction)}, fields[pair.one], fields[pair.other]);
  };
  for (const Pair& pair : pairs) meet(pair);
  for (Pair& pair : pairs)
    for (std::size_t slot = 0; slot < blocks.count(); ++slot) pair.nodes[slot] &= shared[slot];
  std::erase_if(pairs, [&](const Pair& pair) { return !pair.nodes.any(); });
  for (int sweep = 1; sweep < kSweeps; ++sweep) {   // to and fro, so that the order in the shot counts for little
    std::reverse(pairs.begin(), pairs.end());
    for (const Pair& pair : pairs) meet(pair);
  }
}

template class BodyContacts<2, float>;
template class BodyContacts<2, double>;
template class BodyContacts<3, float>;
template class BodyContacts<3, double>;

}  // namespace sim
