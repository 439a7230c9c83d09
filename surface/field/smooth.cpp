#include <algorithm>

#include "surface/field/level_set.h"

namespace surface::field {
Field smooth(const Blocks& blocks, const Field& field, int passes, const Field& limit) {
  Field once = field;
  for (int i = 0; i < passes; ++i) once = binomial(blocks, once, kDistance);
  Field twice = once;
  for (int i = 0; i < passes; ++i) twice = binomial(blocks, twice, kDistance);
  base::parallel_chunks(field.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) once[v] = std::clamp(2 * once[v] - twice[v], field[v] - limit[v], field[v] + limit[v]);
  });
  return once;
}

}  // namespace surface::field
