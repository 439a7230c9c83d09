// The only file that knows CLI11.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <limits>

#include <fmt/format.h>

#include "app/commands/help.h"
#include "app/commands/request.h"
#include "app/version.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

constexpr std::int64_t kMostFrames = 1000000;   // as shot.frames
constexpr std::int64_t kMostThreads = 4096, kMostRepeats = 1000;

[[noreturn]] void refuse(const std::string& what, const std::string& allowed, const std::string& hint = "") {
  throw base::Error({.code = base::Exit::user, .file = what, .hint = hint, .message = allowed});
}

std::optional<std::int64_t> count_in(std::string_view text, std::int64_t most) {
  std::int64_t value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size() || value < 1 || value > most) return {};
  return value;
}

FrameRange frames_from(const std::string& text) {
  const std::size_t dash = text.find('-');
  const auto first = count_in(text.substr(0, dash), kMostFrames);
  const auto last = dash == std::string::npos ? first : count_in(text.substr(dash + 1), kMostFrames);
  if (!first || !last) refuse("--frames " + text, fmt::format("must be A or A-B, from 1 to {}", kMostFrames));
  if (*last < *first) refuse("--frames " + text, "ends before it begins", fmt::format("did you mean {}-{}?", *last, *first));
  return {*first, *last};
}

int threads_from(const std::string& text) {
  const auto threads = count_in(text, kMostThreads);
  if (!threads) refuse("--threads " + text, "must be a whole number from 1 to " + std::to_string(kMostThreads));
  return static_cast<int>(*threads);
}

int repeats_from(const std::string& text) {
  const auto repeats = count_in(text, kMostRepeats);
  if (!repeats) refuse("--repeats " + text, "must be a whole number from 1 to " + std::to_string(kMostRepeats));
  return static_cast<int>(*repeats);
}

std::string nearest_command(const std::string& word) {
  const std::vector<std::string> names(kCommands.begin(), kCommands.end());
  const std::string nearest = base::nearest_word(word, names);
  if (!nearest.empty()) return "did you mean " + nearest + "?";
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  return "there are " + all;
}

double number_from(const std::string& option, const std::string& text, double most) {
  double value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = failure == std::errc() && end == text.data() + text.size();
  if (!whole || !(value >= 0 && value <= most))
    refuse(option + " " + text, most < 1000 ? "must be a number from 0 to " + base::to_text(most) : "must be a number, 0 or above");
  return value;
}

/// Words as CLI11 fills them in, before their form is checked.
struct Words {
  std::optional<std::string> repeats, frames, threads, quality, out, graph, fail, fail_percent;
};

/// Options that may be given again and again, with one value each.
void add_repeated(CLI::App& command, const std::string& name, std::vector<std::string>& values) {
  command.add_option(name, values)->type_size(1)->expected(1)->allow_extra_args(false)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_shot_options(CLI::App& command, Request& request, Words& words) {
  command.add_option("SHOT", request.subject)->required();
  command.add_option("--out", words.out);
  command.add_option("--frames", words.frames);
  add_repeated(command, "--set", request.overrides.sets);
  command.add_option("--quality", words.quality);
  command.add_option("--threads", words.threads);
  if (command.get_name() != "plan") command.add_flag("--restart", request.restart), command.add_flag("--no-report", request.no_report);
  command.add_flag("--quiet", request.quiet);
}

void add_diff_options(CLI::App& command, Request& request, Words& words) {
  command.add_option("A", request.subject)->required();
  command.add_option("B", request.other)->required();
  command.add_option("--fail", words.fail);
  command.add_option("--fail-percent", words.fail_percent);
  command.add_option("--out", words.out);
}

void add_sheet_options(CLI::App& command, Request& request, Words& words) {
  command.add_option("RUN", request.subjects)->required()->expected(-1);
  command.add_option("--frames", words.frames);
  command.add_option("--out", words.out);
}

void add_cost_options(CLI::App& command, Request& request, Words& words) {
  command.add_option("SUBJECT", request.subject)->required();
  add_repeated(command, "--vary", request.vary);
  add_repeated(command, "--refine", request.refine);
  command.add_option("--error", request.error);
  add_repeated(command, "--set", request.overrides.sets);
  command.add_option("--quality", words.quality);
  command.add_option("--frames", words.frames);
  command.add_option("--repeats", words.repeats);
  command.add_option("--out", words.out);
  command.add_option("--threads", words.threads);
  command.add_flag("--single", request.single);
  command.add_flag("--dry-run", request.dry_run);
  command.add_flag("--quiet", request.quiet);
}

void add_verify_options(CLI::App& command, Request& request, Words& words) {
  command.add_option("CASE", request.subjects)->expected(0, -1);
  command.add_flag("--quick", request.quick);
  command.add_flag("--list", request.listing);
  command.add_option("--threads", words.threads);
  command.add_option("--out", words.out);
  command.add_flag("--quiet", request.quiet);
}

void add_options(CLI::App& command, const std::string& name, Request& request, Words& words) {
  command.set_help_flag("-h,--help");
  command.add_flag("--json", request.json);
  if (name == "list") return;
  if (name == "info") command.add_option("FILE", request.subject)->required();
  else if (name == "diff") add_diff_options(command, request, words);
  else if (name == "sheet") add_sheet_options(command, request, words);
  else if (name == "cost") add_cost_options(command, request, words);
  else if (name == "verify") add_verify_options(command, request, words);
  else if (name == "params") {
    command.add_option("TOPIC", request.subject);
    command.add_flag("--example", request.example);
  } else {
    add_shot_options(command, request, words);
    if (name == "plan") command.add_option("--graph", words.graph);
    if (name == "run" || name == "render") command.add_flag("--preview", request.preview);
  }
}

/// The words with quotes where a shell needs them.
std::string shell_line(int count, const char* const* words) {
  std::string line = "polypic";
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    const bool plain =
        !word.empty() && word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=,:+@%") == std::string::npos;
    std::string quoted;
    for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += " " + (plain ? word : "'" + quoted + "'");
  }
  return line;
}

/// An option that another makes idle says so.
void refuse_idle_options(const Request& request) {
  const auto refuse_beside = [](const std::string& option, const std::string& other, const std::string& why) {
    refuse(option, "has no effect with " + other + ": " + why);
  };
  const std::pair<const char*, bool> of_studies[] = {{"--vary", !request.vary.empty()}, {"--refine", !request.refine.empty()},
                                                     {"--error", !request.error.empty()}, {"--repeats", request.repeats.has_value()},
                                                     {"--frames", request.frames.has_value()}, {"--out", request.out.has_value()},
                                                     {"--dry-run", request.dry_run}};
  for (const auto& [option, is_given] : of_studies)
    if (request.single && is_given) refuse_beside(option, "--single", "the problem runs once, as --set makes it");
  if (request.example && !request.subject.empty()) refuse(request.subject, "has no effect with --example: it is a complete shot");
  if (request.json && request.example) refuse_beside("--json", "--example", "a shot is TOML");
  if (request.json && request.dry_run) refuse_beside("--json", "--dry-run", "nothing is measured");
}

Request answer(std::string text) {
  Request request;
  request.text = std::move(text);
  return request;
}

std::string version_text() {
  const std::string commit = kCommit;
  return "polypic " + std::string(kVersion) + (commit.empty() ? "" : " (" + commit + ")") + "\n";
}

/// The option that was meant by a word that is none; empty for other words.
std::string nearest_option(const std::string& word, const CLI::App& command) {
  if (!word.starts_with("--")) return {};
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  std::erase_if(names, [&](const std::string& name) { return name == word; });
  return base::nearest_word(word.substr(0, word.find('=')), names);
}

// CLI11's complaint in our words.
[[noreturn]] void refuse(const CLI::ParseError& error, const CLI::App& command, const std::string& name) {
  const std::string text = error.what(), hint = "see polypic " + name + " --help";
  if (!command.remaining().empty()) {
    const std::string word = command.remaining().front();
    if (const std::string meant = nearest_option(word, command); !meant.empty())
      refuse(word, "not an option of polypic " + name, "did you mean " + meant + "?");
    refuse(word, (word.starts_with('-') ? "not an option of polypic " : "is one word too many for polypic ") + name, hint);
  }
  if (name == "cost" && dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) refuse("cost", "needs a shot or a problem", hint);
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    const std::string option = text.substr(0, text.find(':'));
    const CLI::Option* const known = command.get_option_no_throw(option);
    if (known != nullptr && known->count() > 1) refuse(option, "given twice", hint);
    refuse(option, "needs one value", hint);
  }
  refuse("", text.substr(0, text.find('\n')), hint);
}

}  // namespace

Request parse_command_line(int count, const char* const* given) {
  const std::string first = count > 1 ? given[1] : "";
  if (first.empty() || first == "help" || first == "--help" || first == "-h") return answer(help_text(count > 2 ? given[2] : ""));
  if (first == "--version") return answer(version_text());
  if (first[0] == '-') refuse(first, "not an option of polypic", "see polypic --help");
  if (std::find(kCommands.begin(), kCommands.end(), first) == kCommands.end()) refuse(first, "no such command", nearest_command(first));

  Request request;
  request.command = first;
  Words words;
  CLI::App command("", first);
  add_options(command, first, request, words);
  try {
    command.parse(count - 1, given + 1);
  } catch (const CLI::CallForHelp&) {
    return answer(help_text(first));
  } catch (const CLI::ParseError& error) {
    refuse(error, command, first);
  }
  request.overrides.quality = words.quality;
  if (words.frames) request.frames = frames_from(*words.frames);
  if (first == "sheet" && request.frames && request.frames->last != request.frames->first)
    refuse("--frames " + *words.frames, "must be one frame: a sheet shows one moment");
  if (words.threads) request.threads = threads_from(*words.threads);
  if (words.repeats) request.repeats = repeats_from(*words.repeats);
  request.line = shell_line(count, given);
  if (words.fail) request.fail = number_from("--fail", *words.fail, std::numeric_limits<double>::max());
  if (words.fail_percent) request.fail_percent = number_from("--fail-percent", *words.fail_percent, 100);
  if (words.out && words.out->empty())
    refuse("--out", first == "diff" || first == "sheet" ? "needs the name of a .png file" : "needs the name of a directory");
  if (words.out) request.out = *words.out;
  if (first == "diff" && request.out && request.out->extension() != ".png") refuse("--out " + *words.out, "must end in .png");
  if (words.graph && words.graph->empty()) refuse("--graph", "needs the name of an .svg file");
  if (words.graph) request.graph = *words.graph;
  if (request.graph && request.graph->extension() != ".svg") refuse("--graph " + *words.graph, "must end in .svg");
  refuse_idle_options(request);
  return request;
}

}  // namespace app
