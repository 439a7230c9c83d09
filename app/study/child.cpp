#include "app/study/child.h"

#include <fcntl.h>
#include <signal.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <thread>

#include "app/stages/interrupt.h"
#include "app/stages/program.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/scratch_folder.h"

namespace app {
namespace {

namespace fs = std::filesystem;

std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::size_t start = text.rfind('\n');
  if (start != std::string::npos) text = text.substr(start + 1);
  constexpr std::string_view kName = "polypic: ";
  return text.starts_with(kName) ? text.substr(kName.size()) : text;
}

}  // namespace

ChildEnd run_child(const std::vector<std::string>& words) {
  std::error_code none;
  const base::ScratchFolder scratch;
  std::vector<std::string> all = {fs::read_symlink("/proc/self/exe", none).string()};
  all.insert(all.end(), words.begin(), words.end());
  const fs::path out = scratch.path() / "out", err = scratch.path() / "err";
  const auto opened = [](const fs::path& file, int how) { return ::open(file.c_str(), how | O_CLOEXEC, 0600); };
  const std::array<int, 3> streams = {opened("/dev/null", O_RDONLY), opened(out, O_WRONLY | O_CREAT | O_TRUNC), opened(err, O_WRONLY | O_CREAT | O_TRUNC)};
  pid_t child = -1;
  const int failure = start_program(all, streams, nullptr, /*in_own_group=*/false, child);
  for (const int stream : streams) ::close(stream);
  if (failure != 0) base::throw_io(all[0], ::strerror(failure));
  int status = 0;
  bool told = false;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    if (signal_came() && !told) told = true, ::kill(child, SIGTERM);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  stop_if_signalled();
  ChildEnd end;
  if (WIFSIGNALED(status)) end.failure = "ended by signal " + std::to_string(WTERMSIG(status)) + " (" + ::strsignal(WTERMSIG(status)) + ")";
  else if (WEXITSTATUS(status) != 0) {
    end.failure = last_line(base::read_file(err));
    if (end.failure.empty()) end.failure = "ended with exit code " + std::to_string(WEXITSTATUS(status));
  }
  else end.out = base::read_file(out);
  return end;
}

}  // namespace app
