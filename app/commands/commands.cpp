#include "app/commands/commands.h"

#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <new>
#include <nlohmann/json.hpp>

#include "app/stages/interrupt.h"
#include "base/error.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

/// Returns the exit code.
base::Exit carry_out(const Request& request) {
  if (!request.text.empty()) std::fputs(request.text.c_str(), stdout);
  else if (request.command == "list") list(request);
  else if (request.command == "info") info(request);
  else if (request.command == "plan") plan(request);
  else if (request.command == "diff") return diff(request) ? base::Exit::done : base::Exit::answer_is_no;
  else if (request.command == "cost") return cost(request) ? base::Exit::done : base::Exit::answer_is_no;
  else if (request.command == "verify") return verify(request) ? base::Exit::done : base::Exit::answer_is_no;
  else if (request.command == "sheet") sheet(request);
  else if (request.command == "params") params(request);
  else film(request);
  return base::Exit::done;
}

// The line for people on standard error, and with --json the same for programs on standard output.
int fail(const base::Complaint& complaint, int code, bool json) {
  std::fprintf(stderr, "polypic: %s\n", base::to_line(complaint).c_str());
  if (!json) return code;
  Json error = {{"code", code}};
  const std::pair<const char*, const std::string&> texts[] = {{"file", complaint.file}, {"key", complaint.key}, {"value", complaint.value},
                                                              {"allowed", complaint.allowed}, {"hint", complaint.hint},
                                                              {"message", complaint.message}};
  for (const auto& [name, text] : texts)
    if (!text.empty()) error[name] = text;
  if (complaint.line > 0) error["line"] = complaint.line;
  if (complaint.column > 0) error["column"] = complaint.column;
  std::printf("%s\n", Json{{"error", error}}.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  return code;
}

bool asks_for_json(int count, const char* const* words) {
  for (int i = 1; i < count; ++i)
    if (std::strcmp(words[i], "--json") == 0) return true;
  return false;
}

}  // namespace

bool has_lost_its_reader(int stream) {
  pollfd asked{stream, POLLOUT, 0};
  return ::poll(&asked, 1, 0) == 1 && (asked.revents & POLLERR) != 0;
}

int run_command_line(int count, const char* const* words) {
  const bool json = asks_for_json(count, words);
  const auto fault = [&](const std::string& message) { return fail({.message = message}, static_cast<int>(base::Exit::fault), json); };
  try {
    const base::Exit code = carry_out(parse_command_line(count, words));
    if ((std::fflush(stdout) != 0 || std::ferror(stdout)) && !has_lost_its_reader(STDOUT_FILENO))
      return fail({.file = "standard output", .message = "cannot be written"}, static_cast<int>(base::Exit::io), false);
    return static_cast<int>(code);
  } catch (const base::Error& e) {
    return fail(e.complaint(), static_cast<int>(e.complaint().code), json);
  } catch (const Interrupted& e) {
    return fail({.message = e.what()}, 128 + e.signal(), json);
  } catch (const std::bad_alloc&) {
    return fail({.message = "out of memory"}, static_cast<int>(base::Exit::user), json);
  } catch (const std::exception& e) {
    return fault(std::string("a fault of the program: ") + e.what());
  }
}

}  // namespace app
