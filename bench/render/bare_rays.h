#pragma once
// What Embree alone does with the rays of a path tracer.
#include "surface/surface.h"

namespace bench {

/// rtcIntersect1 a second, over rays that diffuse walls would send on: from the middle of a closed mesh, eight bounces a path.
/// Only the queries are timed.
double bare_rays_per_second(const surface::Mesh&, const base::Vec3f& middle, int threads);

}  // namespace bench
