// Shapes, of bodies, sources and colliders (sim/scene.h): keys, distances, corners, where they are at a time and their images.
#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/scene.h"

namespace sim {

void Shape::params(base::Params& p, bool may_be_mesh) {
  p("box", box, "m", "two opposite corners of a box", "not a box");
  double angle = 0;
  std::optional<base::Vec3> axis;
  Sphere round = sphere.value_or(Sphere{});
  const bool is_sphere = p.table("sphere", "a ball", [&](base::Params& q) {
    q("center", round.center, "m", "centre of the sphere");
    q("radius", round.radius, "m", "radius of the sphere", base::above(0));
  });
  if (is_sphere) sphere = round;
  if (may_be_mesh && !p.when(p.vector_size() == 3)) {
    may_be_mesh = false;
    p.without("mesh", "is a solid of three dimensions");
  }
  Mesh made = mesh.value_or(Mesh{});
  const bool is_mesh = may_be_mesh && p.table("mesh", "what a closed mesh encloses", [&](base::Params& q) {
    q("file", made.file, "OBJ, PLY or STL, z up; relative to the shot");
    q("scale", made.scale, "m", "length of one of the file's units", base::above(0));
    q("translate", made.translate, "m", "where the file's origin is");
  });
  if (is_mesh) {
    mesh = made;
    p.require(!made.file.empty(), "mesh", "needs a file");
  }
  p.where(box || mesh, "a box or a mesh", [&] {
    p("angle", angle, "degrees", "turn of a box about its middle, of a mesh about its file's origin", base::within(-360, 360));
    p.where(p.vector_size() == 3, "sim.dimension = 3",
            [&] { p("axis", axis, "1", "direction about which it is turned, counter-clockwise seen from its tip", "[0, 0, 1]"); });
    p.require(!axis || axis->norm() > 1e-9, "axis", "must not be zero");
    p.require(!axis || angle != 0, "axis", "turns nothing without an angle");
    turn_by(angle, axis.value_or(base::Vec3::UnitZ()));
  });
  p.require(box.has_value() + sphere.has_value() + mesh.has_value() == 1, "",
            may_be_mesh ? "needs exactly one of box, sphere and mesh" : "needs exactly one of box and sphere");
  if (box) p.require((box->size().head(p.vector_size()).array() > 0).all(), "box", "the second corner must be above the first in every axis");
}

void Shape::turn_by(double angle, const base::Vec3& axis) {
  turn.reset();
  if (mesh) mesh->turn.setIdentity(), mesh->shift.setZero();
  if (angle == 0 || axis.norm() == 0) return;
  const Eigen::Quaterniond by(Eigen::AngleAxisd(angle * M_PI / 180, axis.normalized()));
  if (box) turn = by;
  if (mesh) mesh->turn = by, mesh->shift = mesh->translate - by * mesh->translate;
}

double Shape::distance(const base::Vec3& at, base::Vec3* normal) const {
  if (turn) {
    Shape straight;
    straight.box = box;
    const base::Vec3 middle = 0.5 * (box->lower + box->upper);
    const double far = straight.distance(middle + turn->conjugate() * (at - middle), normal);
    if (normal) *normal = *turn * *normal;
    return far;
  }
  if (mesh) {
    const base::Vec3 in_file = mesh->turn.conjugate() * (at - mesh->shift);
    if (!mesh->distances) return mesh->solid && mesh->solid->inside(in_file) ? -1 : 1;
    const double far = mesh->distances->distance(in_file, normal);
    if (normal) *normal = mesh->turn * *normal;
    return far;
  }
  if (sphere) {
    const base::Vec3 from_center = at - sphere->center;
    const double r = from_center.norm();
    if (normal) *normal = r > 0 ? base::Vec3(from_center / r) : base::Vec3::UnitY();
    return r - sphere->radius;
  }
  base::Vec3 below = box->lower - at, over = at - box->upper;
  for (int a = 0; a < 3; ++a)
    if (box->lower[a] == box->upper[a]) below[a] = over[a] = -std::numeric_limits<double>::infinity();
  const base::Vec3 outside = below.cwiseMax(over);
  int axis = 0;
  const double inside = outside.maxCoeff(&axis);
  if (inside <= 0) {
    if (normal) *normal = (below[axis] > over[axis] ? -1.0 : 1.0) * base::Vec3::Unit(axis);
    return inside;
  }
  const base::Vec3 gap = outside.cwiseMax(0.0);
  const double d = gap.norm();
  if (normal)
    for (int a = 0; a < 3; ++a) (*normal)[a] = (below[a] > over[a] ? -1.0 : 1.0) * gap[a] / d;
  return d;
}

std::array<std::array<Shape::Face, 2>, 3> Shape::faces(const base::Vec3& at) const {
  const base::Vec3 middle = 0.5 * (box->lower + box->upper), straight = turn ? base::Vec3(middle + turn->conjugate() * (at - middle)) : at;
  std::array<std::array<Face, 2>, 3> faces;
  for (int a = 0; a < 3; ++a) {
    const bool ends = box->lower[a] < box->upper[a];
    const base::Vec3 outward = turn ? base::Vec3(*turn * base::Vec3::Unit(a)) : base::Vec3::Unit(a);
    for (const int side : {0, 1}) {
      Face& face = faces[std::size_t(a)][std::size_t(side)];
      face.depth = !ends ? std::numeric_limits<double>::infinity() : side ? box->upper[a] - straight[a] : straight[a] - box->lower[a];
      face.normal = side ? outward : base::Vec3(-outward);
    }
  }
  return faces;
}

std::array<base::Vec3, 8> Shape::corners() const {
  std::array<base::Vec3, 8> places;
  const base::Vec3 middle = 0.5 * (box->lower + box->upper);
  for (std::size_t i = 0; i < 8; ++i) {
    base::Vec3& p = places[i];
    p = base::Vec3((i & 1 ? box->upper : box->lower).x(), (i & 2 ? box->upper : box->lower).y(), (i & 4 ? box->upper : box->lower).z());
    if (turn) p = middle + *turn * (p - middle);
  }
  return places;
}

base::Box Shape::bounds() const {
  if (box && turn) {   // half its extent along an axis: what its three half edges reach along it
    const base::Vec3 middle = 0.5 * (box->lower + box->upper), reach = turn->toRotationMatrix().cwiseAbs() * (0.5 * box->size());
    return {middle - reach, middle + reach};
  }
  if (box) return *box;
  if (mesh && !mesh->solid) return base::Box{mesh->shift, mesh->shift};
  if (mesh) {   // of the box around it in its file, turned
    const base::Box& own = mesh->solid->bounds();
    if (mesh->turn.vec().isZero(0)) return {own.lower + mesh->shift, own.upper + mesh->shift};
    const base::Vec3 middle = mesh->place_of(0.5 * (own.lower + own.upper)), reach = mesh->turn.toRotationMatrix().cwiseAbs() * (0.5 * own.size());
    return {middle - reach, middle + reach};
  }
  const base::Vec3 r = base::Vec3::Constant(sphere->radius);
  return {sphere->center - r, sphere->center + r};
}

Shape moved(Shape shape, const base::Vec3& by) {
  if (shape.box) shape.box = base::Box{shape.box->lower + by, shape.box->upper + by};
  if (shape.sphere) shape.sphere->center += by;
  if (shape.mesh) shape.mesh->shift += by;
  return shape;
}

Shape turned(Shape shape, const Eigen::Quaterniond& by, const base::Vec3& about) {
  const auto place = [&](const base::Vec3& at) { return base::Vec3(about + by * (at - about)); };
  if (shape.box) {
    const base::Vec3 middle = 0.5 * (shape.box->lower + shape.box->upper), to = place(middle) - middle;
    shape.box = base::Box{shape.box->lower + to, shape.box->upper + to};
    shape.turn = by * shape.turn.value_or(Eigen::Quaterniond::Identity());
  }
  if (shape.sphere) shape.sphere->center = place(shape.sphere->center);
  if (shape.mesh) shape.mesh->turn = by * shape.mesh->turn, shape.mesh->shift = place(shape.mesh->shift);
  return shape;
}

base::Vec3 Collider::pivot_at_start() const { return pivot ? *pivot : 0.5 * (shape.bounds().lower + shape.bounds().upper); }

RigidMotion Collider::motion() const { return {velocity, spin, spin.isZero(0) ? base::Vec3(base::Vec3::Zero()) : pivot_at_start()}; }

namespace {

/// [s] that the collider has moved for.
double time_of_motion(double time, const Collider& c) { return std::max(0.0, (c.end ? std::min(time, *c.end) : time) - c.start); }

/// How far its pivot has come, less what leads through periodic sides.
base::Vec3 way_of(double time, const Collider& collider, const Options& o) {
  base::Vec3 by = time_of_motion(time, collider) * collider.velocity;
  for (int a = 0; a < o.dimension; ++a)
    if (o.periodic(a)) by[a] = std::remainder(by[a], o.domain.size()[a]);
  return by;
}

}  // namespace

double Collider::speed() const {
  if (spin.isZero(0)) return velocity.norm();
  const base::Vec3 middle = pivot_at_start();
  double most = 0;
  const auto see = [&](const base::Vec3& at) { most = std::max(most, spin.cross(at - middle).norm()); };
  if (shape.sphere) see(shape.sphere->center), most += spin.norm() * shape.sphere->radius;
  if (shape.box)
    for (const base::Vec3& corner : shape.corners()) see(corner);
  if (shape.mesh && shape.mesh->solid)
    for (std::size_t t = 0; t < shape.mesh->solid->triangles(); ++t)
      for (const base::Vec3& corner : shape.mesh->solid->triangle(t)) see(shape.mesh->place_of(corner));
  return velocity.norm() + most;
}

Shape shape_at(double time, const Collider& collider, const Options& o) {
  Shape shape = collider.shape;
  const base::Vec3 turn = time_of_motion(time, collider) * collider.spin;   // [rad]
  if (!turn.isZero(0)) shape = turned(shape, Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())), collider.pivot_at_start());
  return moved(shape, way_of(time, collider, o));
}

RigidMotion motion_at(double time, const Collider& collider, const Options& o) {
  const double rounding = 1e-12 * std::abs(time);   // a step that ends when the motion does ends within this
  if (time + rounding < collider.start || (collider.end && time + rounding >= *collider.end)) return {};
  return collider.motion().moved(way_of(time, collider, o));
}

std::vector<Shape> with_images(const Shape& shape, const Options& o, double margin) {
  std::vector<Shape> shapes;
  for (Image& image : images_of(shape, o, margin)) shapes.push_back(std::move(image.shape));
  return shapes;
}

std::vector<Image> images_of(const Shape& shape, const Options& o, double margin) {
  std::vector<Image> images{{shape}};
  for (int a = 0; a < o.dimension; ++a) {
    if (!o.periodic(a)) continue;
    const base::Box all = shape.bounds();   // a box that goes on beyond both sides has no end that an image could show
    if (shape.box && !shape.turn && all.lower[a] < o.domain.lower[a] - margin && all.upper[a] > o.domain.upper[a] + margin) continue;
    const base::Vec3 across = base::Vec3::Unit(a) * o.domain.size()[a];
    for (std::size_t i = 0, n = images.size(); i < n; ++i) {
      const Image image = images[i];
      const base::Box bounds = image.shape.bounds();
      if (bounds.lower[a] < o.domain.lower[a] + margin) images.push_back({moved(image.shape, across), image.by + across});
      if (bounds.upper[a] > o.domain.upper[a] - margin) images.push_back({moved(image.shape, -across), image.by - across});
    }
  }
  return images;
}

}  // namespace sim
