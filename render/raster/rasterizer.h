#pragma once
// Spheres drawn as shaded discs, facets and lines, with a depth test; discs in a plane. By OpenGL in memory: the same bits for any number
// of threads.
#include <array>
#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "render/view/view.h"

namespace render::raster {

struct Disc {
  base::Vec3f middle;  // [m]
  base::Vec3f color;   // as displayed
};
struct Line {
  base::Vec3f from, to;  // [m]
  base::Vec3f color;
};

/// A corner of a facet. Facets are lit from both sides.
struct Corner {
  base::Vec3f place, normal, color;  // [m]
};

struct Drawing {
  int width = 0, height = 0;  // [pixels]
  view::View view;
  float radius = 0;           // [m] of all discs; at least a pixel is drawn
  base::Vec3f top, bottom;    // background, from the upper to the lower edge
  std::vector<Disc> discs;
  std::vector<Line> lines;
  std::vector<Corner> corners;
  std::vector<std::array<std::uint32_t, 3>> facets;
};

/// RGBA, 8 bits, rows top-down.
std::vector<std::uint8_t> rasterize(const Drawing&);

/// Discs in the plane of the picture. Where they overlap, a sample has the colour of the nearest middle, not of the last one drawn.
struct FlatDrawing {
  int width = 0, height = 0;  // [samples]
  float radius = 0;           // [samples] of all discs
  std::vector<Disc> discs;    // middles [samples] from the upper left corner, y down; z is not read
};

/// RGBA, 8 bits, rows top-down; alpha is 0 where no disc is.
std::vector<std::uint8_t> rasterize(const FlatDrawing&);

}  // namespace render::raster
