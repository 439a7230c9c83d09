#include "render/image/denoise.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace render::image {
namespace {

constexpr std::int64_t kReach = 9;     // [pixels] how far like pixels are looked for
constexpr std::int64_t kPatch = 2;     // [pixels] of a neighbourhood, to each side
constexpr std::int64_t kBand = 32;     // [rows] of a task
constexpr float kColorTolerance = 0.5f, kGuideTolerance = 0.6f;  // [1] in standard deviations [Rousselle13]
constexpr float kNormalFloor = 0.02f, kAlbedoFloor = 2e-3f;  // squared differences of guides that are never told apart: 8 degrees, 0.05
constexpr std::size_t kAlbedoOf = 1;   // the triple of guides that is no normal
constexpr float kNoise = 1e-8f;        // squared difference of colours that is never told apart

/// exp(-x) for x >= 0, to 0.04, and 0 beyond 8: all of it multiplications, so that rows go through eight at a time.
float falloff(float x) {
  float y = std::max(0.0f, 1 - 0.125f * x);
  y *= y;
  y *= y;
  return y * y;
}

/// 1 / (tolerance^2 what a guide may differ by at each pixel): its variance, or its slope where it is smooth.
std::array<Estimates::Plane, kGuides> guide_scales(const Estimates& e) {
  std::array<Estimates::Plane, kGuides> scales;
  tbb::parallel_for(std::size_t{0}, kGuides, [&](std::size_t g) {
    const Estimates::Plane& f = e.guide[g];
    const float floor = g / 3 == kAlbedoOf ? kAlbedoFloor : kNormalFloor;
    scales[g].resize(f.size());
    for (std::int64_t y = 0; y < e.height; ++y)
      for (std::int64_t x = 0; x < e.width; ++x) {
        const auto at = [&](std::int64_t i, std::int64_t j) {
          return f[static_cast<std::size_t>(std::clamp<std::int64_t>(j, 0, e.height - 1) * e.width + std::clamp<std::int64_t>(i, 0, e.width - 1))];
        };
        const auto i = static_cast<std::size_t>(y * e.width + x);
        const auto slope2 = [&](float before, float here, float after) {  // the lesser one-sided step: an edge is no slope
          const float a = here - before, b = after - here;
          return std::min(a * a, b * b);
        };
        const float slope = slope2(at(x - 1, y), f[i], at(x + 1, y)) + slope2(at(x, y - 1), f[i], at(x, y + 1));
        scales[g][i] = 1 / (kGuideTolerance * kGuideTolerance * std::max({floor, e.guide_variance[g][i], slope}));
      }
  });
  return scales;
}

/// Rows [top, bottom) of the result.
class Band {
 public:
  Band(const Estimates& e, const std::array<Estimates::Plane, kGuides>& scales, std::int64_t top, std::int64_t bottom)
      : e_(e), scales_(scales), top_(top), bottom_(bottom), width_(e.width), distance_(size(bottom - top + 2 * kPatch)), columns_(distance_.size()),
        row_(size(1)), patch_(size(1)), sum_(3 * size(bottom - top)), total_(size(bottom - top)) {}

  void run(std::vector<float>& result) {
    for (std::int64_t dy = -kReach; dy <= kReach; ++dy)
      for (std::int64_t dx = -kReach; dx <= kReach; ++dx) add(dx, dy);
    for (std::int64_t y = top_; y < bottom_; ++y)
      for (std::int64_t x = 0; x < width_; ++x)
        for (std::size_t c = 0; c < kColors; ++c)
          result[static_cast<std::size_t>(y * width_ + x) * kColors + c] = sum_[c * size(bottom_ - top_) + at(x, y - top_)] / total_[at(x, y - top_)];
  }

 private:
  std::size_t size(std::int64_t rows) const { return static_cast<std::size_t>(rows * width_); }
  std::size_t at(std::int64_t x, std::int64_t y) const { return static_cast<std::size_t>(y * width_ + x); }

  /// Adds the pixels at one offset, each to its own.
  void add(std::int64_t dx, std::int64_t dy) {
    const std::int64_t left = std::max<std::int64_t>(0, -dx), right = std::min(width_, width_ - dx);  // columns that have a partner
    if (left >= right) return;
    const std::int64_t first = std::max({top_ - kPatch, std::int64_t{0}, -dy}), last = std::min({bottom_ + kPatch, e_.height, e_.height - dy});
    for (std::int64_t y = first; y < last; ++y) compare_row(y, dx, dy, left, right);
    for (std::int64_t y = std::max(top_, first); y < std::min(bottom_, last); ++y) weigh_row(y, dx, dy, left, right, first, last);
  }

  /// Squared differences of colours in variances, less what noise alone makes; then their means along the row.
  void compare_row(std::int64_t y, std::int64_t dx, std::int64_t dy, std::int64_t left, std::int64_t right) {
    float* out = &distance_[size(y - (top_ - kPatch))];
    std::fill(out, out + width_, 0.0f);
    for (std::size_t c = 0; c < kColors; ++c) {
      const float* p = &e_.color[c][size(y)];
      const float* q = &e_.color[c][size(y + dy)] + dx;
      const float* vp = &e_.color_variance[c][size(y)];
      const float* vq = &e_.color_variance[c][size(y + dy)] + dx;
      for (std::int64_t x = left; x < right; ++x) {
        const float difference = p[x] - q[x];
        out[x] += (difference * difference - (vp[x] + std::min(vp[x], vq[x]))) / (kNoise + kColorTolerance * kColorTolerance * (vp[x] + vq[x]));
      }
    }
    float* along = &columns_[size(y - (top_ - kPatch))];
    const auto edge = [&](std::int64_t x) {
      const std::int64_t from = std::max(left, x - kPatch), to = std::min(right, x + kPatch + 1);
      float sum = 0;
      for (std::int64_t k = from; k < to; ++k) sum += out[k];
      along[x] = sum / static_cast<float>(kColors * static_cast<std::size_t>(to - from));
    };
    const std::int64_t inner = std::min(left + kPatch, right), outer = std::max(inner, right - kPatch);
    for (std::int64_t x = left; x < inner; ++x) edge(x);
    for (std::int64_t x = inner; x < outer; ++x) {
      float sum = 0;
      for (std::int64_t k = -kPatch; k <= kPatch; ++k) sum += out[x + k];
      along[x] = sum * (1.0f / (kColors * (2 * kPatch + 1)));
    }
    for (std::int64_t x = outer; x < right; ++x) edge(x);
  }

  void weigh_row(std::int64_t y, std::int64_t dx, std::int64_t dy, std::int64_t left, std::int64_t right, std::int64_t first, std::int64_t last) {
    float* guides = row_.data();
    std::fill(guides, guides + width_, 0.0f);
    for (std::size_t g = 0; g < kGuides; ++g) {
      const float* p = &e_.guide[g][size(y)];
      const float* q = &e_.guide[g][size(y + dy)] + dx;
      const float* vp = &e_.guide_variance[g][size(y)];
      const float* vq = &e_.guide_variance[g][size(y + dy)] + dx;
      const float* scale = &scales_[g][size(y)];
      for (std::int64_t x = left; x < right; ++x) {
        const float difference = p[x] - q[x];
        guides[x] = std::max(guides[x], (difference * difference - (vp[x] + std::min(vp[x], vq[x]))) * scale[x]);
      }
    }
    const std::int64_t from = std::max(first, y - kPatch), to = std::min(last, y + kPatch + 1);
    const float share = 1 / static_cast<float>(to - from);
    const std::size_t rows = size(bottom_ - top_), here = size(y - top_);
    float* total = &total_[here];
    float* colors = patch_.data();
    std::fill(colors, colors + width_, 0.0f);
    for (std::int64_t k = from; k < to; ++k) {
      const float* along = &columns_[size(k - (top_ - kPatch))];
      for (std::int64_t x = left; x < right; ++x) colors[x] += along[x];
    }
    for (std::int64_t x = left; x < right; ++x) {
      guides[x] = falloff(std::max(colors[x] * share, guides[x]));  // guides are 0 or more
      total[x] += guides[x];
    }
    for (std::size_t c = 0; c < kColors; ++c) {
      const float* q = &e_.color[c][size(y + dy)] + dx;
      float* sum = &sum_[c * rows + here];
      for (std::int64_t x = left; x < right; ++x) sum[x] += guides[x] * q[x];
    }
  }

  const Estimates& e_;
  const std::array<Estimates::Plane, kGuides>& scales_;
  std::int64_t top_, bottom_, width_;
  std::vector<float> distance_, columns_;  // [variances] of rows from top - kPatch: of pixels, and means of 2 kPatch + 1 along the row
  std::vector<float> row_, patch_, sum_, total_;
};

/// A pixel that one path has made bright differs from all others by no more than its own deviation, counts as like them, and is in all their means: a
/// square of the window's size. Where it is no surer of itself than that, and hardly any neighbour is nearly as bright, it is as their median.
Estimates without_spikes(const Estimates& e) {
  constexpr std::int64_t kAround = 2;                        // [pixels]
  constexpr float kUnsure = 0.35f, kBrighter = 5;            // deviation over the value; times the third brightest of its neighbours
  constexpr std::size_t kAsBright = 3;
  Estimates out = e;
  tbb::parallel_for(std::int64_t{0}, e.height, [&](std::int64_t y) {
    const auto sum_at = [&](std::size_t i) { return e.color[0][i] + e.color[1][i] + e.color[2][i]; };
    std::vector<std::pair<float, std::size_t>> others;
    for (std::int64_t x = 0; x < e.width; ++x) {
      const auto i = static_cast<std::size_t>(y * e.width + x);
      float deviation = 0;
      for (std::size_t c = 0; c < kColors; ++c) deviation += std::sqrt(e.color_variance[c][i]);
      if (!(deviation > kUnsure * sum_at(i))) continue;
      others.clear();
      for (std::int64_t v = std::max<std::int64_t>(0, y - kAround); v <= std::min(e.height - 1, y + kAround); ++v)
        for (std::int64_t u = std::max<std::int64_t>(0, x - kAround); u <= std::min(e.width - 1, x + kAround); ++u)
          if (const auto j = static_cast<std::size_t>(v * e.width + u); j != i) others.emplace_back(sum_at(j), j);
      if (others.size() < kAsBright) continue;
      std::sort(others.begin(), others.end());
      if (sum_at(i) <= kBrighter * others[others.size() - kAsBright].first) continue;
      const std::size_t median = others[others.size() / 2].second;
      for (std::size_t c = 0; c < kColors; ++c) out.color[c][i] = e.color[c][median], out.color_variance[c][i] = e.color_variance[c][median];
    }
  });
  return out;
}

}  // namespace

std::vector<float> denoise(const Estimates& traced) {
  std::vector<float> result(static_cast<std::size_t>(traced.width * traced.height) * kColors);
  const Estimates e = without_spikes(traced);
  const auto scales = guide_scales(e);
  tbb::parallel_for(std::int64_t{0}, (e.height + kBand - 1) / kBand, [&](std::int64_t band) {
    Band(e, scales, band * kBand, std::min(e.height, (band + 1) * kBand)).run(result);
  });
  return result;
}

}  // namespace render::image
