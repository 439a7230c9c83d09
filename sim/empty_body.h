#pragma once
// Bodies that get no particle, sources without a cell: they would be missing in the film without a word. And sources that pour into what stands in
// their way: it would be pressed together.
#include <cstddef>
#include <optional>
#include <string>

#include "base/error.h"
#include "sim/scene.h"

namespace sim {

struct EmptyBody {
  std::string name;            // "body jelly"
  std::size_t place;           // in the scene's list
  base::Complaint complaint;   // key "body.NAME.shape", and why: outside the domain, too small, or inside what comes first
};

/// The first such body, or else the first such source ("source.NAME.shape" or "source.NAME.velocity"). Looks at places all over each body until
/// one is its own: a body that owns a share s of the cells around it takes about 1/s looks, and only one that is empty takes them all.
std::optional<EmptyBody> find_empty_body(const Scene&);

}  // namespace sim
