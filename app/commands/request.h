#pragma once
// What a command line asks for, checked for form but not yet carried out.
#include <filesystem>
#include <optional>
#include <string>

#include "app/shot/shot.h"
#include "app/stages/film.h"

namespace app {

struct Request {
  std::string command;              // "run", "list" ...; empty when `text` answers the call
  std::string subject;              // SHOT, FILE or TOPIC as given
  Overrides overrides;
  std::optional<std::filesystem::path> out;
  std::optional<FrameRange> frames;
  std::optional<std::filesystem::path> graph;   // plan: where the picture of the passes goes
  std::optional<int> threads;
  bool restart = false, preview = false, quiet = false, json = false, example = false;
  std::vector<std::string> vary, refine;    // cost: "KEY=V1,V2"
  std::string error;                // cost: the kind that ranks
  std::optional<int> repeats;       // cost: runs of each variant
  bool single = false;              // cost: a problem, once, here
  bool dry_run = false;             // cost: what would be run, and nothing else
  bool no_report = false;           // of films: no report.html
  std::string line;                 // the command line, as a shell takes it
  bool quick = false, listing = false;   // verify: without the long cases; names only
  std::vector<std::string> subjects;   // sheet: runs or pictures; verify: cases
  std::string other;                // diff: the second file
  double fail = 0, fail_percent = 0;
  std::string text;                 // --help and --version: what to print, and nothing else to do
};

/// Throws base::Error (exit 2) for anything that is not in the lists of --help.
Request parse_command_line(int count, const char* const* words);

}  // namespace app
