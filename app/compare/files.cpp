#include "app/compare/files.h"

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "render/render.h"
#include "surface/surface.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

void put_sums(const base::Differences& values, Json& out) {
  if (values.measured() > 0) {
    out["mean"] = values.mean();
    out["rms"] = values.rms();
    out["max"] = values.largest;
  }
  if (values.not_finite > 0) out["not_finite"] = values.not_finite;
}

void put(const base::Differences& values, Json& out) {
  put_sums(values, out);
  if (values.count > 0) out["percent_over"] = values.percent_over();
}

Json sums(const base::Differences& values) {
  Json out = Json::object();
  put(values, out);
  return out;
}

std::string channels_text(const render::Image& image) {
  std::string text;
  for (const std::string& channel : image.channels) text += (text.empty() ? "" : " ") + channel;
  return text;
}

/// What keeps two images from being compared; empty: nothing.
std::string unlike(const render::Image& a, const render::Image& b) {
  const auto size = [](const render::Image& image) { return std::to_string(image.width) + "x" + std::to_string(image.height); };
  if (size(a) != size(b)) return size(b) + " pixels, and the other has " + size(a);
  if (a.channels != b.channels) return "has channels " + channels_text(b) + ", and the other has " + channels_text(a);
  return {};
}

Json write_picture(const fs::path& file, const render::Image& a, const render::Image& b, const render::ImageDifference& difference) {
  const render::DifferencePicture picture = render::difference_picture(a, b, difference);
  base::Ledger untold;
  render::write_png(file, picture.image, {}, /*display_referred=*/true, untold);
  return {{"file", file.string()}, {"gain", picture.gain}, {"channels", picture.shows}};
}

bool is_same(const surface::GridDifference& grid, const Tolerance& tolerance) {
  const bool same_topology = grid.active_only_a + grid.active_only_b == 0 || !tolerance.exact();
  return grid.unlike.empty() && same_topology && grid.values.percent_over() <= tolerance.percent;
}

Json grid_json(const surface::GridDifference& grid, const Tolerance& tolerance) {
  Json out = {{"name", grid.name}, {"same", is_same(grid, tolerance)}};
  if (!grid.unit.empty()) out["unit"] = grid.unit;
  if (!grid.unlike.empty()) out["unlike"] = grid.unlike;
  out["active"] = {grid.active_a, grid.active_b};
  if (grid.values.count > 0) out["active_only"] = {grid.active_only_a, grid.active_only_b};
  put(grid.values, out);
  return out;
}

/// Of two images that are alike.
Json compare_images(const render::Image& a, const render::Image& b, const Tolerance& tolerance, const std::optional<fs::path>& picture) {
  const render::ImageDifference difference = render::compare(a, b, tolerance.fail);
  Json out = {{"same", difference.percent_over() <= tolerance.percent}, {"kind", "image"}};
  put_sums(difference.values, out);
  if (difference.psnr) out["psnr"] = *difference.psnr;
  out["percent_over"] = difference.percent_over();
  out["channels"] = Json::array();
  for (std::size_t c = 0; c < a.channels.size(); ++c) {
    Json channel = {{"name", a.channels[c]}};
    put(difference.by_channel[c], channel);
    out["channels"].push_back(channel);
  }
  if (picture) out["picture"] = write_picture(*picture, a, b, difference);
  return out;
}

}  // namespace

Json compare_image_files(const fs::path& path_a, const fs::path& path_b, const Tolerance& tolerance, const std::optional<fs::path>& picture) {
  const render::Image a = render::read_image(path_a), b = render::read_image(path_b);
  if (const std::string what = unlike(a, b); !what.empty()) base::throw_input(path_b.string(), what);
  return compare_images(a, b, tolerance, picture);
}

Json compare_frame_images(const fs::path& path_a, const fs::path& path_b, const Tolerance& tolerance) {
  const render::Image a = render::read_image(path_a), b = render::read_image(path_b);
  if (const std::string what = unlike(a, b); !what.empty()) return {{"same", false}, {"kind", "image"}, {"unlike", what}};
  return compare_images(a, b, tolerance, {});
}

Json compare_volume_files(const fs::path& a, const fs::path& b, const Tolerance& tolerance) {
  const surface::VolumeDifference difference = surface::compare_volumes(a, b, tolerance.fail);
  bool same = difference.only_a.empty() && difference.only_b.empty();
  Json grids = Json::array();
  for (const surface::GridDifference& grid : difference.grids) {
    same = same && is_same(grid, tolerance);
    grids.push_back(grid_json(grid, tolerance));
  }
  Json out = {{"same", same}, {"kind", "volume"}};
  if (difference.grids.size() == 1) put(difference.grids.front().values, out);
  if (!difference.only_a.empty()) out["only_a"] = difference.only_a;
  if (!difference.only_b.empty()) out["only_b"] = difference.only_b;
  out["grids"] = grids;
  return out;
}

Json compare_point_files(const fs::path& a, const fs::path& b, const Tolerance& tolerance) {
  const surface::PointDifference difference = surface::compare_points(a, b, tolerance.fail);
  const std::uint64_t missing = difference.only_a + difference.only_b, all = missing + difference.position.count;
  const double percent = all > 0 ? 100 * static_cast<double>(missing + difference.over) / static_cast<double>(all) : 0;
  Json out = {{"same", difference.unlike.empty() && percent <= tolerance.percent}, {"kind", "points"}};
  put_sums(difference.position, out);
  if (all > 0) out["percent_over"] = percent;
  if (!difference.unlike.empty()) out["unlike"] = difference.unlike;
  out["count"] = {difference.count_a, difference.count_b};
  out["only"] = {difference.only_a, difference.only_b};
  out["position"] = sums(difference.position);
  out["velocity"] = sums(difference.velocity);
  for (const auto& [name, scalar] : difference.scalars) out[name] = sums(scalar);
  return out;
}

}  // namespace app
