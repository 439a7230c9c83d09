#pragma once
// What a frame may hold a number of for each particle, and its name in points files.
#include <array>
#include <vector>

#include "sim/frame.h"

namespace surface {

struct Scalar {
  const char* name;
  std::vector<float> sim::Frame::* values;
};
inline constexpr std::array<Scalar, 3> kScalars = {
    {{"pressure", &sim::Frame::pressure}, {"strain", &sim::Frame::strain}, {"mode_energy", &sim::Frame::mode_energy}}};

}  // namespace surface
