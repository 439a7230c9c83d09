#pragma once
// Joint non-local means: a pixel becomes the mean of those around it whose neighbourhoods have the same colours within their noise, and
// whose guides are the same within theirs [Rousselle13].
#include <array>
#include <cstdint>
#include <vector>

namespace render::image {

inline constexpr std::size_t kColors = 3;
/// First normal; albedo and normal of what scatters first, seen through mirrors and dielectrics.
inline constexpr std::size_t kGuides = 9;

/// Means over a pixel's samples and the variances of these means. One plane a channel, rows top-down.
struct Estimates {
  using Plane = std::vector<float>;
  std::int64_t width = 0, height = 0;
  std::array<Plane, kColors> color, color_variance;
  std::array<Plane, kGuides> guide, guide_variance;
};

/// Colours without most of their noise, three a pixel side by side. A pixel that its own variance says nothing of, five times as bright as all but two
/// around it, is taken for the median of these first: its light is lost. Weights add up to one, so a constant picture stays as it is. Runs in
/// the caller's arena; the same bits for any number of threads.
std::vector<float> denoise(const Estimates&);

}  // namespace render::image
