#include "app/study/plot_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

namespace app {
namespace {

constexpr double kMarker = 9;       // half the side of a marker's square, with some air
constexpr int kRounds = 8;
constexpr std::array<double, 7> kDistances = {4, 12, 24, 40, 60, 84, 112};
constexpr int kDirections = 16;

bool is_inside(const Rectangle& r, const Spot& s) { return s.x > r.left && s.x < r.right && s.y > r.top && s.y < r.bottom; }

/// Length of the part of a segment within the rectangle, clipped as Liang and Barsky do.
double length_inside(const Rectangle& r, const Spot& a, const Spot& b) {
  const double dx = b.x - a.x, dy = b.y - a.y;
  double enter = 0, leave = 1;
  for (const auto& [p, q] : {std::pair{-dx, a.x - r.left}, {dx, r.right - a.x}, {-dy, a.y - r.top}, {dy, r.bottom - a.y}}) {
    if (p == 0 && q < 0) return 0;
    if (p < 0) enter = std::max(enter, q / p);
    if (p > 0) leave = std::min(leave, q / p);
  }
  return leave > enter ? (leave - enter) * std::hypot(dx, dy) : 0;
}

/// A box whose border touches the circle of radius `distance` around the anchor in the given direction.
Rectangle candidate(const Spot& anchor, double width, double height, double angle, double distance) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double x = anchor.x + (distance + kMarker / 2) * c + width / 2 * std::clamp(1.6 * c, -1.0, 1.0);
  const double y = anchor.y + (distance + kMarker / 2) * s + height / 2 * std::clamp(1.6 * s, -1.0, 1.0);
  return {x - width / 2, y - height / 2, x + width / 2, y + height / 2};
}

Spot nearest_on(const Rectangle& r, const Spot& s) { return {std::clamp(s.x, r.left, r.right), std::clamp(s.y, r.top, r.bottom)}; }

struct Placing {
  const std::vector<Spot>& anchors;
  const Obstacles& obstacles;
  std::vector<Rectangle> boxes;

  double cost(std::size_t own, const Rectangle& box, double distance) const {
    double sum = 6 * distance;
    const double area = (box.right - box.left) * (box.bottom - box.top);
    const Rectangle& room = obstacles.room;
    sum += 40 * (area - box.overlap(room));
    for (std::size_t i = 0; i < boxes.size(); ++i)
      if (i != own) sum += 30 * box.overlap(boxes[i]);
    for (const Rectangle& text : obstacles.texts) sum += 30 * box.overlap(text);
    for (const Spot& point : obstacles.points) sum += 20 * box.overlap({point.x - kMarker, point.y - kMarker, point.x + kMarker, point.y + kMarker});
    for (const auto& line : obstacles.lines)
      for (std::size_t i = 1; i < line.size(); ++i) sum += 12 * length_inside(box, line[i - 1], line[i]);
    const Spot& anchor = anchors[own];
    const Spot end = nearest_on(box, anchor);
    for (std::size_t i = 0; i < boxes.size(); ++i)   // its leader crosses no other label, and points to one marker only
      if (i != own) sum += 60 * length_inside(boxes[i], end, anchor);
    if (distance > kDistances[1])
      for (const Spot& point : obstacles.points)
        if (std::hypot(point.x - anchor.x, point.y - anchor.y) > 1)
          sum += 40 * length_inside({point.x - kMarker, point.y - kMarker, point.x + kMarker, point.y + kMarker}, end, anchor);
    return sum;
  }

  /// Moves one label to its cheapest place; true when it has moved.
  bool improve(std::size_t own, double width, double height) {
    double best = std::numeric_limits<double>::infinity();
    Rectangle choice = boxes[own];
    for (const double distance : kDistances)
      for (int k = 0; k < kDirections; ++k) {
        // right, then up and down from there: reading starts at the point
        const double turn = (k % 2 ? -1 : 1) * ((k + 1) / 2) * 2 * M_PI / kDirections;
        const Rectangle box = candidate(anchors[own], width, height, turn, distance);
        const double sum = cost(own, box, distance) + 2 * std::abs(turn);
        if (sum < best - 1e-9) best = sum, choice = box;
      }
    const bool moved = choice.left != boxes[own].left || choice.top != boxes[own].top;
    boxes[own] = choice;
    return moved;
  }
};

}  // namespace

double Rectangle::overlap(const Rectangle& o) const {
  const double width = std::min(right, o.right) - std::max(left, o.left), height = std::min(bottom, o.bottom) - std::max(top, o.top);
  return width > 0 && height > 0 ? width * height : 0;
}

double text_width(const std::string& text, double font_size) {
  double ems = 0;
  for (const unsigned char letter : text) {
    if ((letter & 0xc0) == 0x80) continue;   // the rest of a UTF-8 character
    const char c = static_cast<char>(letter);
    if (std::string_view("ijlI.,:;'|! ()[]").find(c) != std::string_view::npos) ems += 0.36;
    else if (std::string_view("ftr-").find(c) != std::string_view::npos) ems += 0.42;
    else if (std::string_view("mwMWGOQ@%&+=<>~#").find(c) != std::string_view::npos) ems += 0.9;
    else ems += c >= 'A' && c <= 'Z' ? 0.71 : 0.64;
  }
  return 0.95 * ems * font_size;
}

std::vector<PlacedLabel> place_labels(const std::vector<Spot>& anchors, const std::vector<double>& widths, double height,
    const Obstacles& obstacles) {
  Placing placing{anchors, obstacles, {}};
  for (std::size_t i = 0; i < anchors.size(); ++i) placing.boxes.push_back(candidate(anchors[i], widths[i], height, 0, kDistances[0]));
  for (int round = 0; round < kRounds; ++round) {
    bool moved = false;
    for (std::size_t i = 0; i < anchors.size(); ++i) moved = placing.improve(i, widths[i], height) || moved;
    if (!moved) break;
  }
  std::vector<PlacedLabel> placed;
  for (std::size_t i = 0; i < anchors.size(); ++i) {
    const Spot end = nearest_on(placing.boxes[i], anchors[i]);
    const double distance = std::hypot(end.x - anchors[i].x, end.y - anchors[i].y);
    placed.push_back({placing.boxes[i], distance > 2 * kMarker && !is_inside(placing.boxes[i], anchors[i]), end, anchors[i]});
  }
  return placed;
}

}  // namespace app
