#pragma once
// Viridis [van der Walt, Smith 2015; CC0]: equal steps of a value look like equal steps of colour, and survive grey printing.
#include "base/vec.h"

namespace render::raster {

/// Display-referred sRGB for s, cut to [0, 1].
base::Vec3f viridis(float s);

}  // namespace render::raster
