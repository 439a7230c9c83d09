// Tiles of pixels to threads, samples to pixels.
#include <pmmintrin.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cmath>

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

}  // namespace

struct PathTracer::Impl {
  Impl(const Setting& s, int threads)
      : setting(s), options(s.options), scene(trace::make_scene(s)), geometry(scene.surfaces, threads), arena(threads) {}

  trace::Ray camera_ray(const trace::Camera&, const sampling::PixelSampler&, std::uint32_t sample, std::int64_t x, std::int64_t y) const;
  void pixel(const trace::Camera&, const sampling::Sequence&, std::int64_t x, std::int64_t y, std::int64_t frame, float* out) const;
  void tile(const trace::Camera&, const sampling::Sequence&, std::int64_t number, std::int64_t frame, Image&) const;
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

void PathTracer::Impl::pixel(const trace::Camera& camera, const sampling::Sequence& sequence, std::int64_t x, std::int64_t y, std::int64_t frame, float* out) const {
  const trace::Integrator integrator(scene, geometry);
  const sampling::PixelSampler points(sequence, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
  Vec3f color = Vec3f::Zero(), albedo = Vec3f::Zero(), normal = Vec3f::Zero();
  Eigen::Vector2f motion = Eigen::Vector2f::Zero();
  float depth = 0;
  int id = 0;
  for (std::int64_t s = 0; s < options.spp; ++s) {
    const trace::Ray ray = camera_ray(camera, points, static_cast<std::uint32_t>(s), x, y);
    trace::FirstHit first;
    const Vec3f radiance = integrator.radiance(ray, points, static_cast<std::uint32_t>(s), first);
    if (!radiance.allFinite()) complain_of_pixel(x, y, s, frame);
    color += radiance;
    motion += camera.motion(ray, first);
    if (!first.found) continue;
    albedo += first.albedo;
    normal += first.normal;
    const float z = camera.depth(ray, first.t);
    if (depth != 0 && z >= depth) continue;
    depth = z;
    id = first.id;
  }
  const float share = 1 / static_cast<float>(options.spp);
  const Vec3f c = share * color, a = share * albedo, n = share * normal;
  const float values[] = {c.x(), c.y(), c.z(), 1, a.x(), a.y(), a.z(), n.x(), n.y(), n.z(), depth, share * motion.x(), share * motion.y(), static_cast<float>(id),
                          static_cast<float>(options.spp)};
  std::copy(std::begin(values), std::end(values), out);
}

void PathTracer::Impl::tile(const trace::Camera& camera, const sampling::Sequence& sequence, std::int64_t number, std::int64_t frame, Image& image) const {
  const FlushDenormals scope;
  const std::int64_t left = number % tiles_across() * kTile, top = number / tiles_across() * kTile;
  for (std::int64_t y = top; y < std::min(top + kTile, options.height); ++y)
    for (std::int64_t x = left; x < std::min(left + kTile, options.width); ++x)
      pixel(camera, sequence, x, y, frame, &image.pixels[static_cast<std::size_t>(y * options.width + x) * kChannels.size()]);
}

PathTracer::PathTracer(const Setting& setting, int threads) : impl_(std::make_unique<Impl>(setting, threads)) {}
PathTracer::~PathTracer() = default;

Image PathTracer::trace(const surface::Mesh& mesh, std::int64_t frame, base::Ledger& ledger) {
  Impl& m = *impl_;
  const trace::Camera camera(m.setting, frame);
  {
    const auto pass = ledger.pass("bvh", bytes_of(mesh));
    m.geometry.set_liquid(mesh, camera.exposure());
  }
  Image image{.width = m.options.width, .height = m.options.height, .channels = kChannels, .pixels = {}};
  image.pixels.resize(static_cast<std::size_t>(image.width * image.height) * kChannels.size());
  const auto pass = ledger.pass("trace", static_cast<std::int64_t>(image.pixels.size() * sizeof(float)));
  const sampling::Sequence sequence(m.options.spp, frame);
  m.arena.execute([&] { tbb::parallel_for(std::int64_t{0}, m.tiles(), [&](std::int64_t number) { m.tile(camera, sequence, number, frame, image); }); });
  return image;
}

}  // namespace render
