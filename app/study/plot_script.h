#pragma once
// A plot as commands of gnuplot; everything is placed here, gnuplot only draws.
#include <string>

#include "app/study/plot.h"

namespace app {

inline constexpr double kFontSize = 16;   // [pixels]

/// From `reset session` to `plot`; what follows may set another terminal and `replot`. Throws base::Error (exit 1) for values that are not finite.
std::string plot_script(const Plot&);

}  // namespace app
