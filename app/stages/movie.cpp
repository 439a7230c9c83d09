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

/// A folder of links numbered without a gap, which is what ffmpeg reads as a sequence. Gone at the end.
class Sequence {
 public:
  Sequence(const fs::path& movie, const std::vector<fs::path>& images)
      : folder_(movie.parent_path() / ("." + movie.stem().string() + ".tmp" + std::to_string(::getpid()) + "-0.links")) {
    try {
      fs::create_directory(folder_);
      for (std::size_t i = 0; i < images.size(); ++i) fs::create_symlink(fs::absolute(images[i]), folder_ / (std::to_string(i) + ".png"));
    } catch (const fs::filesystem_error& e) {
      base::throw_io(folder_.string(), e.code().message());
    }
  }
  ~Sequence() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  Sequence(const Sequence&) = delete;
  Sequence& operator=(const Sequence&) = delete;
  std::string pattern() const {   // a percent sign in the path is no pattern of ours
    std::string text;
    for (const char letter : folder_.string()) text += letter == '%' ? "%%" : std::string(1, letter);
    return text + "/%d.png";
  }

 private:
  fs::path folder_;
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

/// Runs a program to its end, its messages kept apart. In a process group of its own: a Ctrl-C meant for us lets it finish.
void run_program(std::vector<std::string> words, const fs::path& made) {
  const int log = ::memfd_create("log", MFD_CLOEXEC);
  if (log < 0) base::throw_io(made.string(), reason(errno));
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files, log, 1);
  posix_spawn_file_actions_adddup2(&files, log, 2);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);

  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int failure = ::posix_spawnp(&child, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  int status = 0;
  if (failure == 0)
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  const bool well = failure == 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  const std::string said = failure != 0 ? reason(failure) : last_line(log);
  ::close(log);
  if (!well) base::throw_io(made.string(), words[0] + ": " + (said.empty() ? "failed" : said) + " (the images are complete)");
}

}  // namespace

void write_movie(const fs::path& movie, const std::vector<fs::path>& images, double fps, int threads) {
  const Sequence sequence(movie, images);
  base::write_atomically(movie, [&](const fs::path& temporary) {
    // -xerror: without it a movie that the disk had no room for is a success
    run_program({"ffmpeg", "-nostdin", "-loglevel", "error", "-xerror", "-y", "-threads", std::to_string(threads), "-framerate", base::to_text(fps),
                 "-start_number", "0", "-i", sequence.pattern(), "-vf",
                 "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv", "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p",
                 "-color_primaries", "bt709", "-color_trc", "bt709", "-colorspace", "bt709", "-color_range", "tv", "-movflags", "+faststart",
                 "-threads", std::to_string(threads), temporary.string()},
                movie);
  });
}

}  // namespace app
