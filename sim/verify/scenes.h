#pragma once
// Scenes of the hard cases: solids without gravity and walls unless said, liquids in a tank.
#include <array>
#include <string>
#include <vector>

#include "sim/scene.h"
#include "sim/verify.h"

namespace sim::verify {

/// A plane or box of an elastic solid's, with periodic sides so that nothing touches a wall.
Scene open_scene(int dimension, double edge, double cell);
/// The same between separating walls.
Scene walled_scene(int dimension, double edge, double cell);
Body ball(const base::Vec3& center, double radius, const Material&);
Body block(const base::Vec3& lower, const base::Vec3& upper, const Material&);
/// A tank of water 1 m long and 0.5 m high; in three dimensions 0.2 m wide. z, in two dimensions y, is up; the water's box is given so: in two
/// dimensions its y is that of the plane.
Scene tank(int dimension, double cell, const base::Vec3& lower, const base::Vec3& upper);
/// A place in a tank: in 3-D the water's z is what y is in 2-D.
base::Vec3 upright(int dimension, double x, double height);
inline constexpr double kGravity = 9.81;   // [m/s^2]
void add_gravity(Scene&, double acceleration = kGravity);
Collider box_collider(const std::string& name, const base::Vec3& lower, const base::Vec3& upper, const base::Vec3& velocity = base::Vec3::Zero());
/// The same as a closed mesh of twelve triangles; measure_meshes is for the scene that it is in.
Collider mesh_collider(const std::string& name, const base::Vec3& lower, const base::Vec3& upper);
/// A closed mesh: what a loop of (r, z) [m] goes over that turns about an axis along z through `at`.
Collider turned_collider(const std::string& name, const std::vector<std::array<double, 2>>& loop, const base::Vec3& at);

/// What a case pairs with others. `modes` 0: the transfer's own, of PolyPIC all that the kernel has.
struct Scheme {
  Transfer transfer = Transfer::apic;
  std::int64_t modes = 0;
  Kernel kernel = Kernel::quadratic;
  Carry carry = Carry::fixed;
  Precision precision = Precision::double_precision;
  Splitting splitting = Splitting::lie;
};
inline constexpr auto kDouble = Precision::double_precision, kSingle = Precision::single_precision;
/// The rungs of --quality for a liquid.
inline constexpr Scheme kDraft{Transfer::apic, 0, Kernel::linear, Carry::fixed, kSingle, Splitting::lie},
    kNormal{Transfer::polypic, 0, Kernel::linear, Carry::fixed, kSingle, Splitting::lie},
    kHigh{Transfer::polypic, 0, Kernel::linear, Carry::fixed, kSingle, Splitting::reflection},
    kExtreme{Transfer::polypic, 0, Kernel::quadratic, Carry::hybrid, kSingle, Splitting::reflection};

void apply(const Scheme&, Options&);

/// Cases with their names and what they pair, all else to be filled in: "NAME/2d/polypic9/hybrid/double" of a solid,
/// "NAME/2d/polypic9/quadratic/hybrid/double" of a liquid, to which reflection is added, and "NAME/2d" of what is no simulation.
VerifyCase solid_case(const std::string& name, int dimension, const Scheme&);
VerifyCase liquid_case(const std::string& name, int dimension, const Scheme&);
VerifyCase law_case(const std::string& name, int dimension, const std::string& source);

}  // namespace sim::verify
