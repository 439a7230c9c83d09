#pragma once
// Level set mesh, colliders, lights and camera -> image. Two renderers: a path tracer (Embree) and a quick point preview (OSMesa).
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/differences.h"
#include "base/ledger.h"
#include "base/params.h"
#include "base/vec.h"
#include "sim/frame.h"
#include "sim/scene.h"
#include "surface/surface.h"

namespace render {

/// How a surface scatters light. [look.NAME]; docs/pictures.md says which keys a model has.
struct Look {
  std::string model = "diffuse";                            // "diffuse" | "dielectric" | "conductor" | "coated" | "translucent" | "emissive"
  base::Vec3 color = base::Vec3(0.7, 0.7, 0.7);             // scene-linear Rec.709. albedo; conductor: reflectance straight on; emissive: radiance
  double roughness = 0;                                     // [1] root of the facets' rms slope; dielectric, conductor, coated, translucent
  double ior = 1.333;                                       // [1] dielectric
  base::Vec3 absorption = base::Vec3(0, 0, 0);              // [1/m] dielectric
  base::Vec3 scattering = base::Vec3(0, 0, 0);              // [1/m] dielectric
  std::int64_t priority = 0;                                // dielectric: of two that overlap the higher one is there
  base::Vec3 edge = base::Vec3(1, 1, 1);                    // [1] conductor: tint at 82 degrees
  double coat = 1.5;                                        // [1] index of refraction of the coat: coated, translucent
  double depth = 0.002;                                     // [m] translucent: mean free path
  double intensity = 1;                                     // [1] emissive
  std::string draw = "surface";                             // "surface": what the surface stage made of the body | "grains": every particle a ball
  double grain_size = 1;                                    // [1] of a grain, in particle radii
  double grain_variation = 0.25;                            // [1] share by which grains are lighter or darker than color
  void params(base::Params&);
};
/// Looks by name, in one table; "ground" is the floor's. The shot's [look.NAME] tables change or add.
std::map<std::string, Look> shipped_looks();

/// [[set]]: geometry from a file that is drawn and nothing else: the simulation does not meet it.
struct SetPiece {
  std::string name;
  std::filesystem::path file;                               // OBJ, PLY or STL; z is up
  double scale = 1;                                         // [m] of one of the file's units
  base::Vec3 translate = base::Vec3::Zero();                // [m] after scaling
  std::string look = "plaster";
  void params(base::Params&);
};

/// [[camera.key]]: the camera at one frame. Each quantity runs smoothly through the keys that name it, and rests before the first
/// and after the last of them.
struct CameraKey {
  double frame = 1;
  std::optional<base::Vec3> position = {}, target = {};              // [m]
  std::optional<double> fov = {}, focus = {};                        // [degrees], [m]
  void params(base::Params&);
};

/// camera.turntable: the camera circles its target about `up`, from its position at frame 1.
struct Turntable {
  double revolutions = 1;                                   // [1] counter-clockwise seen from above
  double frames = 96;                                       // that they take
  void params(base::Params&);
};

/// [camera]. What is unset is chosen so that the whole domain is in view, seen three-quarter from the front and above.
struct Camera {
  std::optional<base::Vec3> position = {}, target = {};               // [m]
  base::Vec3 up = base::Vec3(0, 0, 1);
  std::optional<double> fov = {};                           // [degrees] vertical; unset: 35
  double shutter = 0.5;                                     // [1] share of a frame's time that it is exposed for, centred on its moment
  std::optional<double> aperture = {};                      // [1] f-number; unset: a pinhole, all is sharp
  std::optional<double> focus = {};                         // [m] along the line of sight; unset: the target's
  double sensor = 0.024;                                    // [m] height of the film behind the lens
  std::vector<CameraKey> keys = {};
  std::optional<Turntable> turntable = {};
  void params(base::Params&);
};

/// [[light]]. Lights that a shot names replace the default ones: a shot that names no sky has a black one.
struct Light {
  std::string kind = "area";                                // "area": a rectangle that shines to one side | "sphere" | "sun" | "sky": gradient
                                                            // "environment": a picture all around. None of them blocks anything
  base::Vec3 position = base::Vec3(0, 0, 3), target = base::Vec3(0, 0, 0);  // [m] area, sphere: middle; area: what it faces
  double width = 1, height = 1;                             // [m] area
  double radius = 0.1;                                      // [m] sphere
  base::Vec3 direction = base::Vec3(0.4, 0.5, -0.8);        // sun: the way its light goes
  double angle = 0.53;                                      // [degrees] sun: angular diameter
  base::Vec3 color = base::Vec3(1, 1, 1);                   // sky: at the zenith
  base::Vec3 horizon = base::Vec3(1, 1, 1);                 // sky: at and below the horizon
  std::string file = {};                                    // environment: relative to the shot
  double rotation = 0;                                      // [degrees] environment
  double intensity = 1;                                     // [1] radiance that color is multiplied with; sun: irradiance / pi
  void params(base::Params&);
};
/// A soft sky and one warm area light from the upper side, in proportion to the domain.
std::vector<Light> default_lights(const base::Box& domain);

/// [render].
struct Options {
  std::int64_t width = 960, height = 540;
  std::int64_t spp = 16;                                    // samples a pixel
  std::int64_t bounces = 32;                                // surfaces a path may meet; among dielectrics it then ends in the sky
  std::string caustics = "straight";                        // "straight": tinted straight shadow rays through dielectrics, biased and quiet
                                                            // "path": none of that; light behind dielectrics is found by chance, unbiased and noisy
                                                            // "none": that light is left out
  std::string ground = "floor";                             // "floor" | "cyclorama" | "none"
  std::optional<double> noise = {};                         // [1] relative error at which a tile stops; unset: all pixels get spp samples
  std::optional<double> time_limit = {};                    // [s] a frame; unset: none
  std::string denoise = "none";                             // "layer": EXR channels denoised.RGB | "picture": the PNG shows them, too
  std::string view = "filmic";                              // "filmic" | "srgb": PNG only
  double exposure = 0;                                      // [stops] PNG only
  void params(base::Params&);
};

/// [preview]: what --preview and the pictures of two-dimensional shots show.
struct Preview {
  std::string color = "speed";                              // one of attribute::kNames
  std::optional<double> range = {};                         // of the colour bar, in the colour's unit; unset: one for the shot
  std::string draw = "points";                              // "points" | "surface"
  void params(base::Params&);
};

/// Where a collider, by its place in the list, is drawn once more.
struct ColliderImage {
  std::size_t collider;
  sim::Shape shape;
  base::Vec3 by = base::Vec3::Zero();   // [m] from the collider
};

/// All of the shot that pictures depend on.
struct Setting {
  Options options;
  Preview preview;
  Camera camera;
  std::vector<Light> lights;                                // none: a default sky and area light
  std::map<std::string, Look> looks = shipped_looks();
  std::vector<sim::Collider> colliders;                     // drawn with their looks
  std::vector<ColliderImage> images;                        // and across periodic sides
  std::vector<SetPiece> sets;
  std::string liquid_look = "water";
  std::vector<std::string> body_looks;                      // of solids, by body; bodies beyond have liquid_look
  std::vector<bool> body_flows;                             // liquids among these: what stands in one displaces it
  bool shows_tension = false;                               // pressures may be below 0: those of solids
  std::vector<std::string> materials;                       // by body, as a preview's legend calls them
  double fps = 24;                                          // [1/s]
  base::Box domain;                                         // its floor is the ground
  std::filesystem::path folder;                             // of the shot: where its files are
  std::int64_t dimension = 3;                               // 2: the plane z = 0, y up, drawn flat
  /// Files that lights and set pieces name: what they hold is part of the render stage's input.
  std::vector<std::filesystem::path> files() const;
  /// Visits [render], [preview], [camera], [[light]], [[set]] and [look.NAME].
  void params(base::Params&);
  /// What trace() needs of a frame: a mesh where some body is drawn as a surface, grains where some body is drawn as grains.
  bool draws_surface() const;
  bool draws_grains() const;
  bool is_grains(std::size_t body) const;
  /// Whether each body is drawn with a surface of its own, or as grains: where bodies differ in their looks, and not all are grains.
  bool parts_bodies() const;
};

/// Particles drawn as they are: balls with the look of their body, each a little lighter or darker by its id. All arrays have the
/// same length; `body` may be empty: all belong to the first.
struct Grains {
  std::vector<base::Vec3f> position, velocity;              // [m], [m/s]
  std::vector<std::int64_t> id;
  std::vector<std::uint16_t> body;                          // number of the shot's body, from 0
  double radius = 0;                                        // [m]
};
/// All particles of a frame.
Grains grains_of(sim::Frame);

/// Scene-linear Rec.709 RGBA and what the first hits say, by EXR name; rows top-down, channels of a pixel side by side.
/// The path tracer gives R G B A albedo.R albedo.G albedo.B N.X N.Y N.Z (world) Z (metres along the view axis, the nearest of the
/// samples, 0 where there is only sky) motion.X motion.Y (pixels a frame, to the right and up) id (of that nearest hit: 0 sky, 1 the
/// ground, 2 the liquid or the solids around which there is one surface, then the colliders, the set, the bodies drawn as grains or with
/// surfaces of their own) samples, and denoised.R denoised.G denoised.B where options.denoise asks for them. The preview gives R G B A as displayed.
struct Image {
  std::int64_t width = 0, height = 0;
  std::vector<std::string> channels;                        // "R", "G", "B", "A", "Z", "N.X" ...
  std::vector<float> pixels;                                // interleaved
  bool reproducible = true;                                 // false when options.time_limit cut it short
};

/// What the file says of its own making; becomes polypic:* metadata.
struct Stamp {
  std::string shot, hash, version;
  std::int64_t frame = 1, spp = 0;
  double time = 0;
  bool reproducible = true;                                 // of the image
};

/// A scene that stays: colliders, lights and ground are built once, the liquid's mesh frame by frame.
class PathTracer {
 public:
  /// Throws base::Error (exit 2) when a collider or the liquid names a look that is not there, or a light or a set piece a file that cannot be read.
  PathTracer(const Setting&, int threads);
  ~PathTracer();
  /// Same bits for any number of threads. Passes bvh, trace and denoise go to `ledger`. No sample is clamped; one that is not finite
  /// throws base::Error (exit 1) naming the pixel.
  Image trace(const surface::Mesh&, std::int64_t frame, base::Ledger&);
  /// With particles among it. 10 million take 1.5 GB.
  Image trace(const surface::Mesh&, const Grains&, std::int64_t frame, base::Ledger&);
  /// Where setting.parts_bodies(): a mesh a body, none of those drawn as grains.
  Image trace_bodies(const std::vector<surface::Mesh>&, const Grains&, std::int64_t frame, base::Ledger&);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Particles as points, or their surface, coloured as setting.preview says, with axes in metres, a colour bar and `caption`. `top_speed` [m/s]
/// bounds the colour bar, the same for all frames of a shot. What has no room is left out: labels of axes that would touch others, the last parts of
/// the caption (two blanks part them). Same bits for any number of threads.
Image preview(const Setting&, const sim::Frame&, const std::string& caption, double top_speed);
Image preview(const Setting&, const sim::Frame&, const surface::Mesh&, const std::string& caption, double top_speed);
/// Flat pictures without room for axes have none.
bool has_caption(const Setting&);

/// Pictures as displayed (R G B first), side by side, row by row, each over its label; as many to a row as bring the sheet nearest to 16 : 9.
/// Throws base::Error (exit 2) when sizes differ.
Image sheet(const std::vector<Image>&, const std::vector<std::string>& labels);

/// A picture as displayed (a preview), its R, G and B decoded from sRGB: what an EXR file holds. Other channels stay as they are.
Image scene_linear(const Image& display);

/// EXR: half for colour (what is above 65504, the largest half, is written as that), float for the rest, ZIP, metadata. Atomic.
/// A pixel that is not finite throws base::Error (exit 1), and no file is written.
void write_exr(const std::filesystem::path&, const Image&, const Stamp&, base::Ledger&);
/// 8-bit PNG through the view and exposure of `options`, of what is denoised if they say so; a preview goes in as it is (`display_referred`). Atomic.
void write_png(const std::filesystem::path&, const Image&, const Options& options, bool display_referred, base::Ledger&);

/// R, G and B of a picture as displayed at `width` pixels or its own width, whichever is less: the mean of the light of the pixels that it covers.
Image shrunk(const Image&, std::int64_t width);
/// A JPEG file of a picture as displayed, in memory; `quality` is 1 ... 100.
std::string jpeg(const Image&, int quality);

struct ImageInfo {
  std::int64_t width = 0, height = 0;
  std::vector<std::string> channels;
  std::vector<std::optional<std::array<double, 2>>> ranges; // of each channel's finite values; empty when it has none
  std::uint64_t not_finite = 0;                             // values that are NaN or infinite
  std::vector<std::array<std::string, 2>> metadata;
};
/// Reads the whole image; throws base::Error ("PATH: reason", exit 2) when that is not possible.
ImageInfo info(const std::filesystem::path&);
/// What the file holds: codes of an 8-bit image as 0 ... 1, floats as they are. Throws base::Error (exit 2) for a file that cannot
/// be read, and before anything is allocated for one that is too large.
Image read_image(const std::filesystem::path&);

/// Throws base::Error (exit 2) for a picture that no environment can be made of.
void check_environment(const std::filesystem::path&);
/// Throws base::Error (exit 2) for a piece of the set that cannot be read, or not be placed.
void check_set_piece(const SetPiece&);
/// Throws base::Error (exit 2) where more surfaces are dielectric than are told apart.
void check_media(const Setting&);

struct ImageDifference {
  std::vector<base::Differences> by_channel;                // in the order of the image's channels
  base::Differences values;                                 // of all channels
  std::uint64_t pixels = 0, pixels_over = 0;                // a pixel is over the limit when any of its channels is
  std::optional<double> psnr;   // [dB] of R, G and B, or of all channels where there are none; empty when they are the same
  double percent_over() const { return pixels > 0 ? 100 * static_cast<double>(pixels_over) / static_cast<double>(pixels) : 0; }
};
/// Both of the same size and channels. A NaN or an infinity differs from everything.
ImageDifference compare(const Image&, const Image&, double limit);

/// |a - b| times `gain`, for people: R, G and B where they differ, else the first channel that does. Magenta where one is not finite.
struct DifferencePicture {
  Image image;                                              // R G B as displayed
  double gain = 1;
  std::vector<std::string> shows;                           // channels
};
DifferencePicture difference_picture(const Image& a, const Image& b, const ImageDifference&);

}  // namespace render
