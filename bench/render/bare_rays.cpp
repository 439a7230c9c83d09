#include "bench/render/bare_rays.h"

#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <xmmintrin.h>

#include <chrono>
#include <random>

#include "render/trace/optics.h"

namespace bench {
namespace {

using base::Vec3f;

constexpr std::size_t kPaths = 1 << 17, kBounces = 8, kChunk = 4096;

struct Start {
  Vec3f origin, direction;
};

RTCScene build(RTCDevice device, const surface::Mesh& mesh) {
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
  auto* vertices =
      static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.position.size()));
  for (std::size_t i = 0; i < mesh.position.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) vertices[3 * i + c] = mesh.position[i][static_cast<int>(c)];
  auto* quads = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, sizeof(mesh.quads[0]), mesh.quads.size());
  std::copy(mesh.quads.begin(), mesh.quads.end(), static_cast<std::array<std::uint32_t, 4>*>(quads));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  return scene;
}

RTCRayHit query(RTCScene scene, const Start& s) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit q;
  q.ray = {s.origin.x(), s.origin.y(), s.origin.z(), 1e-5f, s.direction.x(), s.direction.y(), s.direction.z(), 0, 1e9f, ~0u, 0, 0};
  q.hit.geomID = q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &context, &q);
  return q;
}

std::vector<Start> diffuse_paths(RTCScene scene, const Vec3f& middle) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 1);
  const auto point = [&] { return render::sampling::Point{uniform(random), uniform(random)}; };
  std::vector<Start> starts;
  starts.reserve(kPaths * (kBounces + 1));
  for (std::size_t path = 0; path < kPaths; ++path) {
    Start next{middle, render::trace::cap_direction(2, point())};
    for (std::size_t bounce = 0; bounce <= kBounces; ++bounce) {
      starts.push_back(next);
      const RTCRayHit hit = query(scene, next);
      if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) break;
      Vec3f normal = Vec3f(hit.hit.Ng_x, hit.hit.Ng_y, hit.hit.Ng_z).normalized();
      if (normal.dot(next.direction) > 0) normal = -normal;
      next = {next.origin + hit.ray.tfar * next.direction + 1e-4f * normal,
              render::trace::Frame(normal).world(render::trace::cosine_direction(point()))};
    }
  }
  return starts;
}

}  // namespace

double bare_rays_per_second(const surface::Mesh& mesh, const Vec3f& middle, int threads) {
  RTCDevice device = rtcNewDevice("isa=avx2");
  RTCScene scene = build(device, mesh);
  const std::vector<Start> starts = diffuse_paths(scene, middle);
  std::vector<float> met((starts.size() + kChunk - 1) / kChunk);  // read, so that nothing is left out
  tbb::task_arena arena(threads);
  const auto begin = std::chrono::steady_clock::now();
  arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, met.size(), [&](std::size_t chunk) {
      _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
      _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
      for (std::size_t i = chunk * kChunk; i < std::min(starts.size(), (chunk + 1) * kChunk); ++i) met[chunk] += query(scene, starts[i]).ray.tfar;
    });
  });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
  return static_cast<double>(starts.size()) / seconds;
}

}  // namespace bench
