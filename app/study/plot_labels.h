#pragma once
// Where texts beside points go, so that they cover neither each other nor points nor lines. Lengths in pixels, y downwards.
#include <string>
#include <vector>

namespace app {

struct Spot {
  double x = 0, y = 0;
};
struct Rectangle {
  double left = 0, top = 0, right = 0, bottom = 0;
  /// Area that both cover.
  double overlap(const Rectangle&) const;
};

struct PlacedLabel {
  Rectangle box;
  bool has_leader = false;   // not next to its point: a line leads there
  Spot from, to;             // of that line: at the box, at the point
};

/// What labels must keep off.
struct Obstacles {
  std::vector<Spot> points;                  // markers
  std::vector<std::vector<Spot>> lines;
  std::vector<Rectangle> texts;
  Rectangle room;                            // labels stay inside
};

/// Width of a text in DejaVu Sans or Verdana, from the classes of its letters; about 5 % too wide for most.
double text_width(const std::string& text, double font_size);

/// One place a label (anchors[i], widths[i]), all of one height. Deterministic: candidates around the point, nearest first, and the cheapest is
/// taken for one label after another, some rounds until nothing moves.
std::vector<PlacedLabel> place_labels(const std::vector<Spot>& anchors, const std::vector<double>& widths, double height, const Obstacles&);

}  // namespace app
