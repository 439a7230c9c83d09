#pragma once
// A plot as commands of gnuplot, for a canvas of kCanvasWidth x kCanvasHeight; everything is placed here, gnuplot only draws.
#include <string>

#include "app/study/plot.h"

namespace app {

inline constexpr int kCanvasWidth = 960, kCanvasHeight = 540;
inline constexpr double kFontSize = 16;

/// From `reset session` to `plot`; what follows may set another terminal and `replot`. Throws base::Error (exit 1) for values that are not finite.
std::string plot_script(const Plot&);

}  // namespace app
