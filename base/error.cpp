#include "base/error.h"

namespace base {

std::string to_line(const Complaint& c) {
  std::string place = c.file;
  if (c.line > 0) place += ":" + std::to_string(c.line);
  if (c.line > 0 && c.column > 0) place += ":" + std::to_string(c.column);

  std::string line = place;
  const auto part = [&line](const std::string& text) {
    if (text.empty()) return;
    if (!line.empty()) line += ": ";
    line += text;
  };
  part(c.key.empty() || c.value.empty() ? c.key + c.value : c.key + " = " + c.value);
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
