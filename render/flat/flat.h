#pragma once
// The picture of a two-dimensional shot: film and preview alike.
#include <string>

#include "render/render.h"

namespace render::flat {

/// The whole domain, undistorted, in the middle of the picture. A particle is a disc of its area; gaps between particles that stand as
/// close as in a full liquid are closed, so that the liquid fills its area and a drop keeps its size. Colliders are filled. Axes in
/// metres, colour bar and caption stand in the margins of pictures that have room for them. Nothing is drawn outside the domain.
Image draw(const Setting&, const sim::Frame&, const std::string& caption, double top_speed);
/// Whether a picture of this size has room for one.
bool has_caption(const Options&);

}  // namespace render::flat
