#include "app/plan/limits.h"

#include <sys/resource.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

#include "app/plan/plan.h"
#include "app/plan/predict.h"
#include "base/error.h"
#include "sim/size.h"

namespace app {
namespace {

namespace fs = std::filesystem;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

// The number in a file that holds one; what says "max" or is not there limits nothing.
double number_in(const fs::path& file) {
  std::ifstream in(file);
  double number = 0;
  return in >> number ? number : kNoLimit;
}

// What stands behind a name at the beginning of a line.
std::optional<double> number_of(const fs::path& file, std::string_view name) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string word;
    double number = 0;
    if (words >> word >> number && word == name) return number;
  }
  return {};
}

double available() {
  const auto kilobytes = number_of("/proc/meminfo", "MemAvailable:");
  return kilobytes ? 1024 * *kilobytes : kNoLimit;
}

double limit_of(__rlimit_resource kind) {
  rlimit limit{};
  return ::getrlimit(kind, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY ? double(limit.rlim_cur) : kNoLimit;
}

double channels(const Shot& shot) { return shot.scene.options.dimension == 2 ? 4 : 15; }
double pixels(const Shot& shot) { return shot.has_pictures ? double(shot.render.options.width * shot.render.options.height) : 0; }

// What grows fastest is what to change.
std::string key_of_memory(const Shot& shot) {
  const double particles = particles_at(shot, shot.frames) * double(plan_of(shot, Stage::simulate).bytes_per_particle());
  return particles >= pixels(shot) * channels(shot) * sizeof(float) ? "sim.cell" : "render.width";
}

std::string key_of_disk(const Prediction& p) {
  const auto most = std::max_element(p.disk.begin(), p.disk.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most->first == "images" ? "render.width" : "sim.cell";
}

[[noreturn]] void refuse(const Shot& shot, const std::string& key, const std::string& what, const std::string& hint) {
  const bool cell = key == "sim.cell";
  char text[32];
  std::snprintf(text, sizeof text, "%.6g m", shot.scene.options.cell);
  const std::string value = cell ? text : std::to_string(shot.render.options.width) + " pixels";
  throw error_about(shot, {.key = key, .value = value, .hint = hint, .message = what});
}

std::string lack_text(double needed, double there, const std::string& what) {
  return "needs " + bytes_text(needed) + " of " + what + ", and there are " + bytes_text(there);
}

/// A cell at least `factor` times as large that divides the domain, too: a share of it by a whole number of the cells that there are.
std::string larger_cell(const sim::Options& o, double factor) {
  const std::int64_t common = sim::common_parts(o);
  const auto parts = std::int64_t(double(common) / factor);
  if (parts < 1) return "larger cells need a domain with edges that are multiples of them";
  const double edge = o.cell * double(common) / double(parts);
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", edge);   // what is cut off is less than a domain may be off by
  return std::string(text) + " m would fit";
}

}  // namespace

std::string bytes_text(double bytes) {
  const char* const units[] = {"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  for (; bytes >= 1000 && unit + 1 < std::size(units); ++unit) bytes /= 1000;
  char text[32];
  std::snprintf(text, sizeof text, bytes < 10 && unit > 0 ? "%.1f %s" : "%.0f %s", bytes, units[unit]);
  return text;
}

double memory_of_groups(const fs::path& list, const fs::path& mount) {
  double least = kNoLimit;
  const auto look_into = [&](fs::path group, const char* most, const char* held, const char* cache) {
    for (;; group = group.parent_path()) {
      const double used = number_in(group / held), cached = number_of(group / "memory.stat", cache).value_or(0);
      least = std::min(least, number_in(group / most) - (used == kNoLimit ? 0 : std::max(used - cached, 0.0)));
      if (group == mount || !group.has_relative_path()) return;
    }
  };
  std::ifstream groups(list);
  for (std::string line; std::getline(groups, line);) {   // "0::/path" of the second version, "4:memory:/path" of the first
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos || second + 1 == line.size()) continue;
    const std::string kinds = "," + line.substr(first + 1, second - first - 1) + ",";
    const fs::path path = fs::path(line.substr(second + 1)).relative_path().lexically_normal();
    const bool is_around = path.empty() || path == "." || *path.begin() == "..";   // seen from within a namespace
    if (kinds == ",,") look_into(is_around ? mount : mount / path, "memory.max", "memory.current", "inactive_file");
    if (kinds.find(",memory,") != std::string::npos)
      look_into(is_around ? mount / "memory" : mount / "memory" / path, "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file");
  }
  return least;
}

double free_memory() {
  double bytes = std::min(available(), memory_of_groups("/proc/self/cgroup", "/sys/fs/cgroup"));
  for (const auto kind : {RLIMIT_AS, RLIMIT_DATA}) bytes = std::min(bytes, limit_of(kind));
  return bytes;
}

double free_disk(const fs::path& path) {
  std::error_code none;
  fs::path there = fs::absolute(path, none);
  if (none) return kNoLimit;   // the working directory is gone; whoever writes says so
  while (!fs::exists(there, none) && there.has_relative_path()) there = there.parent_path();
  struct statvfs disk{};
  if (::statvfs(there.c_str(), &disk) != 0 || disk.f_blocks == 0) return kNoLimit;   // /proc and its like count no blocks
  return double(disk.f_bavail) * double(disk.f_frsize);
}

Prediction least(const Shot& shot, const FrameRange& range) {
  const double particles = particles_at(shot, range.last), held = double(plan_of(shot, Stage::simulate).bytes_per_particle());
  const double point = 2 * 3 * sizeof(float) + sizeof(std::int64_t);
  Prediction p;
  p.frames = double(range.last - range.first + 1);
  p.peak_bytes = particles * held + pixels(shot) * channels(shot) * sizeof(float);
  const double mean = 0.5 * (particles + particles_at(shot, 1));
  p.disk["points"] = mean * point * (0.75 * double(range.last) - 0.25);   // at rest velocities take next to nothing: the first frame is half
  p.disk["checkpoint"] = checkpoint_bytes(shot, particles, range.last);
  p.disk["images"] = 0.5 * pixels(shot) * channels(shot) * double(p.frames);   // a byte a channel
  return p;
}

void require_room(const Shot& shot, const Prediction& p, double memory, double disk) {
  if (p.peak_bytes > memory) {
    const std::string key = key_of_memory(shot);
    const double share = std::pow(p.peak_bytes / memory, 1.0 / double(key == "sim.cell" ? shot.scene.options.dimension : 2));
    std::string hint = std::to_string(std::int64_t(double(shot.render.options.width) / (1.05 * share))) + " pixels would fit";
    if (key == "sim.cell") hint = larger_cell(shot.scene.options, 1.05 * share);
    refuse(shot, key, lack_text(p.peak_bytes, memory, "memory"), hint);
  }
  if (p.disk_bytes() > disk)
    refuse(shot, key_of_disk(p), lack_text(p.disk_bytes(), disk, "disk"), "or fewer --frames, or another --out");
}

void refuse_for_memory(const Shot& shot, const std::string& what) {
  const std::string key = key_of_memory(shot);
  const double limit = limit_of(RLIMIT_AS);
  refuse(shot, key, what + (limit < kNoLimit ? ", with " + bytes_text(limit) + " of address space allowed (ulimit -v)" : ""),
         "what is finished is kept: with more memory the same command goes on; " +
             std::string(key == "sim.cell" ? "larger cells" : "smaller pictures") + " need less");
}

}  // namespace app
