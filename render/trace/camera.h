#pragma once
// The camera of one frame: a thin lens whose shutter is open for a while, during which it may move.
#include "render/render.h"
#include "render/sampling/sampler.h"
#include "render/trace/geometry.h"
#include "render/view/view.h"

namespace render::trace {

struct FirstHit;

class Camera {
 public:
  Camera(const Setting&, std::int64_t frame);

  /// Through (x, y) [pixels] from the upper left corner of the picture; `lens` and `time` are uniform in [0, 1).
  Ray ray(float x, float y, sampling::Point lens, float time) const;
  /// [m] along the view axis, of what is met at `t` [m] along the ray.
  float depth(const Ray&, float t) const;
  /// How what was hit (or the sky) moves over the picture: pixels a frame, to the right and up.
  Eigen::Vector2f motion(const Ray&, const FirstHit&) const;
  Exposure exposure() const { return {.half = half_exposure_, .walls = walls_}; }

 private:
  /// A view in the renderer's precision; right and up reach to the edges of the picture, one metre in front of it.
  struct Frustum {
    Vec3f position, forward, right, up;
  };
  static Frustum frustum(const view::View&);
  Frustum at(float time) const;

  float width_, height_;                // [pixels]
  Frustum open_, close_;                // when the shutter opens and closes; in between they are mixed
  bool moves_;                          // while the shutter is open
  bool travels_;                        // from frame to frame
  view::View before_, after_;           // a moment before and after the frame's
  float lens_, focus_;                  // [m] radius; distance of the plane that is sharp
  double fps_;                          // [1/s]
  float half_exposure_;                 // [s]
  base::Box walls_;
};

}  // namespace render::trace
