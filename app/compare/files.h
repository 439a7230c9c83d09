#pragma once
// One file against one other.
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "app/compare/compare.h"

namespace app {

/// {same, kind: "image", mean, rms, max, psnr, percent_over, channels}; of images with other sizes or channels: exit 2.
/// `picture` receives the difference.
nlohmann::ordered_json compare_image_files(const std::filesystem::path& a, const std::filesystem::path& b, const Tolerance&,
                                           const std::optional<std::filesystem::path>& picture = {});
/// The same of one frame of two runs: those of other sizes or channels differ, and `unlike` says how.
nlohmann::ordered_json compare_frame_images(const std::filesystem::path& a, const std::filesystem::path& b, const Tolerance&);
/// {same, kind: "volume", grids}; with one grid in each file, its values also stand at the top.
nlohmann::ordered_json compare_volume_files(const std::filesystem::path& a, const std::filesystem::path& b, const Tolerance&);
/// {same, kind: "points", mean, rms, max, percent_over, position, velocity}: the values at the top are of the positions [m],
/// percent_over of particles.
nlohmann::ordered_json compare_point_files(const std::filesystem::path& a, const std::filesystem::path& b, const Tolerance&);

}  // namespace app
