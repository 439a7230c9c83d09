#include "base/error.h"

namespace base {
namespace {

/// What the user wrote may be anything; a line shows the beginning of it.
std::string clipped(const std::string& text) {
  constexpr std::size_t kLongest = 1000;   // characters
  return text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
}

}  // namespace

std::string to_line(const Complaint& c) {
  std::string place = clipped(c.file);
  if (c.line > 0) place += ":" + std::to_string(c.line);
  if (c.line > 0 && c.column > 0) place += ":" + std::to_string(c.column);

  std::string line = place;
  const auto part = [&line](const std::string& text) {
    if (text.empty()) return;
    if (!line.empty()) line += ": ";
    line += text;
  };
  part(c.key.empty() || c.value.empty() ? clipped(c.key + c.value) : clipped(c.key) + " = " + clipped(c.value));
  part(c.message);
  part(c.allowed);
  if (!c.hint.empty()) line += " (" + c.hint + ")";
  for (char& letter : line)  // one line, whatever a name or a value holds
    if (static_cast<unsigned char>(letter) < 0x20 || letter == 0x7f) letter = ' ';
  return line;
}

void throw_io(const std::string& path, const std::string& reason) {
  throw Error({.code = Exit::io, .file = path, .message = reason});
}

void throw_input(const std::string& path, const std::string& reason) {
  throw Error({.code = Exit::user, .file = path, .message = reason});
}

}  // namespace base
