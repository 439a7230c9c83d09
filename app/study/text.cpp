#include "app/study/text.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

namespace app {
namespace {

/// Number of bytes of the UTF-8 character at the start, 0 where there is none.
std::size_t character_length(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  const bool two = lead >= 0xc2 && lead < 0xe0, three = lead >= 0xe0 && lead < 0xf0, four = lead >= 0xf0 && lead < 0xf5;
  const std::size_t length = lead < 0x80 ? 1 : two ? 2 : three ? 3 : four ? 4 : 0;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((static_cast<unsigned char>(text[i]) & 0xc0) != 0x80) return 0;
  return length;
}

}  // namespace

std::string clean_text(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = character_length(std::string_view(text).substr(i));
    const auto c = static_cast<unsigned char>(text[i]);
    if (length == 0 || (c < 32 && c != '\n' && c != '\t') || c == 127) out += "\xef\xbf\xbd";
    else out += text.substr(i, length);
    i += std::max<std::size_t>(1, length);
  }
  return out;
}

std::string html_text(const std::string& text) {
  std::string out;
  for (const char c : clean_text(text)) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '"') out += "&quot;";
    else if (c == '\'') out += "&#39;";
    else out += c;
  }
  return out;
}

std::string ratio_text(double ratio) { return ratio < 10 ? fmt::format("{:.2g}", ratio) : fmt::format("{:.0f}", ratio); }

}  // namespace app
