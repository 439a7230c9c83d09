#pragma once
// Runs the built program as a shell would, in a folder of its own.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "base/scratch_folder.h"

struct Outcome {
  int exit = -1;   // 128 + signal when one ended it
  std::string out, err;
  /// Lines on standard error.
  std::int64_t complaints() const { return std::count(err.begin(), err.end(), '\n'); }
};

/// Programs that are started meanwhile may hold 8 GB, whatever the machine has.
class LimitedMemory {
 public:
  LimitedMemory() {
    ::getrlimit(RLIMIT_DATA, &before_);
    const rlimit less{std::min<rlim_t>(8'000'000'000, before_.rlim_max), before_.rlim_max};
    ::setrlimit(RLIMIT_DATA, &less);
  }
  ~LimitedMemory() { ::setrlimit(RLIMIT_DATA, &before_); }
  LimitedMemory(const LimitedMemory&) = delete;
  LimitedMemory& operator=(const LimitedMemory&) = delete;

 private:
  rlimit before_{};
};

/// A test whose files lie in a folder of its own, removed at the end.
class ProgramTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directory(folder); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder / name) << text; }
  static std::string text_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    EXPECT_TRUE(in) << file;
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  /// All files below the folder, by path relative to it.
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
      names.push_back(std::filesystem::relative(entry.path(), folder).string());
    std::sort(names.begin(), names.end());
    return names;
  }

  Outcome run(std::vector<std::string> words) const { return wait_for(start(std::move(words))); }
  /// Sends `signal` as soon as `reached` holds; a program that ends before gets none.
  Outcome run_until(std::vector<std::string> words, const std::function<bool()>& reached, int signal) const {
    const pid_t child = start(std::move(words));
    while (!reached() && ::waitid(P_PID, static_cast<id_t>(child), &ended_, WEXITED | WNOHANG | WNOWAIT) == 0 && ended_.si_pid == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ::kill(child, signal);
    return wait_for(child);
  }

  const base::ScratchFolder own_folder;
  const std::filesystem::path log = own_folder.path(), folder = log / "work";

 private:
  pid_t start(std::vector<std::string> words) const {
    words.insert(words.begin(), POLYPIC_PROGRAM);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, (log / "out").c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, (log / "err").c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
    pid_t child = -1;
    EXPECT_EQ(::posix_spawn(&child, arguments[0], &actions, nullptr, arguments.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    return child;
  }
  Outcome wait_for(pid_t child) const {
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), text_of(log / "out"), text_of(log / "err")};
  }

  mutable siginfo_t ended_{};
};

/// A shot of 4000 particles that a test can afford: a column that falls over in a small box.
inline constexpr auto kSmallShot = R"(# A small column of water.
[shot]
frames = 2
fps = 24

[sim]
domain = [[0, 0, 0], [0.6, 0.3, 0.3]]
cell = 0.03
transfer = "polypic"
kernel = "linear"
modes = 8

[[body]]
name = "column"
shape = { box = [[0, 0, 0], [0.27, 0.3, 0.18]] }
material = "water"

[[effect]]
kind = "gravity"

[render]
width = 160
height = 90
spp = 1
)";
