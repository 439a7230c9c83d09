#include <algorithm>

#include "surface/field/level_set.h"

namespace surface::field {
Field smooth(const Blocks& blocks, const Field& field, int passes, float search, const Field& limit) {
  const float back = 1 + std::min(1.0f, 0.15f * search * search / (0.5f * float(passes)));   // P - P^2 is curvature times passes / 4
  Field once = field;
  for (int i = 0; i < passes; ++i) once = binomial(blocks, once, kDistance);
  Field twice = once;
  for (int i = 0; i < passes; ++i) twice = binomial(blocks, twice, kDistance);
  base::parallel_chunks(field.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) once[v] = std::clamp(once[v] + back * (once[v] - twice[v]), field[v] - limit[v], field[v] + limit[v]);
  });
  return once;
}

}  // namespace surface::field
