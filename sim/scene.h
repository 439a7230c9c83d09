#pragma once
// What is simulated: the keys of [sim], [[body]], [[source]], [[collider]] and [[effect]]. SI units; in two dimensions those of a slab one metre
// deep: z is 0 in every vector, and a density is still that of a cubic metre.
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "base/params.h"
#include "base/vec.h"
#include "sim/closed_mesh.h"
#include "sim/material.h"
#include "sim/mesh_distance.h"
#include "sim/motion.h"

namespace sim {

enum class Transfer { pic, flip, apic, polypic };
enum class Kernel { linear, quadratic };
/// How coefficients reach the next step: as they are, scaled so that no mode gains energy, or that only beside light nodes.
enum class Carry { fixed, limited, hybrid };
enum class Seeding { jitter, regular };
/// One projection a step, or two with a reflection between them.
enum class Splitting { lie, reflection };
/// How particles move in a step's field.
enum class Advection { rk2, rk3 };
enum class Precision { single_precision, double_precision };
/// What is at a side of the domain: a wall, as a Contact; the other side; or nothing, so that a liquid flows out into air.
enum class Side { slip, periodic, open, sticky, separating };
/// What a solid does at a wall, a collider or another body: sticks, slips without leaving it, or leaves it when pulled and rubs when pressed. The
/// looser, the later.
enum class Contact { sticky, slip, separating };

/// Numbers of cells fit in 64 bits, those along an axis in 32. Only the cells around particles are stored.
inline constexpr double kMostCells = 1e17, kMostCellsOfAnEdge = 1e9;
/// Particles are counted in 32 bits.
inline constexpr double kMostParticles = 4e9;

/// Where something is: exactly one of its members is set. A box without thickness along an axis goes on along it without end: in two
/// dimensions shapes are what they cut out of the plane.
struct Shape {
  struct Sphere {
    base::Vec3 center = base::Vec3::Zero();  // [m]
    double radius = 0.1;                     // [m]
  };
  /// What a closed mesh encloses; of bodies and colliders.
  struct Mesh {
    std::string file;                        // OBJ, PLY or STL
    double scale = 1;                        // [m] of one of the file's units
    base::Vec3 translate = base::Vec3::Zero();  // [m] after scaling
    // Where it is: a place p of the file, scaled and translated, is at turn p + shift.
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    base::Vec3 shift = base::Vec3::Zero();   // [m]
    base::Vec3 place_of(const base::Vec3& p) const { return turn * p + shift; }
    std::shared_ptr<const ClosedMesh> solid; // once the file is read; until then it holds nothing
    std::shared_ptr<const MeshDistance> distances;  // of a collider
  };
  std::optional<base::Box> box;
  std::optional<Eigen::Quaterniond> turn;      // of the box, about its middle
  std::optional<Sphere> sphere;
  std::optional<Mesh> mesh;
  /// A source `may_be_mesh` not.
  void params(base::Params&, bool may_be_mesh);
  bool any() const { return box || sphere || mesh; }
  /// A box, by `angle` [degrees] about `axis` through its middle, counter-clockwise seen from its tip; a mesh about its file's origin.
  void turn_by(double angle, const base::Vec3& axis);
  /// Signed distance [m], negative inside; `normal` (when given) gets the outward direction. Of a mesh as MeshDistance has it, or, of a body's,
  /// the sign alone and no normal.
  double distance(const base::Vec3& at, base::Vec3* normal = nullptr) const;
  struct Face {
    double depth = 0;                        // [m] of a place under it; below 0 outside
    base::Vec3 normal = base::Vec3::Zero();  // outward
  };
  /// Of a box: those across each of its axes, the lower one first. Of what has no end along an axis none is within reach.
  std::array<std::array<Face, 2>, 3> faces(const base::Vec3& at) const;
  base::Box bounds() const;
  /// Of a box [m]: corner i is the upper one along x, y and z where bits 0, 1 and 2 of i are set.
  std::array<base::Vec3, 8> corners() const;
};

struct Body {
  std::string name;
  Shape shape;
  std::string material = "water";            // preset
  double density = 1000;                     // [kg/m^3] of a liquid
  Material solid;                            // of a solid: what the preset says, changed by the shot
  base::Vec3 velocity = base::Vec3::Zero();  // [m/s] at t = 0
  base::Vec3 spin = base::Vec3::Zero();      // [rad/s] at t = 0, about the body's centre of mass; solids only
  std::string transfer, carry;               // of this body; empty: those of [sim]; solids only
  base::CountOrName modes;                   // likewise
  Contact contact = Contact::sticky;         // with other bodies, of which the looser contact counts; solids only
  double friction = 0;                       // [1] Coulomb's, of a separating contact; of two bodies the smaller
  std::string look;                          // empty: the look named as the material
  bool is_solid = false;                     // which keys it has: the scene's solver decides
  void params(base::Params&);
};

/// Where liquid pours in.
struct Source {
  std::string name;
  Shape shape;                               // cells with their middles in it are full of what it pours
  base::Vec3 velocity = base::Vec3::Zero();  // [m/s] of all of it; not 0
  std::optional<double> density;             // [kg/m^3]; unset: the bodies'
  double start = 0;                          // [s]
  std::optional<double> end;                 // [s]; unset: it never ends
  std::string look;                          // empty: the bodies', or that of water
  void params(base::Params&);
};

/// A solid; fluid slips along it.
struct Collider {
  std::string name;
  Shape shape;                               // at the first frame
  base::Vec3 velocity = base::Vec3::Zero();  // [m/s] while it moves
  base::Vec3 spin = base::Vec3::Zero();      // [rad/s] while it moves
  std::optional<base::Vec3> pivot = {};      // [m] at the first frame, of the spin; moves with `velocity`. Unset: the middle of the shape
  double start = 0;                          // [s]
  std::optional<double> end = {};            // [s]; unset: it never stops
  Contact contact = Contact::separating;     // of solids; fluids slip
  double friction = 0;                       // [1] Coulomb's, of a separating contact
  bool meets_solids = false;                 // which keys it has: the scene's solver decides
  std::string look = "plaster";
  void params(base::Params&);
  bool moves() const { return !velocity.isZero(0) || !spin.isZero(0); }
  base::Vec3 pivot_at_start() const;         // [m]
  RigidMotion motion() const;                // when it begins to move
  /// [m/s] that any of it has while it moves, at the most.
  double speed() const;
};

/// Something that acts on the material. Nothing acts unless it is named.
struct Effect {
  std::string kind = "gravity";
  base::Vec3 acceleration = base::Vec3(0, 0, -9.81);  // [m/s^2]; (0, -9.81) in two dimensions
  void params(base::Params&);
};

/// What particles carry in the points files beside place, velocity and id.
struct Write {
  bool pressure = false, strain = false, mode_energy = false;   // as in Frame
  void params(base::Params&, bool is_solid);
};

/// The keys of [sim].
struct Options {
  std::int64_t dimension = 3;
  std::string solver = "fluid";
  base::Box domain{base::Vec3(0, 0, 0), base::Vec3(1, 1, 1)};  // [m]
  double cell = 0.02;                                          // [m]
  std::array<std::array<Side, 2>, 3> boundary{};               // by axis: lower and upper side; periodic ones come in pairs
  std::int64_t particles_per_cell = 8;                         // 4 in two dimensions
  Transfer transfer = Transfer::polypic;
  Kernel kernel = Kernel::linear;
  base::CountOrName modes;                                     // unset: the full set of the kernel (polypic only)
  double cfl = 1;                                              // [1] cells a particle may cross in a sub-step; solids: 0.4
  double sound_cfl = 0.3;                                      // [1] cells that sound may cross in a sub-step; solids only
  double wall_friction = 0;                                    // [1] Coulomb's, of separating sides; solids only
  std::int64_t seed = 1;
  Seeding seeding = Seeding::jitter;
  std::optional<double> flip_time;                             // [s]
  double pressure_tolerance = 1e-6;                            // [1] relative residual
  Precision precision = Precision::single_precision;
  Splitting splitting = Splitting::lie;
  Advection advection = Advection::rk2;
  double volume_correction = 0.1;                              // [1] of its liquid's change in density that a step takes back; 0: none
  Carry carry = Carry::fixed;
  Write write;
  bool audit = false;                                          // sums what every pass adds to the energy: Totals::energy_changes
  bool is_solid() const { return solver == "solid"; }
  bool periodic(int axis) const { return boundary[std::size_t(axis)][0] == Side::periodic; }
  void params(base::Params&);
};

/// `options` with the transfer, modes and carry that a solid body has of its own. Tait's liquid has no shear to hold modes that bend: it takes the
/// multilinear ones in their place, unless it names its own.
Options with_scheme_of(const Body&, Options options);

/// A collider's shape after `time` [s]; one that has left through a periodic side is back at the other.
Shape shape_at(double time, const Collider&, const Options&);
/// How it moves from `time` [s] on, where shape_at says that it is.
RigidMotion motion_at(double time, const Collider&, const Options&);

Shape moved(Shape, const base::Vec3& by);   // [m]
Shape turned(Shape, const Eigen::Quaterniond&, const base::Vec3& about);

struct Image {
  Shape shape;
  base::Vec3 by = base::Vec3::Zero();        // [m] from what it is the image of
};
/// `shape` and, where it reaches across a periodic side of the domain, or comes nearer to it than `margin` [m], its images at the other side.
std::vector<Image> images_of(const Shape& shape, const Options&, double margin = 0);
std::vector<Shape> with_images(const Shape& shape, const Options&, double margin = 0);

struct Scene {
  Options options;
  std::vector<Body> bodies;
  std::vector<Source> sources;               // of liquids only
  std::vector<Collider> colliders;
  std::vector<Effect> effects;
  /// Visits [sim], [[body]], [[source]], [[collider]] and [[effect]], and checks what holds between them.
  void params(base::Params&);
};

/// [kg/m^3] of a fluid scene.
double liquid_density(const Scene&);

/// Gives colliders that are meshes distances for the cells and the domain that there are; they are not computed before a simulation asks. Meshes must
/// have been read.
void measure_meshes(Scene&);
/// The place of the first collider whose mesh has no distances for its cells (MeshDistance::objection).
std::optional<std::size_t> find_refused_mesh(const Scene&);

/// A collider that solids are to rub on, or stick to, and whose contact no node of the grid would find.
struct UnmetCollider {
  std::size_t number;      // from 0
  std::string key, need;   // what to say: "friction", of the collider, and what it needs
};
/// The first; of meshes only those whose distances are there.
std::optional<UnmetCollider> find_unmet_collider(const Scene&);

}  // namespace sim
