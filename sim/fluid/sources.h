#pragma once
// Sources: where liquid pours in. A source is made of whole cells, those whose middles lie in its shape, and while it acts they are full of liquid that
// moves as one. What is in it is a cut-out of an endless medium: places seeded as a body's are, cell by cell, that have moved with its velocity since
// it began. Particles are born where that medium comes in through an upstream side of a cell, at the moment it does, whatever the length of steps:
// who is born, where and in which order does not depend on them. To the liquid around it a source is a wall at its upstream sides, and pushes out
// of the others what it brings.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/colliders/solids.h"

namespace sim {

template <int D>
class Sources {
 public:
  /// Cells that a collider covers at t = 0 are none of a source's, and of sources that act at one time a cell is the first one's. A middle on a
  /// shape's edge is in it at the lower end of an axis, not at the upper one. A source begins, and ends, up to `slack` [s] early.
  Sources(const Scene&, const Solids<D>&, double slack = 0);

  int count() const { return int(sources_.size()); }
  /// Those that act in a step which begins at `time` [s] act from here on, but for cells that pour into a collider now: those are free liquid, and
  /// nothing is born there.
  void begin_step(double time, const Solids<D>&);
  bool acts(int source) const { return acting_[std::size_t(source)] != 0; }
  /// Another number whenever other cells act.
  std::int64_t generation() const { return generation_; }
  bool has_begun(int source, double time) const { return one(source).start <= time + slack_; }
  /// [s] The next time after this one at which a source begins or ends; endless where none does.
  double next_change(double time) const;
  bool acts() const { return !owned_.empty(); }
  /// Of the fastest that acts [m/s].
  double speed() const;

  static constexpr int kNone = -1;
  /// The source that acts in a cell, or kNone.
  int at(const Cell<D>& cell) const {
    if (owned_.empty() || !lies_between(lower_, upper_, cell)) return kNone;
    const auto found = std::lower_bound(owned_.begin(), owned_.end(), cell, [](const Owned& one, const Cell<D>& other) { return one.cell < other; });
    return found != owned_.end() && found->cell == cell ? found->source : kNone;
  }
  /// Whether the cells of a source that acts, or those above them, may be in a block.
  bool touches(const Cell<D>& block) const;
  /// The velocity [m/s] along an axis that sources give the face between two cells; nothing where neither is one's.
  std::optional<double> held(const Cell<D>& below, const Cell<D>& above, int axis) const;

  /// Moves what has come into a source out of the nearest of its sides that has no solid behind it; nothing where there is none.
  template <class Real>
  void push_out(const Solids<D>&, Site<D, Real>&) const;

  /// Cells of a source, and what is behind them, that pour into a wall, a collider or another source that moves otherwise.
  std::vector<Cell<D>> shut(int source, const Solids<D>&) const;

  /// Of a source, whether it acts or not.
  base::Vec3 velocity(int source) const { return one(source).velocity; }
  double start(int source) const { return one(source).start; }                        // [s]
  double end(int source) const { return one(source).end; }                            // [s]
  const std::vector<Cell<D>>& cells(int source) const { return one(source).cells; }   // ascending
  bool holds(int source, const Cell<D>& at) const { return one(source).holds(at); }
  double rate(int source) const;                                                      // [particles/s]

  /// Sides of a source's cells through which its medium comes in: lower ones where it moves up along the axis.
  struct Side {
    Cell<D> cell;
    int axis;
  };
  const std::vector<Side>& upstream(int source) const { return one(source).upstream; }

  /// A particle that is born.
  struct Born {
    double time;            // [s] of its birth
    int source;
    Vec<D, double> seed;    // [cells] its place when the source began: two of a source differ in it
    Vec<D, double> place;   // [cells] where it is at the time asked for
    bool operator<(const Born&) const;   // by birth
  };
  /// What a source holds when it begins, and where that is at a later time [s], ascending.
  std::vector<Born> fill(int source, double now) const;
  /// What comes in between two times [s] through the cells that are not shut, and where it is at the later one, ascending.
  std::vector<Born> pour(int source, double from, double to) const;

 private:
  struct Source {
    base::Vec3 velocity;          // [m/s]
    Vec<D, double> way;           // [cells/s]
    double start, end;            // [s]
    std::vector<Cell<D>> cells;
    Cell<D> lower, upper;         // that all of them lie between
    std::vector<Side> upstream;
    std::vector<Cell<D>> shut;    // as of the last step
    bool overlaps(const Source& other) const { return start < other.end && other.start < end; }   // in time
    bool holds(const Cell<D>& at) const { return lies_between(lower, upper, at) && std::binary_search(cells.begin(), cells.end(), at); }
  };
  static bool lies_between(const Cell<D>& lower, const Cell<D>& upper, const Cell<D>& at) {
    for (std::size_t a = 0; a < std::size_t(D); ++a)
      if (at[a] < lower[a] || at[a] > upper[a]) return false;
    return true;
  }
  const Source& one(int source) const { return sources_[std::size_t(source)]; }
  /// Calls visit(seed) for all places of the medium between two corners [cells], as it was when the source began.
  template <class Visit>
  void for_seeds(int source, const Vec<D, double>& lower, const Vec<D, double>& upper, const Visit& visit) const;

  Options options_;
  Lattice<D> lattice_;
  double slack_;                  // [s]
  int edge_;                      // places along a cell's edge
  std::vector<Source> sources_;
  std::vector<std::uint8_t> acting_;
  struct Owned {
    Cell<D> cell;
    int source;
    bool operator==(const Owned&) const = default;
  };
  std::vector<Owned> owned_;      // cells that act, ascending
  std::int64_t generation_ = 0;
  Cell<D> lower_{}, upper_{};     // that all of them lie between
};

}  // namespace sim
