#include "render/raster/colors.h"

#include <algorithm>

namespace render::raster {
namespace {

constexpr int kAnchors = 17;  // equally spaced
constexpr float kViridis[kAnchors][3] = {
    {0.267004f, 0.004874f, 0.329415f}, {0.282327f, 0.094955f, 0.417331f}, {0.278826f, 0.175490f, 0.483397f}, {0.258965f, 0.251537f, 0.524736f},
    {0.229739f, 0.322361f, 0.545706f}, {0.199430f, 0.387607f, 0.554642f}, {0.172719f, 0.448791f, 0.557885f}, {0.149039f, 0.508051f, 0.557250f},
    {0.127568f, 0.566949f, 0.550556f}, {0.120638f, 0.625828f, 0.533488f}, {0.157851f, 0.683765f, 0.501686f}, {0.246070f, 0.738910f, 0.452024f},
    {0.369214f, 0.788888f, 0.382914f}, {0.515992f, 0.831158f, 0.294279f}, {0.678489f, 0.863742f, 0.189503f}, {0.845561f, 0.887322f, 0.099702f},
    {0.993248f, 0.906157f, 0.143936f}};

}  // namespace

base::Vec3f viridis(float s) {
  const float at = std::clamp(s, 0.0f, 1.0f) * (kAnchors - 1);
  const int cell = std::min(static_cast<int>(at), kAnchors - 2);
  base::Vec3f color;
  for (int c = 0; c < 3; ++c) color[c] = kViridis[cell][c] + (at - static_cast<float>(cell)) * (kViridis[cell + 1][c] - kViridis[cell][c]);
  return color;
}

}  // namespace render::raster
