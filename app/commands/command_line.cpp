// The only file that knows CLI11.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>

#include "app/commands/help.h"
#include "app/commands/request.h"
#include "app/version.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

constexpr std::int64_t kMostFrames = 999999;
constexpr std::int64_t kMostThreads = 4096;

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
  if (!first || !last || *last < *first) refuse("--frames " + text, "must be A or A-B, counted from 1");
  return {*first, *last};
}

std::string nearest_command(const std::string& word) {
  const std::vector<std::string> names(kCommands.begin(), kCommands.end());
  const std::string nearest = base::nearest_word(word, names);
  if (!nearest.empty()) return "did you mean " + nearest + "?";
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  return "there are " + all;
}

/// Words as CLI11 fills them in, before their form is checked.
struct Words {
  std::string frames, threads, quality, out;
};

void add_shot_options(CLI::App& command, Request& request, Words& words) {
  command.add_option("SHOT", request.subject)->required();
  command.add_option("--out", words.out);
  command.add_option("--frames", words.frames);
  command.add_option("--set", request.overrides.sets)->type_size(1)->expected(1)->allow_extra_args(false)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command.add_option("--quality", words.quality);
  command.add_option("--threads", words.threads);
  command.add_flag("--restart", request.restart);
  command.add_flag("--quiet", request.quiet);
}

void add_commands(CLI::App& program, Request& request, Words& words) {
  for (const std::string_view name : kCommands) {
    CLI::App& command = *program.add_subcommand(std::string(name));
    command.set_help_flag("-h,--help");
    command.add_flag("--json", request.json);
    if (name == "list") continue;
    if (name == "info") command.add_option("FILE", request.subject)->required();
    else if (name == "params") {
      command.add_option("TOPIC", request.subject);
      command.add_flag("--example", request.example);
    } else {
      add_shot_options(command, request, words);
      if (name == "run" || name == "render") command.add_flag("--preview", request.preview);
    }
    command.callback([&request, name] { request.command = name; });
  }
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

// CLI11's complaint as one line of ours.
[[noreturn]] void refuse(const CLI::ParseError& error, const std::string& command) {
  std::string text = error.what();
  text = text.substr(0, text.find('\n'));
  const std::string unexpected = ": ";
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr && text.find(unexpected) != std::string::npos)
    text = text.substr(text.find(unexpected) + unexpected.size()) + ": not an option of polypic " + command;
  refuse(text, "", "see polypic " + command + (command.empty() ? "" : " ") + "--help");
}

}  // namespace

Request parse_command_line(int count, const char* const* given) {
  const std::string first = count > 1 ? given[1] : "";
  if (first.empty() || first == "help") return answer(help_text(count > 2 ? given[2] : ""));
  const bool known = std::find(kCommands.begin(), kCommands.end(), first) != kCommands.end();
  if (!known && first[0] != '-') refuse(first, "no such command", nearest_command(first));

  Request request;
  Words words;
  CLI::App program;
  program.set_help_flag("-h,--help");
  bool version = false;
  program.add_flag("--version", version);
  add_commands(program, request, words);
  try {
    program.parse(count, given);
  } catch (const CLI::CallForHelp&) {
    return answer(help_text(known ? first : ""));
  } catch (const CLI::ParseError& error) {
    refuse(error, known ? first : "");
  }
  if (version) return answer(version_text());
  if (known && request.command.empty()) request.command = first;
  if (request.command.empty()) refuse(first, "no command", nearest_command(""));
  if (!words.frames.empty()) request.frames = frames_from(words.frames);
  if (!words.threads.empty()) {
    const auto threads = count_in(words.threads, kMostThreads);
    if (!threads) refuse("--threads " + words.threads, "must be a whole number from 1 to " + std::to_string(kMostThreads));
    request.threads = static_cast<int>(*threads);
  }
  if (!words.quality.empty()) request.overrides.quality = words.quality;
  if (!words.out.empty()) request.out = words.out;
  return request;
}

}  // namespace app
