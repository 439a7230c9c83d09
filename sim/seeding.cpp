#include "sim/seeding.h"

namespace sim {

template <int D>
std::optional<CellRange<D>> cells_around(const Shape& shape, const Options& o, const Lattice<D>& lattice) {
  const base::Box bounds = shape.bounds();
  CellRange<D> range;
  for (int a = 0; a < D; ++a) {
    if (bounds.upper[a] <= o.domain.lower[a] || bounds.lower[a] >= o.domain.upper[a]) return {};
    // A cell more on either side: bounds are rounded.
    const double last = double(lattice.cells[a]) - 1;
    range.lower[a] = int(std::clamp(std::floor((bounds.lower[a] - o.domain.lower[a]) / o.cell) - 1, 0.0, last));
    range.upper[a] = int(std::clamp(std::floor((bounds.upper[a] - o.domain.lower[a]) / o.cell) + 1, 0.0, last));
  }
  return range;
}

template <int D>
std::vector<std::int64_t> cells_around(const std::vector<Shape>& shapes, const Options& o, const Lattice<D>& lattice) {
  std::vector<std::int64_t> numbers;
  for (const Shape& shape : shapes) {
    const std::optional<CellRange<D>> range = cells_around<D>(shape, o, lattice);
    if (!range) continue;
    const auto& [lower, upper] = *range;
    for (Cell<D> at = lower; at[0] <= upper[0];) {
      numbers.push_back(number_of<D>(at, lattice));
      int a = D - 1;
      while (a > 0 && at[a] == upper[a]) at[a] = lower[a], --a;
      ++at[a];
    }
  }
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());   // shapes and images may overlap
  return numbers;
}

template std::optional<CellRange<2>> cells_around(const Shape&, const Options&, const Lattice<2>&);
template std::optional<CellRange<3>> cells_around(const Shape&, const Options&, const Lattice<3>&);
template std::vector<std::int64_t> cells_around(const std::vector<Shape>&, const Options&, const Lattice<2>&);
template std::vector<std::int64_t> cells_around(const std::vector<Shape>&, const Options&, const Lattice<3>&);

}  // namespace sim
