#include "render/view/keys.h"

#include <algorithm>
#include <cstddef>

#include "base/vec.h"

namespace render::view {
namespace {

/// Slope at the middle one of three keys: 0 at a peak, else the harmonic mean of the slopes beside it, weighted by their lengths.
double slope(double before, double after, double left, double right) {
  if (left * right <= 0) return 0;
  const double a = 2 * after + before, b = after + 2 * before;
  return (a + b) / (a / left + b / right);
}

/// Cubic Hermite over an interval of length h at s in [0, 1].
double hermite(double p, double q, double m, double n, double h, double s) {
  const double r = 1 - s;
  return r * r * ((1 + 2 * s) * p + s * h * m) + s * s * ((1 + 2 * r) * q - r * h * n);
}

}  // namespace

template <>
double curve(const std::vector<Key<double>>& keys, double at) {
  if (at <= keys.front().at) return keys.front().value;
  if (at >= keys.back().at) return keys.back().value;
  const auto next = static_cast<std::size_t>(std::upper_bound(keys.begin(), keys.end(), at, [](double x, const Key<double>& k) { return x < k.at; }) -
                                             keys.begin());
  const auto rise = [&](std::size_t i) { return (keys[i + 1].value - keys[i].value) / (keys[i + 1].at - keys[i].at); };
  const auto slope_at = [&](std::size_t i) {
    if (i == 0 || i + 1 == keys.size()) return 0.0;
    return slope(keys[i].at - keys[i - 1].at, keys[i + 1].at - keys[i].at, rise(i - 1), rise(i));
  };
  const std::size_t i = next - 1;
  const double h = keys[next].at - keys[i].at;
  return hermite(keys[i].value, keys[next].value, slope_at(i), slope_at(next), h, (at - keys[i].at) / h);
}

template <>
base::Vec3 curve(const std::vector<Key<base::Vec3>>& keys, double at) {
  base::Vec3 value;
  std::vector<Key<double>> component(keys.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < keys.size(); ++i) component[i] = {keys[i].at, keys[i].value[axis]};
    value[axis] = curve(component, at);
  }
  return value;
}

}  // namespace render::view
