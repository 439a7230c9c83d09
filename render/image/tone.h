#pragma once
// Scene-linear light to display values in [0, 1], coded as sRGB.
#include "base/vec.h"

namespace render::image {

/// Linear to sRGB's code values [IEC 61966-2-1]; outside [0, 1] it is cut.
float srgb_code(float linear);
/// The way back, from code values in [0, 1].
float srgb_light(float code);

/// A film-like response: mid grey 0.18 keeps its place, contrast is raised a little, highlights roll off and lose their colour.
/// In: scene-linear Rec.709, 0 and up. Out: display-linear in [0, 1].
base::Vec3f filmic(const base::Vec3f& scene);

}  // namespace render::image
