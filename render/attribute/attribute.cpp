#include "render/attribute/attribute.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/parallel.h"
#include "base/text.h"
#include "render/raster/colors.h"

namespace render::attribute {
namespace {

using base::Vec3f;

constexpr std::size_t kChunk = 1 << 15;

bool is_vorticity(const Setting& setting) { return setting.preview.color == "vorticity"; }

/// Around each node the linear field that fits the particles' velocities best, weighed by a tent of one cell to each side: exact for a
/// linear field however the particles lie, at a rim too.
class CurlGrid {
 public:
  CurlGrid(const Setting& setting, const sim::Frame& frame) : flat_(setting.dimension == 2), lower_(setting.domain.lower.cast<float>()) {
    constexpr double kMostNodes = 1 << 22;
    const double spacing = frame.pscale * (flat_ ? std::sqrt(std::numbers::pi) : std::cbrt(4 * std::numbers::pi / 3));
    const base::Vec3 size = setting.domain.size();
    double cell = std::max(2 * spacing, 1e-9 * size.norm());
    const auto nodes = [&](double h) { return (size[0] / h + 2) * (size[1] / h + 2) * (flat_ ? 1 : size[2] / h + 2); };
    while (nodes(cell) > kMostNodes) cell *= 1.25;
    inverse_ = static_cast<float>(1 / cell);
    for (int axis = 0; axis < 3; ++axis) count_[axis] = flat_ && axis == 2 ? 1 : static_cast<std::size_t>(std::ceil(size[axis] / cell)) + 2;
    std::vector<Moments> moments(count_[0] * count_[1] * count_[2]);
    for (std::size_t i = 0; i < frame.position.size(); ++i)   // in the order of ids: the same sums every time
      around(frame.position[i], [&](std::size_t node, float weight, const Vec3f& from) { moments[node].add(weight, from, frame.velocity[i]); });
    known_.resize(moments.size());
    curl_.resize(moments.size());
    base::parallel_chunks(moments.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        known_[i] = moments[i].weight > kLight;
        if (!known_[i]) continue;
        const Vec3f curl = inverse_ * moments[i].curl();
        curl_[i] = flat_ ? curl.z() : curl.norm();
      }
    });
  }

  /// [1/s] signed about z in two dimensions, else the length.
  float at(const Vec3f& point) const {
    float sum = 0, total = 0;
    around(point, [&](std::size_t node, float weight, const Vec3f&) {
      if (!known_[node]) return;
      sum += weight * curl_[node];
      total += weight;
    });
    return total > 0 ? sum / total : 0;
  }

 private:
  static constexpr float kLight = 1e-3f;  // weight below which a node knows nothing

  /// Sums over the particles around a node; places [cells] from it.
  struct Moments {
    float weight = 0;
    Vec3f place = Vec3f::Zero(), velocity = Vec3f::Zero();
    Eigen::Matrix3f spread = Eigen::Matrix3f::Zero(), both = Eigen::Matrix3f::Zero();  // place place^T, velocity place^T

    void add(float w, const Vec3f& x, const Vec3f& v) {
      weight += w;
      place += w * x;
      velocity += w * v;
      spread += w * x * x.transpose();
      both += w * v * x.transpose();
    }
    /// [m/s a cell] of the best linear fit. What lies in a plane, a line or a point has no slope across it.
    Vec3f curl() const {
      const Vec3f x = place / weight, v = velocity / weight;
      Eigen::Matrix3f square = spread / weight - x * x.transpose();
      square.diagonal().array() += 1e-3f;   // cells^2: a full cell's is 0.17
      const Eigen::Matrix3f slope = (both / weight - v * x.transpose()) * square.inverse();
      return {slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0), slope(1, 0) - slope(0, 1)};
    }
  };

  /// Calls visit(node, weight, place from it) for the corners of the cell that holds a point; not at all outside the domain.
  template <class Visit>
  void around(const Vec3f& point, const Visit& visit) const {
    const Vec3f place = inverse_ * (point - lower_);
    std::array<std::size_t, 3> cell{};
    Vec3f part = Vec3f::Zero();
    for (int axis = 0; axis < (flat_ ? 2 : 3); ++axis) {
      const float low = std::floor(place[axis]);
      if (!(low >= 0 && low < static_cast<float>(count_[axis] - 1))) return;
      cell[static_cast<std::size_t>(axis)] = static_cast<std::size_t>(low);
      part[axis] = place[axis] - low;
    }
    for (std::size_t corner = 0; corner < (flat_ ? 4u : 8u); ++corner) {
      const std::array<std::size_t, 3> high{corner & 1, corner >> 1 & 1, corner >> 2};
      float weight = 1;
      Vec3f from = part;
      for (int axis = 0; axis < 3; ++axis) {
        if (high[static_cast<std::size_t>(axis)]) from[axis] -= 1;
        weight *= 1 - std::abs(from[axis]);
      }
      visit(((cell[2] + high[2]) * count_[1] + cell[1] + high[1]) * count_[0] + cell[0] + high[0], weight, from);
    }
  }

  bool flat_;
  Vec3f lower_;
  float inverse_ = 1;            // [1/m] of a cell
  std::size_t count_[3];         // nodes
  std::vector<std::uint8_t> known_;
  std::vector<float> curl_;
};

/// The component of velocity that is asked for; -1: its length.
int component(const Setting& setting) { return setting.preview.color.starts_with("velocity_") ? setting.preview.color.back() - 'x' : -1; }

template <class Value>
std::vector<float> each(std::size_t count, const Value& value) {
  std::vector<float> result(count);
  base::parallel_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) result[i] = value(i);
  });
  return result;
}

struct Carried {
  std::string_view color;
  std::vector<float> sim::Frame::* values;
  const char* unit;
};
constexpr Carried kCarried[] = {
    {"pressure", &sim::Frame::pressure, "Pa"}, {"strain", &sim::Frame::strain, "1"}, {"mode_energy", &sim::Frame::mode_energy, "J/kg"}};

const Carried* carried(std::string_view color) {
  for (const Carried& c : kCarried)
    if (c.color == color) return &c;
  return nullptr;
}

bool is_material(std::string_view color) { return color == "material"; }

}  // namespace

bool only_particles_have(std::string_view color) { return carried(color) || is_material(color); }

float Scale::place(float value) const { return static_cast<float>(std::clamp(static_cast<double>(value) / top, is_signed ? -1.0 : 0.0, 1.0)); }
base::Vec3f Scale::color(float value) const {
  if (!names.empty()) return raster::distinct(static_cast<std::size_t>(value));
  return is_signed ? raster::blue_to_red(place(value)) : raster::viridis(place(value));
}

Scale scale_of(const Setting& setting, double top_speed) {
  const double speed = top_speed > 0 ? top_speed : 1;
  const std::string& color = setting.preview.color;
  if (is_material(color)) return {.unit = "", .names = setting.materials};
  if (const Carried* c = carried(color))
    return {.is_signed = color == "pressure" && setting.shows_tension, .top = setting.preview.range.value_or(1), .unit = c->unit};
  const bool curl = is_vorticity(setting);
  const double top = curl ? base::round_up(speed / (0.05 * setting.domain.size().maxCoeff())) : speed;
  return {.is_signed = component(setting) >= 0 || (curl && setting.dimension == 2),
          .top = setting.preview.range.value_or(top),
          .unit = curl ? "1/s" : "m/s"};
}

std::vector<float> values(const Setting& setting, const sim::Frame& frame) {
  if (is_vorticity(setting)) {
    const CurlGrid curl(setting, frame);
    return each(frame.position.size(), [&](std::size_t i) { return curl.at(frame.position[i]); });
  }
  if (is_material(setting.preview.color))
    return each(frame.position.size(), [&](std::size_t i) { return frame.body.empty() ? 0.0f : static_cast<float>(frame.body[i]); });
  if (const Carried* c = carried(setting.preview.color)) {
    const std::vector<float>& values = frame.*c->values;
    if (values.size() != frame.position.size()) base::throw_input("points", "carry no " + std::string(c->color));
    return values;
  }
  const int axis = component(setting);
  return each(frame.position.size(), [&](std::size_t i) { return axis < 0 ? frame.velocity[i].norm() : frame.velocity[i][axis]; });
}

std::vector<float> values(const Setting& setting, const sim::Frame& frame, const surface::Mesh& mesh) {
  if (is_vorticity(setting)) {
    const CurlGrid curl(setting, frame);
    return each(mesh.position.size(), [&](std::size_t i) { return curl.at(mesh.position[i]); });
  }
  const int axis = component(setting);
  return each(mesh.position.size(), [&](std::size_t i) { return axis < 0 ? mesh.velocity[i].norm() : mesh.velocity[i][axis]; });
}

}  // namespace render::attribute
