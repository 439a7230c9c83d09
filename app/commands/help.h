#pragma once
// The pages of --help.
#include <array>
#include <string>
#include <string_view>

namespace app {

/// All commands, in the order of the help page.
inline constexpr std::array<std::string_view, 12> kCommands = {"run", "simulate", "surface", "render", "plan", "cost", "verify", "list", "info",
                                                               "diff", "sheet", "params"};

/// The page of one command, or the first page for an empty name.
std::string help_text(std::string_view command);

}  // namespace app
