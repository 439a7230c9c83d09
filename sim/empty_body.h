#pragma once
// Bodies that get no particle: they would vanish from the film without a word.
#include <cstddef>
#include <optional>

#include "base/error.h"
#include "sim/scene.h"

namespace sim {

struct EmptyBody {
  std::size_t body;            // place in the scene
  base::Complaint complaint;   // key "body.NAME.shape", and why: outside the domain, too small, or inside what comes first
};

/// The first such body. Looks at places all over each body until one is its own: a body that owns a share s of the cells around it takes about
/// 1/s looks, and only one that is empty takes them all.
std::optional<EmptyBody> find_empty_body(const Scene&);

}  // namespace sim
