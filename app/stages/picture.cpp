#include "app/stages/picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "app/plan/plan.h"
#include "app/stages/record.h"
#include "app/stages/stopwatch.h"
#include "app/version.h"
#include "base/error.h"
#include "base/text.h"
#include "sim/drawn_shape.h"
#include "surface/surface.h"

namespace app {
namespace {

// A speed [m/s] that the shot's particles hardly pass, the same for all its frames: that of a fall through the domain on
// top of the fastest start, of turning bodies, sources and colliders too, rounded up to 1, 2 or 5 times a power of ten.
double top_speed(const sim::Scene& scene) {
  double start = 0, squared = 0;
  for (const sim::Body& body : scene.bodies) {
    const double reach = body.spin.isZero(0) ? 0 : 0.5 * body.shape.bounds().size().norm();
    start = std::max(start, body.velocity.norm() + body.spin.norm() * reach);
  }
  for (const sim::Source& source : scene.sources) start = std::max(start, source.velocity.norm());
  for (const sim::Collider& collider : scene.colliders) start = std::max(start, collider.speed());
  for (const sim::Effect& effect : scene.effects) squared += 2 * effect.acceleration.cwiseAbs().dot(scene.options.domain.size());
  const double speed = std::sqrt(squared + start * start);
  constexpr double kLeast = 1e-30;   // [m/s] less is nothing that floats could divide by
  if (!(speed > kLeast)) return 1;
  return base::round_up(speed);
}

/// The end of a preview's colour bar, for all frames: a pressure that stops the fastest liquid, water_mpm among them, or strains a solid by a
/// twentieth; a strain of a tenth; a thousandth of the energy at the top speed. Nothing where the colour needs no more than that speed.
std::optional<double> preview_range(const Shot& shot) {
  const std::string& color = shot.render.preview.color;
  const double speed = top_speed(shot.scene);
  if (color == "strain") return 0.1;
  if (color == "mode_energy") return base::round_up(5e-4 * speed * speed);
  if (color != "pressure") return {};
  double top = 0;
  if (!shot.scene.options.is_solid()) top = 0.5 * sim::liquid_density(shot.scene) * speed * speed;
  for (const sim::Body& body : shot.scene.bodies)
    if (body.is_solid) top = std::max(top, body.solid.model == sim::Elasticity::tait ? 0.5 * body.solid.density * speed * speed : 0.05 * body.solid.young);
  return top > 0 ? base::round_up(top) : 1;
}

std::string caption(const Shot& shot, const sim::Frame& frame) {
  char text[200];
  std::snprintf(text, sizeof text, "%s  frame %lld  t = %.3f s  %s  %zu particles", shot.name.c_str(), static_cast<long long>(frame.number),
                frame.time, transfer_text(shot.scene.options).c_str(), frame.id.size());
  return text;
}

}  // namespace

PictureMaker::PictureMaker(const Shot& shot, const Folder& folder, StageHashes hashes, int threads)
    : shot_(shot), folder_(folder), hashes_(std::move(hashes)), threads_(threads) {}

void PictureMaker::record(Stage stage, std::int64_t frame, const base::Ledger& ledger, const Stopwatch& spent) const {
  write_record(folder_, shot_.scene.options.dimension,
               {.stage = stage, .frame = frame, .hash = hashes_.of(stage), .seconds = spent.seconds(),
                .cpu_seconds = spent.cpu_seconds(), .passes = ledger.passes()});
}

bool PictureMaker::colliders_move() const {
  const auto& all = shot_.scene.colliders;
  return std::any_of(all.begin(), all.end(), [](const sim::Collider& c) { return c.moves(); });
}

render::Setting PictureMaker::setting_at(std::int64_t frame) const {
  render::Setting setting = shot_.render;
  if (!setting.preview.range) setting.preview.range = preview_range(shot_);
  const sim::Options& o = shot_.scene.options;
  const auto meets_domain = [&](const sim::Shape& shape) {
    const base::Box bounds = shape.bounds();
    return (bounds.lower.array() <= o.domain.upper.array()).head(o.dimension).all() && (bounds.upper.array() >= o.domain.lower.array()).head(o.dimension).all();
  };
  for (std::size_t i = 0; i < setting.colliders.size(); ++i) {
    sim::Collider& c = setting.colliders[i];
    const double time = static_cast<double>(frame - 1) / shot_.fps;
    std::vector<sim::Image> all = sim::images_of(sim::drawn_shape_at(time, c, o), o);
    const auto seen = std::find_if(all.begin(), all.end(), [&](const sim::Image& image) { return meets_domain(image.shape); });
    if (seen != all.end()) std::iter_swap(all.begin(), seen);
    const sim::RigidMotion motion = sim::motion_at(time, c, o).moved(all.front().by);
    c.shape = all.front().shape, c.velocity = motion.velocity, c.spin = motion.spin, c.pivot = motion.pivot;
    for (std::size_t k = 1; k < all.size(); ++k)
      if (meets_domain(all[k].shape)) setting.images.push_back({i, all[k].shape, all[k].by - all.front().by});
  }
  return setting;
}

double PictureMaker::surface(std::int64_t frame) {
  const Stopwatch watch;
  base::Ledger ledger(plan_of(shot_, Stage::surface));
  const sim::Frame points = surface::read_points(folder_.points(frame));
  const std::filesystem::path file = folder_.surface(frame);
  Folder::make_room_for(file);
  const sim::Options& o = shot_.scene.options;
  surface::Room room{o.domain, o.cell};
  for (std::size_t a = 0; a < 3; ++a) {
    room.periodic[a] = o.periodic(int(a));
    for (std::size_t side = 0; side < 2; ++side) room.walls[a][side] = !room.periodic[a] && o.boundary[a][side] != sim::Side::open;
  }
  const render::Setting setting = setting_at(frame);
  for (const sim::Collider& collider : setting.colliders) {
    if (collider.shape.mesh) collider.shape.mesh->distances->prepare();
    room.solids.push_back({collider.shape, collider.motion()});
  }
  for (const render::ColliderImage& image : setting.images)
    room.solids.push_back({image.shape, setting.colliders[image.collider].motion().moved(image.by)});
  for (const bool flows : shot_.render.body_flows) room.dry.push_back(!flows);
  if (shot_.render.parts_bodies())
    for (const sim::Body& body : shot_.scene.bodies) room.bodies.push_back(body.name);
  surface::write_surface(file, points, shot_.surface, room, ledger);
  record(Stage::surface, frame, ledger, watch);
  return watch.seconds();
}

render::Image PictureMaker::trace(std::int64_t frame, base::Ledger& ledger) {
  if (!tracer_ || colliders_move()) tracer_ = std::make_unique<render::PathTracer>(setting_at(frame), threads_);
  const render::Grains grains = shot_.render.draws_grains() ? render::grains_of(surface::read_points(folder_.points(frame))) : render::Grains{};
  if (shot_.render.parts_bodies()) {
    std::vector<std::string> names;   // of those with a mesh
    for (const sim::Body& body : shot_.scene.bodies) names.push_back(shot_.render.is_grains(names.size()) ? "" : body.name);
    return tracer_->trace_bodies(surface::read_surfaces(folder_.surface(frame), shot_.surface, names, ledger), grains, frame, ledger);
  }
  const surface::Mesh mesh = shot_.render.draws_surface() ? surface::read_surface(folder_.surface(frame), shot_.surface, ledger) : surface::Mesh{};
  return tracer_->trace(mesh, grains, frame, ledger);
}

render::Image PictureMaker::draw(std::int64_t frame, base::Ledger& ledger) const {
  const sim::Frame points = surface::read_points(folder_.points(frame));
  if (!is_flat() && shot_.render.preview.draw == "surface") {
    const auto made = read_record(folder_, Stage::surface, frame);
    if (!made || made->hash != hashes_.surface)
      base::throw_input(folder_.surface(frame).string(), "is not made, or from another shot; run surface first");
    const surface::Mesh mesh = surface::read_surface(folder_.surface(frame), shot_.surface, ledger);
    const auto pass = ledger.pass("draw", static_cast<std::int64_t>(mesh.position.size() * 3 * sizeof(base::Vec3f)));
    return render::preview(setting_at(frame), points, mesh, caption(shot_, points), top_speed(shot_.scene));
  }
  const auto pass = ledger.pass("draw", static_cast<std::int64_t>(points.position.size() * 2 * sizeof(base::Vec3f)));
  return render::preview(setting_at(frame), points, caption(shot_, points), top_speed(shot_.scene));
}

double PictureMaker::render(std::int64_t frame) {
  const Stopwatch watch;
  base::Ledger ledger(plan_of(shot_, Stage::render));
  const render::Image image = is_flat() ? draw(frame, ledger) : trace(frame, ledger);
  const render::Options& options = shot_.render.options;
  const render::Stamp stamp{.shot = shot_.name, .hash = hashes_.render, .version = kVersion, .frame = frame, .spp = options.spp,
                            .time = static_cast<double>(frame - 1) / shot_.fps, .reproducible = image.reproducible};
  Folder::make_room_for(folder_.image(frame, ".exr"));
  render::write_exr(folder_.image(frame, ".exr"), is_flat() ? render::scene_linear(image) : image, stamp, ledger);
  render::write_png(folder_.image(frame, ".png"), image, options, /*display_referred=*/is_flat(), ledger);
  record(Stage::render, frame, ledger, watch);
  return watch.seconds();
}

double PictureMaker::preview(std::int64_t frame) {
  const Stopwatch watch;
  base::Ledger ledger(plan_of(shot_, Stage::preview));
  const render::Image image = draw(frame, ledger);
  Folder::make_room_for(folder_.preview(frame));
  render::write_png(folder_.preview(frame), image, shot_.render.options, /*display_referred=*/true, ledger);
  record(Stage::preview, frame, ledger, watch);
  return watch.seconds();
}

}  // namespace app
