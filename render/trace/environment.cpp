#include "render/trace/environment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "base/text.h"
#include "render/render.h"
#include "render/trace/lights.h"

namespace render::trace {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kBelowOne = 0x1.fffffep-1f;

/// Cumulated shares of n weights, from 0 to 1; even where all are 0.
void cumulate(const double* weights, int n, float* out) {
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += weights[i];
  double so_far = 0;
  for (int i = 0; i < n; ++i) {
    out[i] = static_cast<float>(sum > 0 ? so_far / sum : static_cast<double>(i) / n);
    so_far += weights[i];
  }
  out[n] = 1;
}

/// Number of the step that u falls on, and how far into it.
std::pair<int, float> find_step(const float* cumulated, int n, float u) {
  const int i = std::clamp(static_cast<int>(std::upper_bound(cumulated, cumulated + n + 1, u) - cumulated) - 1, 0, n - 1);
  const float width = cumulated[i + 1] - cumulated[i];
  return {i, width > 0 ? std::min((u - cumulated[i]) / width, kBelowOne) : 0.5f};
}

}  // namespace

Environment::Environment(int width, int height, std::vector<Vec3f> pixels, double rotation_degrees)
    : width_(width), height_(height), rotation_(static_cast<float>(rotation_degrees / 360)), pixels_(std::move(pixels)),
      rows_(static_cast<std::size_t>(height) + 1), columns_(static_cast<std::size_t>(height) * (static_cast<std::size_t>(width) + 1)) {
  std::vector<double> row(static_cast<std::size_t>(width)), sums(static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int b = -1; b <= 1; ++b)
        for (int a = -1; a <= 1; ++a) sum += static_cast<double>(pixel(x + a, y + b).mean());
      row[static_cast<std::size_t>(x)] = sum;
    }
    cumulate(row.data(), width, &columns_[static_cast<std::size_t>(y) * (static_cast<std::size_t>(width) + 1)]);
    double sum = 0;
    for (const double w : row) sum += w;
    sums[static_cast<std::size_t>(y)] = sum * std::sin(std::numbers::pi * (y + 0.5) / height);
  }
  cumulate(sums.data(), height, rows_.data());
}

/// Across: around, without end. Down: clamped.
const Vec3f& Environment::pixel(int x, int y) const {
  x = x < 0 ? x + width_ : x >= width_ ? x - width_ : x;
  return pixels_[static_cast<std::size_t>(std::clamp(y, 0, height_ - 1)) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
}

Environment::Place Environment::place(const Vec3f& d) const {
  float u = 0.5f + std::atan2(d.x(), d.y()) / (2 * kPi) - rotation_;
  u -= std::floor(u);
  return {std::min(u, kBelowOne), std::clamp(std::atan2(std::hypot(d.x(), d.y()), d.z()) / kPi, 0.0f, kBelowOne)};   // near the poles a cosine says nothing
}

Vec3f Environment::radiance(const Vec3f& direction) const {
  const Place at = place(direction);
  const float x = at.u * static_cast<float>(width_) - 0.5f, y = at.v * static_cast<float>(height_) - 0.5f, fx = std::floor(x), fy = std::floor(y);
  const int i = static_cast<int>(fx), j = static_cast<int>(fy);
  const float a = x - fx, b = y - fy;
  return (1 - b) * ((1 - a) * pixel(i, j) + a * pixel(i + 1, j)) + b * ((1 - a) * pixel(i, j + 1) + a * pixel(i + 1, j + 1));
}

/// Share of the drawn directions that fall into a pixel.
float Environment::pixel_share(int x, int y) const {
  const float* row = &columns_[static_cast<std::size_t>(y) * (static_cast<std::size_t>(width_) + 1)];
  return (rows_[static_cast<std::size_t>(y) + 1] - rows_[static_cast<std::size_t>(y)]) * (row[x + 1] - row[x]);
}

float Environment::density(const Vec3f& direction) const {
  const Place at = place(direction);
  const float share = pixel_share(static_cast<int>(at.u * static_cast<float>(width_)), static_cast<int>(at.v * static_cast<float>(height_)));
  const float sine = std::max(1e-6f, std::hypot(direction.x(), direction.y()));
  return share * static_cast<float>(width_) * static_cast<float>(height_) / (2 * kPi * kPi * sine);
}

LightSample Environment::sample(const Vec3f&, sampling::Point p) const {
  const auto [y, down] = find_step(rows_.data(), height_, p.y);
  const auto [x, across] = find_step(&columns_[static_cast<std::size_t>(y) * (static_cast<std::size_t>(width_) + 1)], width_, p.x);
  const float theta = kPi * (static_cast<float>(y) + down) / static_cast<float>(height_);
  const float phi = 2 * kPi * ((static_cast<float>(x) + across) / static_cast<float>(width_) - 0.5f + rotation_);
  const Vec3f direction(std::sin(theta) * std::sin(phi), std::sin(theta) * std::cos(phi), std::cos(theta));
  return {.direction = direction, .distance = std::numeric_limits<float>::infinity(), .density = density(direction), .radiance = radiance(direction)};
}

std::optional<LightHit> Environment::find(const Vec3f&, const Vec3f& direction) const {
  return LightHit{std::numeric_limits<float>::infinity(), density(direction), radiance(direction)};
}

namespace {

struct Picture {
  int width, height;
  std::vector<Vec3f> pixels;
};

Picture read_picture(const std::filesystem::path& path) {
  const std::string kind = base::extension_of(path);
  const Image image = kind == ".exr" || kind == ".hdr" ? read_image(path) : scene_linear(read_image(path));
  std::array<std::size_t, 3> rgb{};
  const std::array<const char*, 3> names{"R", "G", "B"};
  for (std::size_t c = 0; c < 3; ++c) {
    rgb[c] = static_cast<std::size_t>(std::find(image.channels.begin(), image.channels.end(), names[c]) - image.channels.begin());
    if (rgb[c] == image.channels.size())
      base::throw_input(path.string(), std::string("has no channel ") + names[c] + ": an environment is a picture with R, G and B");
  }
  std::vector<Vec3f> pixels(static_cast<std::size_t>(image.width * image.height));
  for (std::size_t i = 0; i < pixels.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const float value = image.pixels[i * image.channels.size() + rgb[c]];
      if (!(value >= 0 && std::isfinite(value)))
        base::throw_input(path.string(), "pixel (" + std::to_string(static_cast<std::int64_t>(i) % image.width) + ", " +
                                             std::to_string(static_cast<std::int64_t>(i) / image.width) + ") is negative or not finite");
      pixels[i][static_cast<int>(c)] = value;
    }
  return {static_cast<int>(image.width), static_cast<int>(image.height), std::move(pixels)};
}

}  // namespace

Environment read_environment(const std::filesystem::path& path, const Vec3f& tint, double rotation_degrees) {
  Picture picture = read_picture(path);
  for (Vec3f& pixel : picture.pixels) pixel = pixel.cwiseProduct(tint);
  return {picture.width, picture.height, std::move(picture.pixels), rotation_degrees};
}

}  // namespace render::trace

namespace render {
void check_environment(const std::filesystem::path& path) { trace::read_picture(path); }
}  // namespace render
