#pragma once
// report.html of a run: what it conserved, what it cost, how it was made, and its frames at a glance.
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "app/shot/shot.h"
#include "app/stages/folder.h"
#include "base/progress.h"

namespace app {

/// From run.json's content and the pictures that are there; `command` is the line that was typed, or empty. Atomic. Without gnuplot the page has no
/// plots and `progress` a line that says so. Throws base::Error (exit 5) where the page cannot be written.
void write_run_report(const Folder&, const Shot&, const nlohmann::ordered_json& run, const std::string& command, base::Progress&);

}  // namespace app
