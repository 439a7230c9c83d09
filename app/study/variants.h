#pragma once
// Which variants of a shot or problem are tried: those that --vary asks for, or the ladder of schemes.
#include <string>
#include <utility>
#include <vector>

#include "sim/scene.h"

namespace app {

/// Keys of a shot with the text of their values, as --set takes them.
using Sets = std::vector<std::pair<std::string, std::string>>;

/// One key and the values it is given in turn.
struct Varied {
  std::string key;
  std::vector<std::string> values;
  std::string option = "--vary";   // that asks for it, or "--refine"
};

/// Whether it is one of those that make a scheme: transfer, kernel, modes, splitting, carry.
bool is_scheme_key(const std::string& key);

/// "sim.modes=4,8,full": commas within brackets, braces and quotes part nothing. Throws base::Error (exit 2) on anything else.
Varied parse_vary(const std::string& text, const std::string& option = "--vary");

/// Every value of each key with every value of the others, the last key fastest. What says nothing is left out: sim.modes of a transfer that is not
/// polypic; so is what would then come twice.
std::vector<Sets> combinations(const std::vector<Varied>&);

/// From the least to the most accurate scheme.
std::vector<Sets> scheme_ladder(bool is_solid);

/// "polypic full linear reflection cell 0.04": scheme if any of its keys was varied, then what else was.
std::string label_of(const sim::Options&, const Sets& varied);

/// "key=value", one each.
std::vector<std::string> set_texts(const Sets&);

/// As in a shot: "polypic", "quadratic", "4" or "full" (empty but for polypic), "lie" (empty for solids).
struct SchemeNames {
  std::string transfer, kernel, modes, splitting;
};
SchemeNames scheme_names(const sim::Options&);

}  // namespace app
