#pragma once
// Equal steps of a value look like equal steps of colour.
#include "base/vec.h"

namespace render::raster {

/// Viridis [van der Walt, Smith 2015; CC0], which survives grey printing: display-referred sRGB for s, cut to [0, 1].
base::Vec3f viridis(float s);
/// Straight lines of a uniform space of colours [Ottosson20] from blue at -1 through near white at 0 to red at 1, equally light at both ends.
base::Vec3f blue_to_red(float s);

/// Of kinds, to be told apart by those who see colours differently too [Okabe08]; they come again after the seventh.
base::Vec3f distinct(std::size_t kind);

}  // namespace render::raster
