#include "render/sampling/sampler.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "render/trace/filter.h"

using render::sampling::PixelSampler;
using render::sampling::Point;
using render::sampling::Sequence;

// A (0,2)-net: each of the 16 boxes of area 1/16, in all five shapes, holds one of a pixel's 16 samples.
TEST(Sampler, PutsOneSampleIntoEachElementaryBox) {
  const Sequence sequence(16, 3);
  for (std::uint32_t pixel = 0; pixel < 50; ++pixel)
    for (std::uint32_t dimension : {0u, 1u, 7u, 4097u}) {
      const PixelSampler points(sequence, 31 * pixel, 17 * pixel + 5);
      for (int across = 1; across <= 16; across *= 2) {
        std::set<int> boxes;
        for (std::uint32_t i = 0; i < 16; ++i) {
          const Point p = points.point(i, dimension);
          boxes.insert(static_cast<int>(p.x * static_cast<float>(across)) * 16 + static_cast<int>(p.y * static_cast<float>(16 / across)));
        }
        ASSERT_EQ(boxes.size(), 16u) << "pixel " << pixel << ", dimension " << dimension << ", boxes across " << across;
      }
    }
}

// Along the Z-order curve four pixels together are a net of 64 samples.
TEST(Sampler, LetsNeighbouringPixelsCompleteEachOther) {
  const Sequence sequence(16, 1);
  std::set<int> boxes;
  for (std::uint32_t y = 0; y < 2; ++y)
    for (std::uint32_t x = 0; x < 2; ++x)
      for (std::uint32_t i = 0; i < 16; ++i) {
        const Point p = PixelSampler(sequence, 10 + x, 6 + y).point(i, 2);
        boxes.insert(static_cast<int>(p.x * 8) * 8 + static_cast<int>(p.y * 8));
      }
  EXPECT_EQ(boxes.size(), 64u);
}

TEST(Sampler, GivesOtherPointsInOtherFramesPixelsAndDimensions) {
  const auto x = [](std::int64_t frame, std::uint32_t pixel, std::uint32_t dimension) {
    return PixelSampler(Sequence(16, frame), pixel, 0).point(5, dimension).x;
  };
  std::set<float> seen{x(1, 0, 0), x(2, 0, 0), x(1, 1, 0), x(1, 0, 1), x(2, 1, 1)};
  EXPECT_EQ(seen.size(), 5u);
  EXPECT_EQ(x(1, 0, 0), x(1, 0, 0));
}

// Correlation of n independent pairs is about 1 / sqrt(n): 0.01 for 20000 pairs at 1.4 sigma, 0.03 at 4 sigma.
TEST(Sampler, KeepsDimensionsIndependent) {
  const Sequence sequence(1, 1);
  double sum = 0, square = 0;
  constexpr int kPairs = 20000;
  for (std::uint32_t pixel = 0; pixel < kPairs; ++pixel) {
    const PixelSampler points(sequence, pixel % 200, pixel / 200);
    const double a = points.point(0, 1).x - 0.5, b = points.point(0, 2).x - 0.5;
    sum += a * b * 12;
    square += a * a * 12;
  }
  EXPECT_NEAR(square / kPairs, 1, 0.03);
  EXPECT_NEAR(sum / kPairs, 0, 0.03);
}

// The window's variance [pixels^2], integrated here, against that of the offsets.
TEST(PixelFilter, IsABlackmanHarrisWindow) {
  const double pi = std::numbers::pi;
  double weight = 0, square = 0, drawn = 0, mean = 0;
  constexpr int kSteps = 100000;
  const render::trace::PixelFilter filter;
  for (int i = 0; i < kSteps; ++i) {
    const double s = (i + 0.5) / kSteps, x = (2 * s - 1) * 1.5;
    const double w = 0.35875 - 0.48829 * std::cos(2 * pi * s) + 0.14128 * std::cos(4 * pi * s) - 0.01168 * std::cos(6 * pi * s);
    weight += w;
    square += w * x * x;
    const double offset = filter.offset(static_cast<float>(s));
    drawn += offset * offset / kSteps;
    mean += offset / kSteps;
  }
  EXPECT_NEAR(mean, 0, 1e-4);
  EXPECT_NEAR(drawn, square / weight, 0.01 * square / weight);  // the table's steps
}
