#include "app/stages/program.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

#include "base/error.h"

namespace app {
namespace {

std::string reason(int code) { return std::system_category().message(code); }

/// Two ends, each closed at the end if it has not been before.
struct Pipe {
  int read = -1, write = -1;
  explicit Pipe(const std::string& made) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) base::throw_io(made, reason(errno));
    read = ends[0], write = ends[1];
  }
  ~Pipe() { close(read), close(write); }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  static void close(int& end) {
    if (end >= 0) ::close(end);
    end = -1;
  }
};

std::string last_line(int descriptor) {
  char text[4096];
  const off_t end = ::lseek(descriptor, 0, SEEK_END);
  const off_t from = end > static_cast<off_t>(sizeof text) ? end - static_cast<off_t>(sizeof text) : 0;
  const ssize_t got = ::pread(descriptor, text, sizeof text, from);
  std::string log(text, got > 0 ? static_cast<std::size_t>(got) : 0);
  while (!log.empty() && (log.back() == '\n' || log.back() == '\r')) log.pop_back();
  const std::size_t start = log.find_last_of("\r\n");
  return start == std::string::npos ? log : log.substr(start + 1);
}

}  // namespace

int start_program(std::vector<std::string> words, const std::array<int, 3>& streams, char* const* environment, bool in_own_group, pid_t& child) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  char* const* const given = arguments.data();
  const pid_t parent = ::getpid();
  volatile int failure = 0;   // the child runs in this memory until it is another program
  child = ::vfork();
  if (child < 0) return errno;
  if (child == 0) {
    if (in_own_group) ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    bool ready = ::getppid() == parent;
    for (int stream = 0; stream < 3; ++stream) ready = ready && ::dup2(streams[static_cast<std::size_t>(stream)], stream) >= 0;
    if (ready) ::execvpe(given[0], given, environment ? environment : environ);
    failure = errno;
    ::_exit(127);
  }
  if (failure == 0) return 0;
  ::waitpid(child, nullptr, 0);
  return failure;
}

bool write_all(int pipe, const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t written = ::write(pipe, bytes.data() + at, bytes.size() - at);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    at += static_cast<std::size_t>(written);
  }
  return true;
}

ProgramEnd run_program(std::vector<std::string> words, const std::string& made, const std::function<void(int)>& feed) {
  const int log = ::memfd_create("log", MFD_CLOEXEC);
  if (log < 0) base::throw_io(made, reason(errno));
  Pipe pipe(made);
  pid_t child = 0;
  const int failure = start_program(std::move(words), {pipe.read, log, log}, nullptr, /*in_own_group=*/true, child);
  Pipe::close(pipe.read);
  int status = 0;
  if (failure == 0) {
    feed(pipe.write);
    Pipe::close(pipe.write);
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  }
  ProgramEnd end{.started = failure == 0, .well = failure == 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0,
                 .said = failure != 0 ? reason(failure) : last_line(log)};
  ::close(log);
  return end;
}

}  // namespace app
