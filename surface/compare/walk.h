#pragma once
// Two trees of the same kind walked side by side, down to voxels only where one of them has voxels: the cost follows what is stored,
// however large the tiles are.
#include <openvdb/openvdb.h>

#include <cstdint>

namespace surface::compare {

/// One node of a tree, or the tile that stands in its place.
template <class Node>
struct Place {
  using Value = typename Node::ValueType;
  const Node* node = nullptr;
  Value value{};         // of the tile
  bool active = false;   // the tile
};

template <class Node>
Place<typename Node::ChildNodeType> child_of(const Place<Node>& place, openvdb::Index n) {
  if (!place.node) return {nullptr, place.value, place.active};
  const auto& entry = place.node->getTable()[n];
  if (place.node->isChildMaskOn(n)) return {entry.getChild(), {}, false};
  return {nullptr, entry.getValue(), place.node->isValueMaskOn(n)};
}

/// Calls visit(value, active, value, active, voxels) for pieces that cover the node.
template <class Node, class Visit>
void walk(const Place<Node>& a, const Place<Node>& b, const Visit& visit) {
  if constexpr (Node::LEVEL == 0) {
    for (openvdb::Index n = 0; n < Node::NUM_VALUES; ++n)
      visit(a.node ? a.node->getValue(n) : a.value, a.node ? a.node->isValueOn(n) : a.active, b.node ? b.node->getValue(n) : b.value,
            b.node ? b.node->isValueOn(n) : b.active, std::uint64_t(1));
  } else {
    for (openvdb::Index n = 0; n < Node::NUM_VALUES; ++n) {
      const auto in_a = child_of(a, n), in_b = child_of(b, n);
      if (in_a.node || in_b.node) walk(in_a, in_b, visit);
      else visit(in_a.value, in_a.active, in_b.value, in_b.active, std::uint64_t(Node::ChildNodeType::NUM_VOXELS));
    }
  }
}

/// The part of a tree below one entry of its root; background where there is none.
template <class Tree>
Place<typename Tree::RootNodeType::ChildNodeType> below_root(const Tree& tree, const openvdb::Coord& origin) {
  using Child = typename Tree::RootNodeType::ChildNodeType;
  if (const auto* child = tree.root().template probeConstNode<Child>(origin)) return {child, {}, false};
  return {nullptr, tree.getValue(origin), tree.isValueOn(origin)};
}

}  // namespace surface::compare
