#pragma once
// Bodies that come apart, slip or rub where they meet. Each has velocities of its own on the grid [Bardenhagen00]: that it shares nodes with another is
// nothing to it until they touch, and then they hand each other momentum there. Bodies that stick to each other have their velocities in common.
#include <cstddef>
#include <vector>

#include "sim/scene.h"
#include "sim/solid/contact.h"
#include "sim/solid/group.h"
#include "sim/transfer/blocks.h"
#include "sim/transfer/node_transfer.h"

namespace sim {

template <int D, class Real>
class BodyContacts {
 public:
  explicit BodyContacts(const Scene&);

  /// Fields of velocities on the grid. One: all bodies stick to each other.
  std::size_t fields() const { return fields_.size(); }
  /// The bodies of a field, by number.
  const std::vector<std::size_t>& bodies(std::size_t field) const { return fields_[field].bodies; }
  std::size_t field_of(std::size_t body) const { return of_body_[body]; }

  /// Corrects the velocities of nodes where bodies of two fields touch, pair after pair: what one loses the other gains. They touch where a particle of the
  /// one is nearer to a particle of the other than 1.2 times the spacing of particles (a cell at the most); in contact are the nodes that both
  /// of these reach. What they do there is the looser of their contacts, with the smaller friction.
  void apply(const ActiveBlocks<D>&, const std::vector<Group<D, Real>>&, std::vector<NodeVelocity<D, Real>>& fields) const;

 private:
  struct Field {
    std::vector<std::size_t> bodies;
    Rubbing rubbing;
  };
  std::vector<Field> fields_;
  std::vector<std::size_t> of_body_;
  double spacing_ = 1;    // [cells] of particles as seeded
};

}  // namespace sim
