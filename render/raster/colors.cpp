#include "render/raster/colors.h"

#include <algorithm>
#include <cmath>

#include "render/image/tone.h"

namespace render::raster {
namespace {

constexpr int kAnchors = 17;  // equally spaced
constexpr float kViridis[kAnchors][3] = {
    {0.267004f, 0.004874f, 0.329415f}, {0.282327f, 0.094955f, 0.417331f}, {0.278826f, 0.175490f, 0.483397f}, {0.258965f, 0.251537f, 0.524736f},
    {0.229739f, 0.322361f, 0.545706f}, {0.199430f, 0.387607f, 0.554642f}, {0.172719f, 0.448791f, 0.557885f}, {0.149039f, 0.508051f, 0.557250f},
    {0.127568f, 0.566949f, 0.550556f}, {0.120638f, 0.625828f, 0.533488f}, {0.157851f, 0.683765f, 0.501686f}, {0.246070f, 0.738910f, 0.452024f},
    {0.369214f, 0.788888f, 0.382914f}, {0.515992f, 0.831158f, 0.294279f}, {0.678489f, 0.863742f, 0.189503f}, {0.845561f, 0.887322f, 0.099702f},
    {0.993248f, 0.906157f, 0.143936f}};

/// Oklab to linear Rec.709 [Ottosson20].
base::Vec3f linear_of(const base::Vec3f& lab) {
  const auto cube = [](float v) { return v * v * v; };
  const float l = cube(lab[0] + 0.3963377774f * lab[1] + 0.2158037573f * lab[2]), m = cube(lab[0] - 0.1055613458f * lab[1] - 0.0638541728f * lab[2]),
              s = cube(lab[0] - 0.0894841775f * lab[1] - 1.2914855480f * lab[2]);
  return {4.0767416621f * l - 3.3077115913f * m + 0.2309699292f * s, -1.2684380046f * l + 2.6097574011f * m - 0.3413193965f * s,
          -0.0041960863f * l - 0.7034186147f * m + 1.7076147010f * s};
}

}  // namespace

base::Vec3f blue_to_red(float s) {
  const base::Vec3f blue(0.45f, -0.035f, -0.17f), white(0.96f, 0, 0.01f), red(0.45f, 0.155f, 0.08f);
  const float away = std::min(std::abs(s), 1.0f);
  const base::Vec3f linear = linear_of(white + away * ((s < 0 ? blue : red) - white));
  return {image::srgb_code(linear[0]), image::srgb_code(linear[1]), image::srgb_code(linear[2])};
}

base::Vec3f distinct(std::size_t kind) {
  static constexpr float kColors[][3] = {{0.34f, 0.71f, 0.91f}, {0.90f, 0.62f, 0}, {0, 0.62f, 0.45f}, {0.80f, 0.47f, 0.65f},
                                         {0.94f, 0.89f, 0.26f}, {0.84f, 0.37f, 0}, {0, 0.45f, 0.70f}};
  const auto& color = kColors[kind % std::size(kColors)];
  return {color[0], color[1], color[2]};
}

base::Vec3f viridis(float s) {
  const float at = std::clamp(s, 0.0f, 1.0f) * (kAnchors - 1);
  const int cell = std::min(static_cast<int>(at), kAnchors - 2);
  base::Vec3f color;
  for (int c = 0; c < 3; ++c) color[c] = kViridis[cell][c] + (at - static_cast<float>(cell)) * (kViridis[cell + 1][c] - kViridis[cell][c]);
  return color;
}

}  // namespace render::raster
