#pragma once
// The layers of a shot, merged: built-in rung < the shot's keys < its [quality.RUNG] < --set.
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/shot/tree.h"

namespace app {

/// Rungs of the ladder of accuracy that are built. What they set: rung() in layers.cpp.
inline constexpr std::array<std::string_view, 4> kRungs{"draft", "normal", "high", "extreme"};

struct Layers {
  Node user;                  // the shot file without its [quality] tables, `--quality` applied
  Node qualities;             // its [quality.RUNG] tables by rung
  std::vector<Node> sets;     // --set, in order
  std::string file;           // what errors call the shot
  std::string quality;        // the rung that is chosen, a name in kRungs ("normal" when the shot names none that is)
};

/// Takes a parsed shot apart. Throws base::Error on a [quality.RUNG] that is no rung or no table.
Layers make_layers(Node shot, const std::string& file, const std::optional<std::string>& quality, const std::vector<std::string>& sets);

/// The tree that the reader reads. Throws base::Error when a layer addresses an entry that is not there.
Node merged(const Layers&);
/// The same for another rung and without --set, to check a [quality.RUNG] that is not chosen.
Node merged_for(const Layers&, const std::string& quality);

/// "quality.draft.": how values of that table are called in errors.
std::string under(const std::string& quality);

}  // namespace app
