// The only file that knows Embree.
#include "render/trace/geometry.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <new>
#include <numeric>
#include <string>
#include <tuple>

#include "base/error.h"
#include "base/parallel.h"
#include "render/sampling/sampler.h"
#include "render/trace/optics.h"

namespace render::trace {
namespace {

[[noreturn]] void fail(const std::string& what) { throw base::Error({.code = base::Exit::fault, .message = "render: " + what}); }

/// Of what Embree could not do.
[[noreturn]] void fail(const std::string& doing, RTCError error) {
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  fail("Embree, " + doing + ": error " + std::to_string(error));
}

struct Device {
  explicit Device(int threads) : handle(rtcNewDevice(("threads=" + std::to_string(threads) + ",isa=avx2").c_str())) {
    if (!handle) fail("a new device", rtcGetDeviceError(nullptr));
  }
  ~Device() { rtcReleaseDevice(handle); }
  void check(const char* doing) const {
    if (const RTCError error = rtcGetDeviceError(handle); error != RTC_ERROR_NONE) fail(doing, error);
  }
  RTCDevice handle;
};

/// Room for `count` items in a buffer that Embree owns and pads.
template <class T>
T* buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t count, unsigned slot = 0) {
  auto* items = static_cast<T*>(rtcSetNewGeometryBuffer(geometry, type, slot, format, sizeof(T), count));
  if (!items) throw std::bad_alloc();
  return items;
}

RTCGeometry boxes_geometry(RTCDevice device, const std::vector<sim::Shape>& boxes) {
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kFaces{{{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
  auto* vertex = buffer<std::array<float, 3>>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, 8 * boxes.size());
  auto* quad = buffer<std::array<std::uint32_t, 4>>(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT4, kFaces.size() * boxes.size());
  for (std::uint32_t b = 0; b < boxes.size(); ++b) {
    for (const base::Vec3& corner : boxes[b].corners()) *vertex++ = {float(corner.x()), float(corner.y()), float(corner.z())};
    for (const auto& face : kFaces) *quad++ = {8 * b + face[0], 8 * b + face[1], 8 * b + face[2], 8 * b + face[3]};
  }
  return geometry;
}

RTCGeometry spheres_geometry(RTCDevice device, const std::vector<sim::Shape>& spheres) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
  auto* vertex = buffer<std::array<float, 4>>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, spheres.size());
  for (const sim::Shape& shape : spheres) {
    const base::Vec3f middle = shape.sphere->center.cast<float>();
    *vertex++ = {middle.x(), middle.y(), middle.z(), static_cast<float>(shape.sphere->radius)};
  }
  return geometry;
}

/// Whether time steps are needed.
bool moves_in(const Exposure& exposure, const std::vector<Vec3f>& velocity) {
  return exposure.half > 0 && std::any_of(velocity.begin(), velocity.end(), [](const Vec3f& v) { return !v.isZero(0); });
}

/// Rows of a mesh's vertices are read sixteen bytes at a time, so Embree's padded copies are used.
RTCGeometry mesh_geometry(RTCDevice device, const surface::Mesh& mesh, const Exposure& exposure) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
  assert(mesh.velocity.size() == mesh.position.size() && "a mesh has a velocity at each vertex");
  const bool moves = moves_in(exposure, mesh.velocity);
  rtcSetGeometryTimeStepCount(geometry, moves ? 2 : 1);
  for (unsigned step = 0; step < (moves ? 2 : 1); ++step) {
    const float later = moves ? (step == 0 ? -exposure.half : exposure.half) : 0;  // [s]
    auto* vertices = buffer<std::array<float, 3>>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.position.size(), step);
    for (std::size_t i = 0; i < mesh.position.size(); ++i) {
      const Vec3f p = moves ? exposure.moved(mesh.position[i], mesh.velocity[i], later) : mesh.position[i];
      vertices[i] = {p.x(), p.y(), p.z()};
    }
  }
  std::copy(mesh.quads.begin(), mesh.quads.end(),
            buffer<std::array<std::uint32_t, 4>>(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT4, mesh.quads.size()));
  return geometry;
}

RTCGeometry triangle_geometry(RTCDevice device, const files::Triangles& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = buffer<std::array<float, 3>>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.position.size());
  for (std::size_t i = 0; i < mesh.position.size(); ++i) vertices[i] = {mesh.position[i].x(), mesh.position[i].y(), mesh.position[i].z()};
  std::copy(mesh.triangles.begin(), mesh.triangles.end(),
            buffer<std::array<std::uint32_t, 3>>(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.triangles.size()));
  return geometry;
}

constexpr std::size_t kGrainsATask = 1 << 15;
constexpr int kBuilders = 8;  // slots for threads that build a hierarchy over grains

/// Balls at the places of `chosen` grains.
RTCGeometry grains_geometry(RTCDevice device, const Grains& grains, const std::vector<std::uint32_t>& chosen, float radius,
                            const Exposure& exposure) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
  const bool moves = moves_in(exposure, grains.velocity);
  rtcSetGeometryTimeStepCount(geometry, moves ? 2 : 1);
  for (unsigned step = 0; step < (moves ? 2 : 1); ++step) {
    const float later = moves ? (step == 0 ? -exposure.half : exposure.half) : 0;  // [s]
    auto* vertices = buffer<std::array<float, 4>>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, chosen.size(), step);
    base::parallel_chunks(chosen.size(), kGrainsATask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t k = chosen[i];
        const Vec3f p = moves ? exposure.moved(grains.position[k], grains.velocity[k], later) : grains.position[k];
        if (!p.allFinite() || !grains.velocity[k].allFinite()) fail("grain " + std::to_string(grains.id[k]) + " has no finite position and velocity");
        vertices[i] = {p.x(), p.y(), p.z(), radius};
      }
    });
  }
  return geometry;
}

/// Unit normals at the corners of a quad in steps of 1/32767 (0.002 degrees), side by side: a hit reads one cache line, not five.
using CornerNormals = std::array<std::array<std::int16_t, 3>, 4>;

std::vector<CornerNormals> corner_normals(const surface::Mesh& mesh) {
  std::vector<CornerNormals> normals(mesh.quads.size());
  for (std::size_t q = 0; q < normals.size(); ++q)
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float component = mesh.normal[mesh.quads[q][k]][static_cast<int>(axis)];
        if (!(std::abs(component) <= 1.001f)) fail("normal " + std::to_string(mesh.quads[q][k]) + " of the mesh is no unit vector");
        normals[q][k][axis] = static_cast<std::int16_t>(std::lround(std::clamp(component, -1.0f, 1.0f) * 32767));
      }
  return normals;
}

/// At the corners of a triangle: the mean normal of those around a corner that meet at no more than kCrease there; its own where they are more than
/// kMostAround, as around the middle of a fan.
using FacetNormals = std::array<Vec3f, 3>;

std::vector<FacetNormals> corner_normals(const files::Triangles& mesh) {
  constexpr float kCrease = 0.8660254f;   // the cosine of 30 degrees
  constexpr std::size_t kMostAround = 256;
  std::vector<std::uint32_t> corners(3 * mesh.triangles.size());   // by place: files write one for every triangle, or one for all
  std::iota(corners.begin(), corners.end(), 0u);
  const auto place = [&](std::uint32_t corner) -> const Vec3f& { return mesh.position[mesh.triangles[corner / 3][corner % 3]]; };
  std::sort(corners.begin(), corners.end(), [&](std::uint32_t a, std::uint32_t b) {
    const Vec3f &p = place(a), &q = place(b);
    return std::tie(p.x(), p.y(), p.z(), a) < std::tie(q.x(), q.y(), q.z(), b);
  });
  std::vector<Vec3f> areas;   // twice each, along the normal
  for (const auto& t : mesh.triangles)
    areas.push_back((mesh.position[t[1]] - mesh.position[t[0]]).cross(mesh.position[t[2]] - mesh.position[t[0]]));
  std::vector<FacetNormals> normals(mesh.triangles.size());
  for (std::size_t begin = 0, end = 0; begin < corners.size(); begin = end) {
    while (end < corners.size() && place(corners[end]) == place(corners[begin])) ++end;
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3f& own = areas[corners[k] / 3];
      Vec3f sum = end - begin > kMostAround ? own : Vec3f::Zero();
      for (std::size_t other = begin; other < end && end - begin <= kMostAround; ++other)
        if (const Vec3f& area = areas[corners[other] / 3]; own.dot(area) >= kCrease * own.norm() * area.norm()) sum += area;
      normals[corners[k] / 3][corners[k] % 3] = sum.normalized();
    }
  }
  return normals;
}

/// Of a quad's corners in a value at (u, v).
std::array<float, 4> corner_shares(float u, float v) { return {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v}; }

/// Embree ends the program where a ray begins farther off.
bool is_within_reach(const Ray& ray) { return ray.origin.cwiseAbs().maxCoeff() < 1e18f; }

RTCRay embree_ray(const Ray& ray, float far) {
  return {ray.origin.x(), ray.origin.y(), ray.origin.z(), 0, ray.direction.x(), ray.direction.y(), ray.direction.z(), ray.time, far, ~0u, 0, 0};
}

}  // namespace

Vec3f Exposure::moved(const Vec3f& point, const Vec3f& velocity, float later) const {
  Vec3f there = point + later * velocity;
  for (int axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<float>(walls.lower[axis]), high = static_cast<float>(walls.upper[axis]), close = 1e-5f * (high - low);
    if (!(low < high)) continue;
    if (point[axis] < low + close || point[axis] > high - close) there[axis] = point[axis];
    else there[axis] = std::clamp(there[axis], low, high);
  }
  return there;
}

struct Geometry::Impl {
  /// What hits on a mesh of the frame read.
  struct Skin {
    std::vector<CornerNormals> normals;  // a quad's
    std::vector<Vec3f> velocities;       // [m/s] a vertex's
    std::vector<std::array<std::uint32_t, 4>> quads;

    /// Bilinear in the quad's own coordinates, so that its two triangles do not show.
    Vec3f smooth_normal(std::uint32_t quad, float u, float v) const {
      const CornerNormals& corner = normals[quad];
      const std::array<float, 4> share = corner_shares(u, v);
      Vec3f n = Vec3f::Zero();
      for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis) n[static_cast<int>(axis)] += share[k] * static_cast<float>(corner[k][axis]);
      return n / std::max(1.0f, n.norm());  // corners that cancel have no direction: 0
    }
  };

  /// The grains of one body.
  struct Cloud {
    std::vector<std::uint32_t> index;  // in the frame's arrays
    std::vector<std::uint8_t> shade;   // hash of the id
  };

  explicit Impl(const std::vector<Surface>& list, int count)
      : device(count), threads(count), surfaces(list), skins(list.size()), facets(list.size()), clouds(list.size()), scene(rtcNewScene(device.handle)) {
    first_body = static_cast<std::size_t>(std::find_if(list.begin(), list.end(), [](const Surface& s) { return s.is_body; }) - list.begin());
  }
  ~Impl() { rtcReleaseScene(scene); }

  void attach(RTCGeometry geometry, unsigned number);
  void clear_frame();
  void set_mesh(std::size_t number, const surface::Mesh&, const Exposure&);
  void set_grains(const Grains&, const Exposure&);
  void build(int slots);
  Vec3f tint(std::uint32_t surface, std::uint32_t grain) const;
  static void pass_through(const RTCFilterFunctionNArguments*);
  struct ShadowRay;

  Device device;
  int threads;
  std::vector<Surface> surfaces;
  std::size_t first_body = 0;
  std::vector<Skin> skins;             // by surface
  std::vector<std::vector<FacetNormals>> facets;   // likewise; of meshes that stay
  const Grains* grains = nullptr;
  std::vector<Cloud> clouds;           // by surface
  RTCScene scene;
  std::vector<unsigned> of_frame;      // surfaces that the next frame replaces
  Vec3f lower = Vec3f::Zero(), upper = Vec3f::Zero();  // bounds of all

  /// Whether the ray passes the bounds of all: most rays from the open ground do not, and need no traversal.
  bool near(const Ray& ray, float far) const {
    float enter = 0, leave = far;
    for (int axis = 0; axis < 3; ++axis) {
      const float inverse = 1 / ray.direction[axis], a = (lower[axis] - ray.origin[axis]) * inverse, b = (upper[axis] - ray.origin[axis]) * inverse;
      enter = std::max(enter, std::min(a, b));  // a NaN (a ray in a face's plane) leaves enter and leave as they are
      leave = std::min(leave, std::max(a, b));
    }
    return enter <= leave;
  }
};

/// A shadow ray on its way.
struct Geometry::Impl::ShadowRay {
  RTCIntersectContext embree;      // first: the filter gets its address
  Crossings* crossings = nullptr;  // dielectrics let it pass
};

void Geometry::Impl::attach(RTCGeometry geometry, unsigned number) {
  rtcSetGeometryUserData(geometry, this);
  if (surfaces[number].material.dielectric) rtcSetGeometryOccludedFilterFunction(geometry, &Impl::pass_through);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, number);
  rtcReleaseGeometry(geometry);
}

/// The facet's own normal is smooth enough for a shadow, and already here.
void Geometry::Impl::pass_through(const RTCFilterFunctionNArguments* call) {
  auto* way = reinterpret_cast<ShadowRay*>(call->context);
  if (way->crossings->count == Crossings::kMost) return;  // too long a way: blocked
  const auto* ray = reinterpret_cast<const RTCRay*>(call->ray);
  const auto* hit = reinterpret_cast<const RTCHit*>(call->hit);
  const Vec3f direction(ray->dir_x, ray->dir_y, ray->dir_z), geometric(hit->Ng_x, hit->Ng_y, hit->Ng_z);
  way->crossings->list[static_cast<std::size_t>(way->crossings->count++)] = {ray->tfar, direction.dot(geometric) / geometric.norm(),
                                                                             static_cast<int>(hit->geomID)};
  call->valid[0] = 0;
}

Geometry::Geometry(const std::vector<Surface>& surfaces, int threads) : impl_(std::make_unique<Impl>(surfaces, threads)) {
  Impl& m = *impl_;
  rtcSetSceneFlags(m.scene, RTC_SCENE_FLAG_ROBUST);
  for (std::size_t i = 1; i < surfaces.size(); ++i) {
    const std::vector<sim::Shape>& shapes = surfaces[i].shapes;
    if (surfaces[i].mesh) {
      m.facets[i] = corner_normals(*surfaces[i].mesh);
      m.attach(triangle_geometry(m.device.handle, *surfaces[i].mesh), static_cast<unsigned>(i));
    } else if (!shapes.empty()) {
      m.attach(shapes[0].box ? boxes_geometry(m.device.handle, shapes) : spheres_geometry(m.device.handle, shapes), static_cast<unsigned>(i));
    }
  }
  m.device.check("solids");
}

Geometry::~Geometry() = default;

void Geometry::Impl::clear_frame() {
  for (const unsigned number : of_frame) {
    rtcDetachGeometry(scene, number);
    skins[number] = {};
  }
  of_frame.clear();
}

void Geometry::Impl::set_mesh(std::size_t number, const surface::Mesh& mesh, const Exposure& exposure) {
  if (mesh.quads.empty()) return;
  skins[number] = {corner_normals(mesh), mesh.velocity, mesh.quads};
  attach(mesh_geometry(device.handle, mesh, exposure), static_cast<unsigned>(number));
  of_frame.push_back(static_cast<unsigned>(number));
}

void Geometry::Impl::set_grains(const Grains& given, const Exposure& exposure) {
  grains = &given;
  for (std::size_t number = first_body; number < surfaces.size(); ++number) clouds[number] = {};
  const std::size_t count = given.position.size();
  if (count == 0) return;
  if (count > std::numeric_limits<std::uint32_t>::max()) fail(std::to_string(count) + " grains are too many");
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t body = given.body.empty() ? 0 : given.body[i];
    const std::size_t number = std::min(first_body + body, surfaces.size() - 1);
    if (surfaces[number].grains) clouds[number].index.push_back(static_cast<std::uint32_t>(i));
  }
  for (std::size_t number = first_body; number < surfaces.size(); ++number) {
    Cloud& cloud = clouds[number];
    if (cloud.index.empty()) continue;
    cloud.shade.resize(cloud.index.size());
    base::parallel_chunks(cloud.index.size(), kGrainsATask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        cloud.shade[i] = static_cast<std::uint8_t>(sampling::mix(static_cast<std::uint64_t>(given.id[cloud.index[i]])));
    });
    const float radius = static_cast<float>(given.radius) * surfaces[number].grains->size;
    attach(grains_geometry(device.handle, given, cloud.index, radius, exposure), static_cast<unsigned>(number));
    of_frame.push_back(static_cast<unsigned>(number));
  }
}

/// Lighter or darker by the grain's hash, but never more light than fell on it.
Vec3f Geometry::Impl::tint(std::uint32_t surface, std::uint32_t grain) const {
  const Surface& s = surfaces[surface];
  const float shade = 1 + s.grains->variation * (static_cast<float>(clouds[surface].shade[grain]) / 127.5f - 1);
  return Vec3f::Constant(std::min(shade, 1 / std::max(1e-6f, s.material.color.maxCoeff())));
}

/// Slots that no worker may take are reserved: Embree cuts its work by slots, so the hierarchy is the same for any number of threads.
void Geometry::Impl::build(int slots) {
  tbb::task_arena builders(slots, static_cast<unsigned>(std::max(1, slots - (threads - 1))));
  builders.execute([&] { rtcJoinCommitScene(scene); });
  device.check("hierarchy");
  RTCBounds b;
  rtcGetSceneBounds(scene, &b);
  lower = Vec3f(b.lower_x, b.lower_y, b.lower_z);
  upper = Vec3f(b.upper_x, b.upper_y, b.upper_z);
  const Vec3f margin = Vec3f::Constant(1e-4f * (upper - lower).cwiseAbs().maxCoeff());  // more than round-off, and than an empty room's infinities
  lower -= margin;
  upper += margin;
}

void Geometry::set_frame(const surface::Mesh& mesh, const Grains& grains, const Exposure& exposure) {
  Impl& m = *impl_;
  m.clear_frame();
  m.set_mesh(0, mesh, exposure);
  m.set_grains(grains, exposure);
  m.build(grains.position.empty() ? 1 : kBuilders);
}

void Geometry::set_bodies(const std::vector<surface::Mesh>& meshes, const Grains& grains, const Exposure& exposure) {
  Impl& m = *impl_;
  assert(m.first_body + meshes.size() <= m.surfaces.size() && "a mesh belongs to a body");
  m.clear_frame();
  for (std::size_t body = 0; body < meshes.size(); ++body) m.set_mesh(m.first_body + body, meshes[body], exposure);
  m.set_grains(grains, exposure);
  m.build(grains.position.empty() ? 1 : kBuilders);
}

bool Geometry::intersect(const Ray& ray, float far, bool primary, Hit& result) const {
  const Impl& m = *impl_;
  if (!m.near(ray, far) || !is_within_reach(ray)) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (primary) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  RTCRayHit query;
  query.ray = embree_ray(ray, far);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(m.scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  result.t = query.ray.tfar;
  result.geometric = Vec3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).normalized();
  result.shading = result.geometric;
  if (const Impl::Skin& skin = m.skins[query.hit.geomID]; !skin.quads.empty()) {
    const Vec3f smooth = skin.smooth_normal(query.hit.primID, query.hit.u, query.hit.v);
    if (smooth.dot(result.geometric) > 0) result.shading = smooth;
  } else if (const auto& facets = m.facets[query.hit.geomID]; !facets.empty()) {
    const FacetNormals& corner = facets[query.hit.primID];
    const Vec3f smooth = (1 - query.hit.u - query.hit.v) * corner[0] + query.hit.u * corner[1] + query.hit.v * corner[2];
    if (smooth.dot(result.geometric) > 0) result.shading = smooth.normalized();
  }
  if (m.surfaces[query.hit.geomID].grains) result.tint = m.tint(query.hit.geomID, query.hit.primID);
  result.surface = static_cast<int>(query.hit.geomID);
  result.primitive = query.hit.primID;
  result.u = query.hit.u;
  result.v = query.hit.v;
  return true;
}

Vec3f Geometry::velocity(const Hit& hit, const Vec3f& place) const {
  const Impl& m = *impl_;
  const auto surface = static_cast<std::size_t>(hit.surface);
  if (m.surfaces[surface].grains) return m.grains->velocity[m.clouds[surface].index[hit.primitive]];
  const Impl::Skin& skin = m.skins[surface];
  if (skin.quads.empty()) return m.surfaces[surface].motion.at(place.cast<double>()).cast<float>();
  const std::array<float, 4> share = corner_shares(hit.u, hit.v);
  Vec3f v = Vec3f::Zero();
  for (std::size_t k = 0; k < 4; ++k) v += share[k] * skin.velocities[skin.quads[hit.primitive][k]];
  return v;
}

bool Geometry::straight(const Ray& ray, float far, Crossings& crossings) const {
  if (!impl_->near(ray, far) || !is_within_reach(ray)) return true;
  Impl::ShadowRay context;
  rtcInitIntersectContext(&context.embree);
  context.crossings = &crossings;
  RTCRay query = embree_ray(ray, far);
  rtcOccluded1(impl_->scene, &context.embree, &query);
  return query.tfar >= 0;
}

}  // namespace render::trace
