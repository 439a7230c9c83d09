#pragma once
// The zero set of a level set as quads, in its own file: OpenVDB's mesher takes long to compile.
#include <openvdb/openvdb.h>

#include <vector>

namespace surface::mesh {

struct Quads {
  std::vector<openvdb::Vec3s> points;   // [m] world
  std::vector<openvdb::Vec4I> quads;    // counter-clockwise seen from outside; a triangle repeats its last vertex
};
Quads quads_of(const openvdb::FloatGrid&);

}  // namespace surface::mesh
