// Tiles of pixels to threads, samples to pixels.
#include <pmmintrin.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <xmmintrin.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "render/render.h"
#include "render/sampling/sampler.h"
#include "render/trace/camera.h"
#include "render/trace/filter.h"
#include "render/trace/integrator.h"

namespace render {
namespace {

using base::Vec3f;

constexpr std::int64_t kTile = 16;  // [pixels]
const std::vector<std::string> kChannels = {"R", "G", "B", "A", "albedo.R", "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z", "Z", "motion.X", "motion.Y", "id", "samples"};

constexpr std::size_t kAlpha = 3, kDepth = 10, kId = 13, kSamples = 14;  // their numbers

/// Samples a pixel gets between two looks at the noise, or at the clock.
constexpr std::int64_t kBatch = 16, kTimedBatch = 4;

float luminance(const Vec3f& c) { return 0.2126f * c.x() + 0.7152f * c.y() + 0.0722f * c.z(); }

/// Dimensions of the points that choose a camera ray; the integrator's start at 1.
constexpr std::uint32_t kPixel = 0, kLens = 0x80000000, kTime = 0x80000001;

/// Denormal numbers count as zero, as Embree's traversal wants it, until the end of the scope.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  }
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned saved_;
};

[[noreturn]] void complain_of_pixel(std::int64_t x, std::int64_t y, std::int64_t sample, std::int64_t frame) {
  throw base::Error({.code = base::Exit::fault, .message = "render: frame " + std::to_string(frame) + ", pixel (" + std::to_string(x) + ", " +
                                                           std::to_string(y) + "), sample " + std::to_string(sample) + ": radiance is not finite"});
}

std::int64_t bytes_of(const surface::Mesh& mesh) {
  return static_cast<std::int64_t>(mesh.position.size() * 2 * sizeof(Vec3f) + mesh.quads.size() * sizeof(mesh.quads[0]));
}

std::int64_t bytes_of(const Grains& grains) { return static_cast<std::int64_t>(grains.position.size() * (2 * sizeof(Vec3f) + sizeof(grains.id[0]))); }

/// What all samples of a frame share.
struct Shot {
  const trace::Camera& camera;
  trace::Media around;  // the camera
  const sampling::Sequence& sequence;
  std::int64_t frame;
};

}  // namespace

Grains grains_of(sim::Frame frame) {
  return {.position = std::move(frame.position), .velocity = std::move(frame.velocity), .id = std::move(frame.id), .body = {}, .radius = frame.pscale};
}

struct PathTracer::Impl {
  Impl(const Setting& s, int threads)
      : setting(s), options(s.options), scene(trace::make_scene(s)), geometry(scene.surfaces, threads), arena(threads) {}

  trace::Ray camera_ray(const trace::Camera&, const sampling::PixelSampler&, std::uint32_t sample, std::int64_t x, std::int64_t y) const;
  void add_samples(const Shot&, std::int64_t x, std::int64_t y, std::int64_t first, std::int64_t last, Image&, std::vector<float>& squares) const;
  void tile(const Shot&, std::int64_t number, std::int64_t first, std::int64_t last, Image&, std::vector<float>& squares) const;
  double tile_error(std::int64_t number, const Image&, const std::vector<float>& squares) const;
  template <class Visit>
  void each_pixel_of(std::int64_t number, const Visit& visit) const;
  void pass(const Shot&, const std::vector<std::int64_t>& numbers, std::int64_t first, std::int64_t last, Image&, std::vector<float>& squares);
  std::int64_t tiles_across() const { return (options.width + kTile - 1) / kTile; }
  std::int64_t tiles() const { return tiles_across() * ((options.height + kTile - 1) / kTile); }

  Setting setting;
  Options options;
  trace::Scene scene;
  trace::Geometry geometry;
  trace::PixelFilter filter;
  tbb::task_arena arena;
};

trace::Ray PathTracer::Impl::camera_ray(const trace::Camera& camera, const sampling::PixelSampler& points, std::uint32_t sample, std::int64_t x, std::int64_t y) const {
  const sampling::Point at = points.point(sample, kPixel);
  return camera.ray(static_cast<float>(x) + (0.5f + filter.offset(at.x)), static_cast<float>(y) + (0.5f + filter.offset(at.y)), points.point(sample, kLens),
                    points.point(sample, kTime).x);
}

/// Until finish() the image holds sums over samples; depth and id those of the nearest.
void PathTracer::Impl::add_samples(const Shot& shot, std::int64_t x, std::int64_t y, std::int64_t first_sample, std::int64_t last, Image& image, std::vector<float>& squares) const {
  const trace::Integrator integrator(scene, geometry);
  const sampling::PixelSampler points(shot.sequence, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
  Vec3f color = Vec3f::Zero(), albedo = Vec3f::Zero(), normal = Vec3f::Zero();
  Eigen::Vector2f motion = Eigen::Vector2f::Zero();
  float* out = &image.pixels[static_cast<std::size_t>(y * options.width + x) * kChannels.size()];
  float depth = out[kDepth], square = 0;
  int id = static_cast<int>(out[kId]);
  for (std::int64_t s = first_sample; s < last; ++s) {
    const trace::Ray ray = camera_ray(shot.camera, points, static_cast<std::uint32_t>(s), x, y);
    trace::FirstHit first;
    const Vec3f radiance = integrator.radiance(ray, shot.around, points, static_cast<std::uint32_t>(s), first);
    if (!radiance.allFinite()) complain_of_pixel(x, y, s, shot.frame);
    color += radiance;
    square += luminance(radiance) * luminance(radiance);
    motion += shot.camera.motion(ray, first);
    if (!first.found) continue;
    albedo += first.albedo;
    normal += first.normal;
    const float z = shot.camera.depth(ray, first.t);
    if (depth != 0 && z >= depth) continue;
    depth = z;
    id = first.id;
  }
  const float values[] = {color.x(), color.y(), color.z(), 0, albedo.x(), albedo.y(), albedo.z(), normal.x(), normal.y(), normal.z(), 0, motion.x(), motion.y(), 0,
                          static_cast<float>(last - first_sample)};
  for (std::size_t c = 0; c < kChannels.size(); ++c) out[c] += values[c];
  out[kDepth] = depth;
  out[kId] = static_cast<float>(id);
  if (!squares.empty()) squares[static_cast<std::size_t>(y * options.width + x)] += square;
}

template <class Visit>
void PathTracer::Impl::each_pixel_of(std::int64_t number, const Visit& visit) const {
  const std::int64_t left = number % tiles_across() * kTile, top = number / tiles_across() * kTile;
  for (std::int64_t y = top; y < std::min(top + kTile, options.height); ++y)
    for (std::int64_t x = left; x < std::min(left + kTile, options.width); ++x) visit(x, y);
}

void PathTracer::Impl::tile(const Shot& shot, std::int64_t number, std::int64_t first, std::int64_t last, Image& image, std::vector<float>& squares) const {
  const FlushDenormals scope;
  each_pixel_of(number, [&](std::int64_t x, std::int64_t y) { add_samples(shot, x, y, first, last, image, squares); });
}

/// Standard error of the tile's pixels, root mean square, as a share of their brightness. Samples of a pixel are stratified: it is less.
double PathTracer::Impl::tile_error(std::int64_t number, const Image& image, const std::vector<float>& squares) const {
  constexpr double kDark = 0.01;  // brightness below which noise is not seen
  double variance = 0, brightness = 0, count = 0;
  each_pixel_of(number, [&](std::int64_t x, std::int64_t y) {
    const std::size_t i = static_cast<std::size_t>(y * options.width + x);
    const float* sums = &image.pixels[i * kChannels.size()];
    const double n = static_cast<double>(sums[kSamples]), mean = static_cast<double>(luminance({sums[0], sums[1], sums[2]})) / n;
    variance += std::max(0.0, static_cast<double>(squares[i]) / n - mean * mean) / (n - 1);
    brightness += mean;
    ++count;
  });
  return std::sqrt(variance / count) / (brightness / count + kDark);
}

void PathTracer::Impl::pass(const Shot& shot, const std::vector<std::int64_t>& numbers, std::int64_t first, std::int64_t last, Image& image, std::vector<float>& squares) {
  arena.execute([&] { tbb::parallel_for(std::size_t{0}, numbers.size(), [&](std::size_t i) { tile(shot, numbers[i], first, last, image, squares); }); });
}

namespace {

void finish(Image& image) {
  for (std::size_t i = 0; i < image.pixels.size(); i += kChannels.size()) {
    const float share = 1 / image.pixels[i + kSamples];
    for (std::size_t c = 0; c < kSamples; ++c)
      if (c != kDepth && c != kId) image.pixels[i + c] *= share;
    image.pixels[i + kAlpha] = 1;
  }
}

}  // namespace

PathTracer::PathTracer(const Setting& setting, int threads) : impl_(std::make_unique<Impl>(setting, threads)) {}
PathTracer::~PathTracer() = default;

Image PathTracer::trace(const surface::Mesh& mesh, std::int64_t frame, base::Ledger& ledger) { return trace(mesh, {}, frame, ledger); }

Image PathTracer::trace(const surface::Mesh& mesh, const Grains& grains, std::int64_t frame, base::Ledger& ledger) {
  Impl& m = *impl_;
  const trace::Camera camera(m.setting, frame);
  {
    const auto pass = ledger.pass("bvh", bytes_of(mesh) + bytes_of(grains));
    m.arena.execute([&] { m.geometry.set_frame(mesh, grains, camera.exposure()); });
  }
  Image image{.width = m.options.width, .height = m.options.height, .channels = kChannels, .pixels = {}};
  image.pixels.resize(static_cast<std::size_t>(image.width * image.height) * kChannels.size());
  const auto pass = ledger.pass("trace", static_cast<std::int64_t>(image.pixels.size() * sizeof(float)));
  const sampling::Sequence sequence(m.options.spp, frame);
  const Options& o = m.options;
  const Shot shot{camera, trace::Integrator(m.scene, m.geometry).media_at(camera.ray(0.5f * static_cast<float>(o.width), 0.5f * static_cast<float>(o.height), {0.5f, 0.5f}, 0.5f).origin, 0.5f), sequence, frame};
  std::vector<float> squares(o.noise ? static_cast<std::size_t>(image.width * image.height) : 0);
  std::vector<std::int64_t> numbers(static_cast<std::size_t>(m.tiles()));
  std::iota(numbers.begin(), numbers.end(), 0);
  const std::int64_t batch = o.noise ? kBatch : o.time_limit ? kTimedBatch : o.spp;
  const auto start = std::chrono::steady_clock::now();
  for (std::int64_t first = 0; first < o.spp && !numbers.empty(); first += batch) {
    m.pass(shot, numbers, first, std::min(o.spp, first + batch), image, squares);
    if (o.noise) std::erase_if(numbers, [&](std::int64_t number) { return m.tile_error(number, image, squares) <= *o.noise; });
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!o.time_limit || seconds < *o.time_limit || first + batch >= o.spp || numbers.empty()) continue;
    image.reproducible = false;
    break;
  }
  finish(image);
  return image;
}

}  // namespace render
