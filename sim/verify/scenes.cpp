#include "sim/verify/scenes.h"

#include <cmath>
#include <memory>
#include <vector>

#include "sim/transfer/modes.h"

namespace sim::verify {

Scene open_scene(int dimension, double edge, double cell) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = dimension;
  o.solver = "solid";
  o.domain = {base::Vec3::Zero(), base::Vec3(edge, edge, dimension == 3 ? edge : 0)};
  o.cell = cell;
  o.particles_per_cell = dimension == 3 ? 8 : 4;
  o.kernel = Kernel::quadratic;
  o.carry = Carry::hybrid;
  o.cfl = 0.4;
  for (auto& sides : o.boundary) sides = {Side::periodic, Side::periodic};
  o.precision = Precision::double_precision;
  return scene;
}

Scene walled_scene(int dimension, double edge, double cell) {
  Scene scene = open_scene(dimension, edge, cell);
  for (auto& sides : scene.options.boundary) sides = {Side::separating, Side::separating};
  return scene;
}

Body ball(const base::Vec3& center, double radius, const Material& material) {
  Body body;
  body.name = "ball";
  body.shape.sphere = {center, radius};
  body.solid = material;
  body.is_solid = true;
  return body;
}

Body block(const base::Vec3& lower, const base::Vec3& upper, const Material& material) {
  Body body;
  body.name = "block";
  body.shape.box = {lower, upper};
  body.solid = material;
  body.is_solid = true;
  return body;
}

base::Vec3 upright(int dimension, double x, double height) { return dimension == 2 ? base::Vec3(x, height, 0) : base::Vec3(x, 0.2, height); }

Scene tank(int dimension, double cell, const base::Vec3& lower, const base::Vec3& upper) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = dimension;
  o.domain = {base::Vec3::Zero(), dimension == 2 ? base::Vec3(1, 0.5, 0) : base::Vec3(1, 0.2, 0.5)};
  o.cell = cell;
  o.particles_per_cell = dimension == 2 ? 4 : 8;
  Body water;
  water.name = "water";
  water.shape.box = base::Box{lower, upper};
  scene.bodies = {water};
  return scene;
}

void add_gravity(Scene& scene, double acceleration) {
  Effect gravity;
  gravity.acceleration = scene.options.dimension == 2 ? base::Vec3(0, -acceleration, 0) : base::Vec3(0, 0, -acceleration);
  scene.effects.push_back(gravity);
}

Collider box_collider(const std::string& name, const base::Vec3& lower, const base::Vec3& upper, const base::Vec3& velocity) {
  Collider c;
  c.name = name;
  c.shape.box = base::Box{lower, upper};
  c.velocity = velocity;
  return c;
}

Collider mesh_collider(const std::string& name, const base::Vec3& lower, const base::Vec3& upper) {
  std::vector<base::Vec3f> corners;
  for (int k = 0; k < 8; ++k) corners.emplace_back(base::Vec3(k & 1 ? upper.x() : lower.x(), k & 2 ? upper.y() : lower.y(), k & 4 ? upper.z() : lower.z()).cast<float>());
  const std::vector<ClosedMesh::Triangle> triangles{{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  Collider c;
  c.name = name;
  c.shape.mesh = Shape::Mesh{};
  c.shape.mesh->solid = std::make_shared<const ClosedMesh>(corners, triangles, 1, base::Vec3::Zero());
  return c;
}

Collider turned_collider(const std::string& name, const std::vector<std::array<double, 2>>& loop, const base::Vec3& at) {
  constexpr std::uint32_t kAround = 48;
  std::vector<base::Vec3f> corners;
  std::vector<ClosedMesh::Triangle> triangles;
  const auto size = std::uint32_t(loop.size());
  for (std::uint32_t k = 0; k < size; ++k)
    for (std::uint32_t n = 0; n < kAround; ++n) {
      const double angle = 2 * M_PI * n / kAround;
      corners.push_back(base::Vec3(loop[k][0] * std::cos(angle), loop[k][0] * std::sin(angle), loop[k][1]).cast<float>());
      const std::uint32_t next = (n + 1) % kAround, above = (k + 1) % size * kAround;
      triangles.push_back({k * kAround + n, k * kAround + next, above + next});
      triangles.push_back({k * kAround + n, above + next, above + n});
    }
  Collider c;
  c.name = name;
  c.shape.mesh = Shape::Mesh{};
  c.shape.mesh->solid = std::make_shared<const ClosedMesh>(corners, triangles, 1, at);
  return c;
}

void apply(const Scheme& s, Options& o) {
  o.transfer = s.transfer, o.kernel = s.kernel, o.carry = s.carry, o.precision = s.precision, o.splitting = s.splitting;
  o.modes = {};
  if (s.transfer == Transfer::polypic) o.modes.count = s.modes;
}

namespace {

std::string transfer_text(const Scheme& s, int dimension) {
  if (s.transfer == Transfer::pic) return "pic";
  if (s.transfer == Transfer::flip) return "flip";
  if (s.transfer == Transfer::apic) return "apic";
  const base::CountOrName modes{s.modes, {}};
  const std::size_t count = dimension == 2 ? mode_set<2>(s.transfer, s.kernel, modes).size() : mode_set<3>(s.transfer, s.kernel, modes).size();
  return "polypic" + std::to_string(count);
}

VerifyCase scheme_case(const std::string& name, int dimension, const Scheme& s, bool is_solid) {
  VerifyCase c;
  c.dimension = dimension;
  c.transfer = transfer_text(s, dimension), c.kernel = s.kernel == Kernel::linear ? "linear" : "quadratic";
  c.integrator = is_solid ? "explicit" : s.splitting == Splitting::lie ? "lie" : "reflection";
  c.name = name + "/" + std::to_string(dimension) + "d/" + c.transfer;
  if (!is_solid) c.name += "/" + c.kernel;
  if (s.transfer == Transfer::polypic && s.kernel == Kernel::quadratic)
    c.name += s.carry == Carry::fixed ? "/fixed" : s.carry == Carry::limited ? "/limited" : "/hybrid";
  if (s.splitting == Splitting::reflection) c.name += "/reflection";
  c.name += s.precision == kDouble ? "/double" : "/single";
  return c;
}

}  // namespace

VerifyCase solid_case(const std::string& name, int dimension, const Scheme& s) { return scheme_case(name, dimension, s, true); }
VerifyCase liquid_case(const std::string& name, int dimension, const Scheme& s) { return scheme_case(name, dimension, s, false); }

VerifyCase law_case(const std::string& name, int dimension, const std::string& source) {
  VerifyCase c;
  c.name = name + "/" + std::to_string(dimension) + "d";
  c.dimension = dimension;
  c.transfer = c.kernel = c.integrator = "any";
  c.source = source;
  return c;
}

}  // namespace sim::verify
