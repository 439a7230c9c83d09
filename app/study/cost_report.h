#pragma once
// A study of what accuracy costs as plots for slides and one page.
#include <filesystem>

#include "app/study/study.h"
#include "base/progress.h"

namespace app {

/// `out`/report.html, and every plot on it as `out`/plots/*.svg and *.png. Without gnuplot the page has no plots and `progress` a line that says so.
/// Throws base::Error (exit 5) where a file cannot be written.
void write_cost_report(const Study&, const std::filesystem::path& out, base::Progress& progress);

}  // namespace app
