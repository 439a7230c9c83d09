// Tiles of pixels to threads, samples to pixels.
#include <pmmintrin.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <xmmintrin.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "render/image/denoise.h"
#include "render/render.h"
#include "render/sampling/sampler.h"
#include "render/trace/camera.h"
#include "render/trace/filter.h"
#include "render/trace/integrator.h"

namespace render {
namespace {

using base::Vec3f;

constexpr std::int64_t kTile = 16;  // [pixels]
const std::vector<std::string> kChannels = {"R", "G", "B", "A", "albedo.R", "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z", "Z", "motion.X", "motion.Y",
                                            "id", "samples"};

constexpr std::size_t kAlpha = 3, kDepth = 10, kId = 13, kSamples = 14;  // their numbers

constexpr std::size_t kColors = image::kColors, kGuides = image::kGuides;
constexpr std::size_t kMoments = kColors + 2 * kGuides;  // squares of colours, guides and their squares

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

/// What samples have added up to: until finish() the image holds sums; depth and id those of the nearest.
struct Film {
  Image image;
  std::vector<float> squares;  // of luminance, one a pixel, where tiles may stop
  std::vector<float> moments;  // kMoments a pixel, where noise is to be taken out
};

void add_moments(const Vec3f& radiance, const trace::FirstHit& first, float* moments) {
  const Eigen::Array3f guides[] = {first.normal.array(), first.guide_albedo.array(), first.guide_normal.array()};
  for (int c = 0; c < 3; ++c) moments[c] += radiance[c] * radiance[c];
  for (int g = 0; g < static_cast<int>(kGuides); ++g) {
    const float value = guides[g / 3][g % 3];
    moments[kColors + static_cast<std::size_t>(g)] += value;
    moments[kColors + kGuides + static_cast<std::size_t>(g)] += value * value;
  }
}

/// What all samples of a frame share.
struct Shot {
  const trace::Camera& camera;
  trace::Media around;  // the camera
  const sampling::Sequence& sequence;
  std::int64_t frame;
};

}  // namespace

Grains grains_of(sim::Frame frame) {
  return {.position = std::move(frame.position), .velocity = std::move(frame.velocity), .id = std::move(frame.id), .body = std::move(frame.body),
          .radius = frame.pscale};
}

struct PathTracer::Impl {
  Impl(const Setting& s, int threads)
      : setting(s), options(s.options), scene(trace::make_scene(s)), geometry(scene.surfaces, threads), arena(threads) {}

  trace::Ray camera_ray(const trace::Camera&, const sampling::PixelSampler&, std::uint32_t sample, std::int64_t x, std::int64_t y) const;
  void add_samples(const Shot&, std::int64_t x, std::int64_t y, std::int64_t first, std::int64_t last, Film&) const;
  void tile(const Shot&, std::int64_t number, std::int64_t first, std::int64_t last, Film&) const;
  double tile_error(std::int64_t number, const Film&) const;
  template <class Visit>
  void each_pixel_of(std::int64_t number, const Visit& visit) const;
  void pass(const Shot&, const std::vector<std::int64_t>& numbers, std::int64_t first, std::int64_t last, Film&);
  void trace(const trace::Camera&, std::int64_t frame, Film&, base::Ledger&);
  Image picture(const trace::Camera&, std::int64_t frame, base::Ledger&);
  std::int64_t tiles_across() const { return (options.width + kTile - 1) / kTile; }
  std::int64_t tiles() const { return tiles_across() * ((options.height + kTile - 1) / kTile); }

  Setting setting;
  Options options;
  trace::Scene scene;
  trace::Geometry geometry;
  trace::PixelFilter filter;
  tbb::task_arena arena;
};

trace::Ray PathTracer::Impl::camera_ray(const trace::Camera& camera, const sampling::PixelSampler& points, std::uint32_t sample, std::int64_t x,
                                        std::int64_t y) const {
  const sampling::Point at = points.point(sample, kPixel);
  return camera.ray(static_cast<float>(x) + (0.5f + filter.offset(at.x)), static_cast<float>(y) + (0.5f + filter.offset(at.y)),
                    points.point(sample, kLens), points.point(sample, kTime).x);
}

void PathTracer::Impl::add_samples(const Shot& shot, std::int64_t x, std::int64_t y, std::int64_t first_sample, std::int64_t last, Film& film) const {
  const trace::Integrator integrator(scene, geometry);
  const sampling::PixelSampler points(shot.sequence, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
  Vec3f color = Vec3f::Zero(), albedo = Vec3f::Zero(), normal = Vec3f::Zero();
  Eigen::Vector2f motion = Eigen::Vector2f::Zero();
  const auto pixel = static_cast<std::size_t>(y * options.width + x);
  float* out = &film.image.pixels[pixel * kChannels.size()];
  float depth = out[kDepth], square = 0;
  int id = static_cast<int>(out[kId]);
  for (std::int64_t s = first_sample; s < last; ++s) {
    const trace::Ray ray = camera_ray(shot.camera, points, static_cast<std::uint32_t>(s), x, y);
    trace::FirstHit first;
    const Vec3f radiance = integrator.radiance(ray, shot.around, points, static_cast<std::uint32_t>(s), first);
    if (!radiance.allFinite()) complain_of_pixel(x, y, s, shot.frame);
    color += radiance;
    square += luminance(radiance) * luminance(radiance);
    if (!film.moments.empty()) add_moments(radiance, first, &film.moments[pixel * kMoments]);
    motion += shot.camera.motion(ray, first);
    if (!first.found) continue;
    albedo += first.albedo;
    normal += first.normal;
    const float z = shot.camera.depth(ray, first.t);
    if (depth != 0 && z >= depth) continue;
    depth = z;
    id = first.id;
  }
  const float values[] = {color.x(), color.y(), color.z(), 0, albedo.x(), albedo.y(), albedo.z(), normal.x(), normal.y(), normal.z(), 0, motion.x(),
                          motion.y(), 0, static_cast<float>(last - first_sample)};
  for (std::size_t c = 0; c < kChannels.size(); ++c) out[c] += values[c];
  out[kDepth] = depth;
  out[kId] = static_cast<float>(id);
  if (!film.squares.empty()) film.squares[pixel] += square;
}

template <class Visit>
void PathTracer::Impl::each_pixel_of(std::int64_t number, const Visit& visit) const {
  const std::int64_t left = number % tiles_across() * kTile, top = number / tiles_across() * kTile;
  for (std::int64_t y = top; y < std::min(top + kTile, options.height); ++y)
    for (std::int64_t x = left; x < std::min(left + kTile, options.width); ++x) visit(x, y);
}

void PathTracer::Impl::tile(const Shot& shot, std::int64_t number, std::int64_t first, std::int64_t last, Film& film) const {
  const FlushDenormals scope;
  each_pixel_of(number, [&](std::int64_t x, std::int64_t y) { add_samples(shot, x, y, first, last, film); });
}

/// Standard error of the tile's pixels, root mean square, as a share of their brightness. Samples of a pixel are stratified: it is less.
double PathTracer::Impl::tile_error(std::int64_t number, const Film& film) const {
  constexpr double kDark = 0.01;  // brightness below which noise is not seen
  double variance = 0, brightness = 0, count = 0;
  each_pixel_of(number, [&](std::int64_t x, std::int64_t y) {
    const std::size_t i = static_cast<std::size_t>(y * options.width + x);
    const float* sums = &film.image.pixels[i * kChannels.size()];
    const double n = static_cast<double>(sums[kSamples]), mean = static_cast<double>(luminance({sums[0], sums[1], sums[2]})) / n;
    variance += std::max(0.0, static_cast<double>(film.squares[i]) / n - mean * mean) / (n - 1);
    brightness += mean;
    ++count;
  });
  return std::sqrt(variance / count) / (brightness / count + kDark);
}

void PathTracer::Impl::pass(const Shot& shot, const std::vector<std::int64_t>& numbers, std::int64_t first, std::int64_t last, Film& film) {
  arena.execute([&] { tbb::parallel_for(std::size_t{0}, numbers.size(), [&](std::size_t i) { tile(shot, numbers[i], first, last, film); }); });
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

/// Of a finished film. The variance of a mean is that of independent samples: stratified ones have less.
image::Estimates estimates(const Film& film) {
  const std::size_t pixels = film.moments.size() / kMoments;
  image::Estimates e{.width = film.image.width, .height = film.image.height, .color = {}, .color_variance = {}, .guide = {}, .guide_variance = {}};
  for (auto* planes : {&e.color, &e.color_variance})
    for (auto& plane : *planes) plane.resize(pixels);
  for (auto* planes : {&e.guide, &e.guide_variance})
    for (auto& plane : *planes) plane.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* means = &film.image.pixels[i * kChannels.size()];
    const float* moments = &film.moments[i * kMoments];
    const float n = means[kSamples], share = 1 / n, apart = 1 / std::max(1.0f, n - 1);
    const auto variance = [&](float mean, float squares) { return std::max(0.0f, squares * share - mean * mean) * apart; };
    for (std::size_t c = 0; c < kColors; ++c) {
      e.color[c][i] = means[c];
      e.color_variance[c][i] = variance(means[c], moments[c]);
    }
    for (std::size_t g = 0; g < kGuides; ++g) {
      e.guide[g][i] = moments[kColors + g] * share;
      e.guide_variance[g][i] = variance(e.guide[g][i], moments[kColors + kGuides + g]);
    }
  }
  return e;
}

/// Puts three channels behind the others.
void add_layer(const std::vector<float>& colors, Image& image) {
  const std::size_t before = image.channels.size(), after = before + kColors;
  std::vector<float> pixels(image.pixels.size() / before * after);
  for (std::size_t i = 0; i * before < image.pixels.size(); ++i) {
    std::copy_n(&image.pixels[i * before], before, &pixels[i * after]);
    std::copy_n(&colors[i * kColors], kColors, &pixels[i * after + before]);
  }
  image.pixels = std::move(pixels);
  for (const char* channel : {"denoised.R", "denoised.G", "denoised.B"}) image.channels.push_back(channel);
}

}  // namespace

PathTracer::PathTracer(const Setting& setting, int threads)
    : impl_(std::make_unique<Impl>(setting, std::min(threads, tbb::info::default_concurrency()))) {}   // TBB complains of more
PathTracer::~PathTracer() = default;

Image PathTracer::trace(const surface::Mesh& mesh, std::int64_t frame, base::Ledger& ledger) { return trace(mesh, {}, frame, ledger); }

Image PathTracer::trace(const surface::Mesh& mesh, const Grains& grains, std::int64_t frame, base::Ledger& ledger) {
  Impl& m = *impl_;
  const trace::Camera camera(m.setting, frame);
  {
    const auto pass = ledger.pass("bvh", bytes_of(mesh) + bytes_of(grains));
    m.arena.execute([&] { m.geometry.set_frame(mesh, grains, camera.exposure()); });
  }
  return m.picture(camera, frame, ledger);
}

Image PathTracer::trace_bodies(const std::vector<surface::Mesh>& meshes, const Grains& grains, std::int64_t frame, base::Ledger& ledger) {
  Impl& m = *impl_;
  const trace::Camera camera(m.setting, frame);
  {
    auto pass = ledger.pass("bvh", bytes_of(grains));
    for (const surface::Mesh& mesh : meshes) pass.count(bytes_of(mesh));
    m.arena.execute([&] { m.geometry.set_bodies(meshes, grains, camera.exposure()); });
  }
  return m.picture(camera, frame, ledger);
}

/// Of the scene as it is set.
Image PathTracer::Impl::picture(const trace::Camera& camera, std::int64_t frame, base::Ledger& ledger) {
  const Options& o = options;
  const auto pixels = static_cast<std::size_t>(o.width * o.height);
  Film film{.image = {.width = o.width, .height = o.height, .channels = kChannels, .pixels = std::vector<float>(pixels * kChannels.size())},
            .squares = std::vector<float>(o.noise ? pixels : 0), .moments = std::vector<float>(o.denoise == "none" ? 0 : pixels * kMoments)};
  trace(camera, frame, film, ledger);
  if (o.denoise == "none") return std::move(film.image);
  const auto pass = ledger.pass("denoise", static_cast<std::int64_t>(film.moments.size() * sizeof(float)));
  arena.execute([&] { add_layer(image::denoise(estimates(film)), film.image); });
  return std::move(film.image);
}

void PathTracer::Impl::trace(const trace::Camera& camera, std::int64_t frame, Film& film, base::Ledger& ledger) {
  const auto pass = ledger.pass("trace", static_cast<std::int64_t>(film.image.pixels.size() * sizeof(float)));
  const Options& o = options;
  const sampling::Sequence sequence(o.spp, frame);
  const Shot shot{camera,
                  trace::Integrator(scene, geometry)
                      .media_at(camera.ray(0.5f * static_cast<float>(o.width), 0.5f * static_cast<float>(o.height), {0.5f, 0.5f}, 0.5f).origin, 0.5f),
                  sequence, frame};
  std::vector<std::int64_t> numbers(static_cast<std::size_t>(tiles()));
  std::iota(numbers.begin(), numbers.end(), 0);
  const std::int64_t batch = o.noise ? kBatch : o.time_limit ? kTimedBatch : o.spp;
  const auto start = std::chrono::steady_clock::now();
  for (std::int64_t first = 0; first < o.spp && !numbers.empty(); first += batch) {
    this->pass(shot, numbers, first, std::min(o.spp, first + batch), film);
    if (o.noise) std::erase_if(numbers, [&](std::int64_t number) { return tile_error(number, film) <= *o.noise; });
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!o.time_limit || seconds < *o.time_limit || first + batch >= o.spp || numbers.empty()) continue;
    film.image.reproducible = false;
    break;
  }
  finish(film.image);
}

}  // namespace render
