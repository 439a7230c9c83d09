#pragma once
// A plot as commands of gnuplot; everything is placed here, gnuplot only draws.
#include <string>
#include <string_view>

#include "app/study/plot.h"

namespace app {

inline constexpr double kFontSize = 16;   // [pixels]

/// A text as gnuplot reads it: in single quotes, for it runs what stands in backquotes within double ones, and each of its own twice.
std::string in_quotes(std::string_view);

/// From `reset session` to `plot`; what follows may set another terminal and `replot`. Throws base::Error (exit 1) for values that are not finite.
std::string plot_script(const Plot&);

}  // namespace app
