#pragma once
// What an axis shows and where its ticks are.
#include <string>
#include <vector>

namespace app {

struct Tick {
  double value = 0;
  std::string text;
};

struct Axis {
  bool log = false;
  double low = 0, high = 1;     // ends; above 0 where log
  std::vector<Tick> ticks;      // ascending, within the ends
  /// 0 at the low end, 1 at the high one.
  double place(double value) const;
};

/// Shows low ... high with a margin of `margin` of the length at both ends. On a log axis: whole decades where there are several, else 1, 2 and 5
/// of each, else round numbers; low must be above 0 then. `keeps_zero`: no margin beyond an end that is 0.
Axis axis_for(double low, double high, bool log, double margin, bool keeps_zero = false);

/// The same axis without the ticks at fractions.
Axis with_whole_ticks(Axis);

/// "0.02", "1500", "3×10⁻⁶".
std::string tick_text(double value);

}  // namespace app
