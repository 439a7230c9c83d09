#pragma once
// Curves through the keys of a camera.
#include <vector>

namespace render::view {

/// A value at a moment.
template <class Value>
struct Key {
  double at;
  Value value;
};

/// The cubic through `keys` (ascending, at least one), component by component. It is smooth, never leaves the range of the two keys
/// beside it (so what rests between two keys rests), and stands still at the first and the last key and beyond [FritschButland84].
template <class Value>
Value curve(const std::vector<Key<Value>>& keys, double at);

}  // namespace render::view
