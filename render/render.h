#pragma once
// Level set mesh, colliders, lights and camera -> image. Two renderers: a path tracer (Embree) and a quick point preview (OSMesa).
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/ledger.h"
#include "base/params.h"
#include "base/vec.h"
#include "sim/scene.h"
#include "surface/surface.h"

namespace render {

/// How a surface scatters light. [look.NAME]
struct Look {
  std::string model = "diffuse";                            // "diffuse" | "dielectric"
  base::Vec3 color = base::Vec3(0.7, 0.7, 0.7);             // albedo, scene-linear Rec.709
  double ior = 1.333;                                       // [1] dielectric
  base::Vec3 absorption = base::Vec3(0, 0, 0);              // [1/m] dielectric, per colour
  void params(base::Params&);
};
/// Looks by name: water, plaster ... The shot's [look.NAME] tables change or add.
std::map<std::string, Look> shipped_looks();

/// [camera]. What is unset is chosen so that the whole domain is in view.
struct Camera {
  std::optional<base::Vec3> position, target;               // [m]
  base::Vec3 up = base::Vec3(0, 0, 1);
  double fov = 35;                                          // [degrees] vertical
  void params(base::Params&);
};

/// [[light]].
struct Light {
  std::string kind = "area";                                // "area" | "sky" (| "sun")
  base::Vec3 position = base::Vec3(0, 0, 3), target = base::Vec3(0, 0, 0);  // [m] area: centre, and where it faces
  base::Vec3 size = base::Vec3(1, 1, 0);                    // [m] area: width, height
  base::Vec3 color = base::Vec3(1, 1, 1);
  double intensity = 1;                                     // area: radiance; sky: multiplier
  void params(base::Params&);
};

/// [render].
struct Options {
  std::int64_t width = 960, height = 540;
  std::int64_t spp = 16;                                    // samples a pixel
  std::int64_t bounces = 12;
  std::string caustics = "straight";                        // tinted straight shadow rays through dielectrics: biased, quiet
  std::string view = "filmic";                              // "filmic" | "srgb": PNG only
  double exposure = 0;                                      // [stops] PNG only
  void params(base::Params&);
};

/// All of the shot that pictures depend on.
struct Setting {
  Options options;
  Camera camera;
  std::vector<Light> lights;                                // none: a default sky and area light
  std::map<std::string, Look> looks = shipped_looks();
  std::vector<sim::Collider> colliders;                     // drawn with their looks
  std::string liquid_look = "water";
  base::Box domain;                                         // its floor is the ground
  /// Visits [render], [camera], [[light]] and [look.NAME].
  void params(base::Params&);
};

/// Linear RGBA and the other channels by EXR name, each width * height * (channels) floats, rows top-down.
struct Image {
  std::int64_t width = 0, height = 0;
  std::vector<std::string> channels;                        // "R", "G", "B", "A", "Z", "N.X" ...
  std::vector<float> pixels;                                // interleaved
};

/// What the file says of its own making; becomes polypic:* metadata.
struct Stamp {
  std::string shot, hash, version;
  std::int64_t frame = 1, spp = 0;
  double time = 0;
};

/// A scene that stays: colliders, lights and ground are built once, the liquid's mesh frame by frame.
class PathTracer {
 public:
  PathTracer(const Setting&, int threads);
  ~PathTracer();
  /// Same bits for any number of threads. Passes bvh and trace go to `ledger`.
  Image trace(const surface::Mesh&, std::int64_t frame, base::Ledger&);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Particles as points coloured by speed, with a colour bar and `caption`. Same bits for any number of threads.
Image preview(const Setting&, const sim::Frame&, const std::string& caption, double top_speed);

/// EXR: half for colour, float for the rest, metadata. Atomic.
void write_exr(const std::filesystem::path&, const Image&, const Stamp&, base::Ledger&);
/// 8-bit PNG through the view and exposure of `options`; a preview goes in as it is (`display_referred`). Atomic.
void write_png(const std::filesystem::path&, const Image&, const Options& options, bool display_referred, base::Ledger&);

struct ImageInfo {
  std::int64_t width = 0, height = 0;
  std::vector<std::string> channels;
  std::vector<std::array<std::string, 2>> metadata;
};
ImageInfo info(const std::filesystem::path&);

}  // namespace render
