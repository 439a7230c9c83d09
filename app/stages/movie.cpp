#include "app/stages/movie.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <string>
#include <system_error>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

namespace fs = std::filesystem;

std::string reason(int code) { return std::system_category().message(code); }

/// The images one after another into a pipe. Returns what is wrong with one that cannot be read, or nothing; that nobody reads the
/// pipe any more is the reader's to explain.
std::string feed(int pipe, const std::vector<fs::path>& images) try {
  for (const fs::path& image : images) {
    const std::string bytes = base::read_file(image);
    for (std::size_t at = 0; at < bytes.size();) {
      const ssize_t written = ::write(pipe, bytes.data() + at, bytes.size() - at);
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return {};
      at += static_cast<std::size_t>(written);
    }
  }
  return {};
} catch (const base::Error& e) {
  return e.what();
}

/// Two ends, each closed at the end if it has not been before.
struct Pipe {
  int read = -1, write = -1;
  explicit Pipe(const fs::path& made) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) base::throw_io(made.string(), reason(errno));
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

/// Starts a program that reads `input`, its messages going to `log`. In a process group of its own: a Ctrl-C meant for us lets it
/// finish. Returns 0, or what kept it from starting.
int start(std::vector<std::string>& words, int input, int log, pid_t& child) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, input, 0);
  posix_spawn_file_actions_adddup2(&files, log, 1);
  posix_spawn_file_actions_adddup2(&files, log, 2);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const int failure = ::posix_spawnp(&child, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  return failure;
}

/// Runs a program to its end, with the images on its standard input.
void run_program(std::vector<std::string> words, const std::vector<fs::path>& images, const fs::path& made) {
  const int log = ::memfd_create("log", MFD_CLOEXEC);
  if (log < 0) base::throw_io(made.string(), reason(errno));
  Pipe pipe(made);
  pid_t child = 0;
  const int failure = start(words, pipe.read, log, child);
  Pipe::close(pipe.read);
  int status = 0;
  std::string missing;
  if (failure == 0) {
    missing = feed(pipe.write, images);
    Pipe::close(pipe.write);
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  }
  const bool well = failure == 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  const std::string said = failure != 0 ? reason(failure) : last_line(log);
  ::close(log);
  if (!missing.empty()) base::throw_io(made.string(), missing);
  if (!well) base::throw_io(made.string(), words[0] + ": " + (said.empty() ? "failed" : said) + " (the images are complete)");
}

}  // namespace

void write_movie(const fs::path& movie, const std::vector<fs::path>& images, double fps, int threads) {
  base::write_atomically(movie, [&](const fs::path& temporary) {
    // -xerror: without it a movie that the disk had no room for is a success
    run_program({"ffmpeg", "-nostdin", "-loglevel", "error", "-xerror", "-y", "-threads", std::to_string(threads), "-framerate", base::to_text(fps),
                 "-f", "image2pipe", "-c:v", "png", "-i", "pipe:0", "-vf",
                 "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv", "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p",
                 "-color_primaries", "bt709", "-color_trc", "bt709", "-colorspace", "bt709", "-color_range", "tv", "-movflags", "+faststart",
                 "-threads", std::to_string(threads), temporary.string()},
                images, movie);
  });
}

}  // namespace app
