#include "base/params.h"

#include <cmath>

#include "base/text.h"

namespace base {

std::string Range::text() const {
  const bool below = std::isfinite(low), upper = std::isfinite(high);
  if (low == high) return to_text(low);
  if (below && upper && low_open == high_open)
    return "between " + to_text(low) + " and " + to_text(high) + (low_open ? " (both excluded)" : "");
  std::string out;
  if (below) out = (low_open ? "above " : "at least ") + to_text(low);
  if (below && upper) out += " and ";
  if (upper) out += (high_open ? "below " : "at most ") + to_text(high);
  return out;
}

}  // namespace base
