#pragma once
// How things fail. The user's mistakes, I/O faults and interruptions are exceptions that main turns into one line and an
// exit code; our own mistakes are assertions.
#include <stdexcept>
#include <string>

namespace base {

/// Exit codes of the program. They are part of its interface: scripts and farms read them.
enum class Exit : int {
  done = 0,
  fault = 1,            // our own mistake
  user = 2,             // shot, option or input
  unstable = 3,         // stopped for stability
  resume_refused = 4,
  io = 5,               // disk
  answer_is_no = 6,     // ran well, and the answer is no
  package = 69,         // a program that is needed is not installed
};

/// One error as the user sees it. Parts that do not apply stay empty.
struct Complaint {
  Exit code = Exit::user;
  std::string file = {};     // path as the user gave it, or "--set KEY=VALUE"
  int line = 0, column = 0;
  std::string key = {};      // dotted, such as "sim.cell"
  std::string value = {};    // as written, with its unit: "-1 m"
  std::string allowed = {};  // "must be above 0"
  std::string hint = {};     // "did you mean sim.cell?"
  std::string message = {};  // what is wrong where no key is; with a key: "unknown key"
};

/// "shots/x.toml:12:8: sim.cell = -1 m: must be above 0 (hint)" without the program's name.
std::string to_line(const Complaint&);

class Error : public std::runtime_error {
 public:
  explicit Error(Complaint c) : std::runtime_error(to_line(c)), complaint_(std::move(c)) {}
  const Complaint& complaint() const { return complaint_; }

 private:
  Complaint complaint_;
};

/// "PATH: reason", exit 5.
[[noreturn]] void throw_io(const std::string& path, const std::string& reason);
/// "PATH: reason", exit 2: a file that the user named cannot be used.
[[noreturn]] void throw_input(const std::string& path, const std::string& reason);

}  // namespace base
