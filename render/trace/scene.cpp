#include "render/trace/scene.h"

#include <cmath>
#include <utility>

#include "base/error.h"
#include "render/view/view.h"

namespace render::trace {
namespace {

Model model_of(const std::string& name) {
  for (std::size_t i = 0; i < kModels.size(); ++i)
    if (kModels[i] == name) return static_cast<Model>(i);
  return Model::diffuse;
}

/// What the coat of a coated or translucent body keeps in.
void set_coat(Material& m) {
  m.albedo = coat_albedo(m.alpha, m.ior);
  m.inside = 1 - (1 - m.albedo.mean) / (m.ior * m.ior);
}

Material material_of(const Look& l) {
  Material m{.model = model_of(l.model), .color = l.color.cast<float>()};
  m.alpha = static_cast<float>(l.roughness * l.roughness);
  if (m.alpha < 1e-4f) m.alpha = 0;
  switch (m.model) {
    case Model::dielectric:
      m.dielectric = true;
      m.color = Vec3f::Ones();
      m.ior = static_cast<float>(l.ior);
      m.absorption = l.absorption.cast<float>();
      m.scattering = l.scattering.cast<float>();
      m.priority = static_cast<int>(l.priority);
      break;
    case Model::conductor:
      m.edge = l.edge.cast<float>();
      if (m.alpha > 0) m.albedo = mirror_albedo(m.alpha);
      break;
    case Model::coated:
      m.ior = static_cast<float>(l.coat);
      set_coat(m);
      break;
    case Model::translucent:
      m.ior = static_cast<float>(l.coat);
      set_coat(m);
      for (int c = 0; c < 3; ++c) m.scattering[c] = static_cast<float>(scattering_albedo(l.color[c]));
      m.extinction = static_cast<float>(1 / l.depth);
      break;
    case Model::emissive:
      m.radiance = (l.intensity * l.color).cast<float>();
      m.color = Vec3f::Zero();
      break;
    case Model::diffuse: break;
  }
  return m;
}

Material material_of(const Setting& setting, const std::string& look, const std::string& key) {
  const auto found = setting.looks.find(look);
  if (found == setting.looks.end()) {
    std::string names;
    for (const auto& entry : setting.looks) names += (names.empty() ? "" : ", ") + entry.first;
    throw base::Error({.key = key, .value = "\"" + look + "\"", .allowed = "must be one of " + names});
  }
  return material_of(found->second);
}

/// Ranks by priority; of equals, a collider displaces what is simulated, a solid body a liquid one, and the later surface an earlier one.
void rank_media(Scene& scene) {
  scene.rank.assign(scene.surfaces.size(), -1);
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i)
    if (scene.surfaces[i].material.dielectric) scene.surface_of.push_back(static_cast<int>(i));
  if (scene.surface_of.size() > Media::kMost)
    throw base::Error(
        {.message = std::to_string(scene.surface_of.size()) + " dielectric surfaces; at most " + std::to_string(Media::kMost) + " are told apart"});
  const auto priority = [&](int surface) { return scene.surfaces[static_cast<std::size_t>(surface)].material.priority; };
  const auto firmness = [&](int surface) {
    const Surface& s = scene.surfaces[static_cast<std::size_t>(surface)];
    if (surface != 0 && (!s.is_body || s.grains)) return 2;
    return s.is_body && !s.flows ? 1 : 0;
  };
  const auto rank = [&](int surface) { return std::pair(priority(surface), firmness(surface)); };
  std::stable_sort(scene.surface_of.begin(), scene.surface_of.end(), [&](int a, int b) { return rank(a) < rank(b); });
  for (std::size_t k = 0; k < scene.surface_of.size(); ++k) scene.rank[static_cast<std::size_t>(scene.surface_of[k])] = static_cast<int>(k);
}

void tabulate_rough_boundaries(Scene& scene) {
  std::vector<float> indices{1};
  for (const Surface& s : scene.surfaces)
    if (s.material.dielectric) indices.push_back(s.material.ior);
  for (const Surface& s : scene.surfaces) {
    if (!s.material.dielectric || s.material.alpha == 0) continue;
    for (const float a : indices)
      for (const float b : indices) {
        const auto same = [&](const RoughBoundary& r) { return r.alpha == s.material.alpha && (r.eta == b / a || r.eta == a / b); };
        if (a != b && std::none_of(scene.rough.begin(), scene.rough.end(), same)) scene.rough.push_back(make_rough_boundary(s.material.alpha, b / a));
      }
  }
}

/// Adds the axes of one box across which a face of it lies in the plane of a face of another that it touches.
void add_shared(const sim::Shape& a, const sim::Shape& b, double close, std::array<bool, 3>& shared) {
  if (!b.box) return;
  const base::Box one = a.bounds(), other = b.bounds();
  if (((one.lower - other.upper).array() > close).any() || ((other.lower - one.upper).array() > close).any()) return;
  const base::Vec3 middle = 0.5 * (b.box->lower + b.box->upper);
  for (const auto& sides : b.faces(middle))
    for (const sim::Shape::Face& face : sides) {
      const auto own = a.faces(middle + face.depth * face.normal);
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const sim::Shape::Face& f : own[axis])
          shared[axis] = shared[axis] || (std::abs(f.depth) < close && f.normal.cross(face.normal).norm() < 1e-6);
    }
}

/// Boxes of colliders that share a plane grow across it by a few offsets: a ray that leaves one for the other would start behind the other's face, and which
/// of two is seen would be left to rounding. Of two the opaque one grows more; of dielectrics the one of higher rank, which displaces the other.
void part_shared_planes(Scene& scene, std::size_t colliders) {
  constexpr int kSteps = 4;
  const double step = 3 * static_cast<double>(scene.least_offset);
  std::vector<std::pair<sim::Shape*, base::Vec3>> grown;
  for (std::size_t c = 1; c <= colliders; ++c)
    for (sim::Shape& shape : scene.surfaces[c].shapes) {
      if (!shape.box) continue;
      std::array<bool, 3> shared{};
      for (std::size_t k = 1; k <= colliders; ++k)
        for (const sim::Shape& other : scene.surfaces[k].shapes)
          if (k != c) add_shared(shape, other, step, shared);
      const double by = step * (scene.rank[c] >= 0 ? std::min(scene.rank[c], kSteps - 1) : kSteps + 0.3 * static_cast<double>(c % kSteps));
      grown.emplace_back(&shape, by * base::Vec3(shared[0], shared[1], shared[2]));
    }
  for (const auto& [shape, by] : grown) shape->box->lower -= by, shape->box->upper += by;
}

std::shared_ptr<const files::Triangles> placed(const SetPiece& piece) {
  auto mesh = std::make_shared<files::Triangles>(files::read_mesh(piece.file));
  for (std::size_t i = 0; i < mesh->position.size(); ++i) {
    mesh->position[i] = (piece.scale * mesh->position[i].cast<double>() + piece.translate).cast<float>();
    if (!mesh->position[i].allFinite())
      base::throw_input(piece.file.string(), "vertex " + std::to_string(i + 1) + " is not finite when scaled and translated");
  }
  return mesh;
}

/// A collider's mesh where it is, and its images.
std::shared_ptr<const files::Triangles> mesh_of(const std::vector<sim::Shape>& images) {
  auto mesh = std::make_shared<files::Triangles>();
  for (const sim::Shape& shape : images)
    for (std::size_t t = 0; t < shape.mesh->solid->triangles(); ++t) {
      const auto first = static_cast<std::uint32_t>(mesh->position.size());
      for (const base::Vec3& corner : shape.mesh->solid->triangle(t)) mesh->position.push_back(shape.mesh->place_of(corner).cast<float>());
      mesh->triangles.push_back({first, first + 1, first + 2});
    }
  return mesh;
}

/// A body as grains, as a mesh of its own, or, where there is one surface around all, as nothing.
Surface body_of(const Setting& setting, std::size_t body) {
  const std::string& name = body < setting.body_looks.size() ? setting.body_looks[body] : setting.liquid_look;
  const Material material = material_of(setting, name, "body.look");
  Surface surface;
  surface.is_body = true;
  surface.flows = body < setting.body_flows.size() && setting.body_flows[body];
  if (setting.is_grains(body)) {
    const Look& look = setting.looks.at(name);
    surface.grains = GrainStyle{static_cast<float>(look.grain_size), static_cast<float>(look.grain_variation)};
  }
  if (surface.grains || (setting.parts_bodies() && body < setting.body_looks.size())) surface.material = material;
  return surface;
}

Ground make_ground(const Setting& setting, float reach, const Vec3f& middle) {
  Ground ground{.material = material_of(setting, "ground", "look.ground"), .z = static_cast<float>(setting.domain.lower.z()),
                .middle = middle.head<2>(), .solid_to = 1.5f * reach, .gone_from = 4 * reach};
  if (setting.options.ground == "none") ground.form = Ground::Form::none;
  if (setting.options.ground == "cyclorama") {
    ground.form = Ground::Form::cyclorama;
    const view::View v = view::resolve(setting.camera, setting.domain, setting.options.width, setting.options.height);
    const Eigen::Vector2f ahead = v.forward.head<2>().cast<float>();
    if (ahead.norm() > 1e-3f) ground.back = ahead.normalized();
    ground.bend_from = 1.6f * reach;
    ground.bend = 1.2f * reach;
  }
  return ground;
}

}  // namespace

const RoughBoundary& Scene::rough_boundary(float alpha, float eta, bool& back) const {
  for (const RoughBoundary& r : rough) {
    if (r.alpha != alpha) continue;
    back = std::abs(r.eta * eta - 1) < std::abs(r.eta - eta);
    if (std::abs((back ? 1 / eta : eta) - r.eta) < 1e-5f * r.eta) return r;
  }
  return rough.front();  // every pair has been tabulated
}

namespace {

/// All but their meshes.
Scene make_surfaces(const Setting& setting) {
  Scene scene;
  scene.surfaces.push_back({.material = material_of(setting, setting.liquid_look, "body.look")});
  for (const sim::Collider& c : setting.colliders) {
    Surface& surface = scene.surfaces.emplace_back();
    surface.material = material_of(setting, c.look, "collider." + c.name + ".look");
    if (c.shape.any()) surface.shapes = {c.shape};
    surface.motion = c.motion();
  }
  for (const ColliderImage& image : setting.images) scene.surfaces[1 + image.collider].shapes.push_back(image.shape);
  for (const SetPiece& piece : setting.sets)
    scene.surfaces.push_back({.material = material_of(setting, piece.look, "set." + piece.name + ".look")});
  for (std::size_t body = 0; body <= setting.body_looks.size(); ++body) scene.surfaces.push_back(body_of(setting, body));
  rank_media(scene);
  return scene;
}

}  // namespace

Scene make_scene(const Setting& setting) {
  Scene scene = make_surfaces(setting);
  for (Surface& surface : scene.surfaces)
    if (!surface.shapes.empty() && surface.shapes.front().mesh) surface.mesh = mesh_of(surface.shapes);
  for (std::size_t i = 0; i < setting.sets.size(); ++i) scene.surfaces[1 + setting.colliders.size() + i].mesh = placed(setting.sets[i]);
  tabulate_rough_boundaries(scene);
  scene.lights = make_lights(setting.lights.empty() ? default_lights(setting.domain) : setting.lights, setting.folder);
  const float reach = static_cast<float>(0.5 * setting.domain.size().norm());
  const Vec3f middle = (0.5 * (setting.domain.lower + setting.domain.upper)).cast<float>();
  scene.ground = make_ground(setting, reach, middle);
  scene.bounces = static_cast<int>(setting.options.bounces);
  scene.caustics = setting.options.caustics == "path" ? Caustics::path : setting.options.caustics == "none" ? Caustics::none : Caustics::straight;
  scene.least_offset = 3.5e-5f * reach + 1e-6f * middle.cwiseAbs().maxCoeff();   // the latter for the rounding of places far from 0
  // What stands on the floor reaches below the ground that is seen: a ray that leaves its lower side would start behind the ground.
  scene.ground.z += 4 * scene.least_offset;
  part_shared_planes(scene, setting.colliders.size());
  return scene;
}

}  // namespace render::trace

namespace render {

void check_set_piece(const SetPiece& piece) { trace::placed(piece); }
void check_media(const Setting& setting) { trace::make_surfaces(setting); }

}  // namespace render
