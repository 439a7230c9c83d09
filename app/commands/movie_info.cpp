#include "app/commands/movie_info.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <vector>

#include "base/error.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

struct Answer {
  int failure = 0;   // of starting it
  bool well = false;
  std::string text;  // standard output and error
};

Answer ask(std::vector<std::string> words) {
  constexpr std::size_t kLongest = 1 << 20;   // [bytes] more than this program's movies are worth is not kept
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return {errno, false, ""};
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files, ends[1], 1);
  posix_spawn_file_actions_adddup2(&files, ends[1], 2);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  Answer answer;
  answer.failure = ::posix_spawnp(&child, arguments[0], &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  ::close(ends[1]);
  char part[4096];
  for (ssize_t got; answer.failure == 0 && ((got = ::read(ends[0], part, sizeof part)) > 0 || (got < 0 && errno == EINTR));)
    if (got > 0 && answer.text.size() < kLongest) answer.text.append(part, static_cast<std::size_t>(got));
  ::close(ends[0]);
  int status = 0;
  if (answer.failure == 0)
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  answer.well = answer.failure == 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  return answer;
}

/// "24/1" -> 24.
double rate(const std::string& text) {
  const std::size_t slash = text.find('/');
  const double below = slash == std::string::npos ? 1 : std::strtod(text.c_str() + slash + 1, nullptr);
  return below > 0 ? std::strtod(text.c_str(), nullptr) / below : 0;
}

}  // namespace

Json movie_info(const std::filesystem::path& file) {
  const Answer answer =
      ask({"ffprobe", "-v", "error", "-count_packets", "-select_streams", "v:0", "-show_entries",
           "stream=codec_name,width,height,avg_frame_rate,nb_read_packets", "-of", "json", "-f", "mov", "-i", "file:" + file.string()});
  if (answer.failure != 0)
    throw base::Error({.code = base::Exit::package,
                       .file = file.string(),
                       .message = "needs ffprobe, which cannot be started: " + std::system_category().message(answer.failure)});
  const Json probed = Json::parse(answer.text, nullptr, /*allow_exceptions=*/false);
  if (!answer.well || !probed.is_object()) base::throw_input(file.string(), "not a movie that ffprobe can read");
  const Json streams = probed.value("streams", Json::array());
  if (streams.empty()) base::throw_input(file.string(), "holds no pictures");
  const Json& stream = streams[0];
  Json out = {{"codec", stream.value("codec_name", "?")}, {"width", stream.at("width")}, {"height", stream.at("height")}};
  if (const double fps = rate(stream.value("avg_frame_rate", "")); fps > 0) out["fps"] = fps;
  if (stream.contains("nb_read_packets")) out["frames"] = std::stoll(stream["nb_read_packets"].get<std::string>());
  return out;
}

}  // namespace app
