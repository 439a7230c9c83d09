#include "base/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

namespace base {

std::string to_text(double v) {
  std::array<char, 32> buffer;
  const bool is_whole = std::abs(v) < 1e15 && v == std::floor(v);
  const auto end = is_whole ? std::to_chars(buffer.data(), buffer.data() + buffer.size(), v, std::chars_format::fixed).ptr
                            : std::to_chars(buffer.data(), buffer.data() + buffer.size(), v).ptr;
  return {buffer.data(), end};
}

std::string listed(std::span<const std::string> words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) text += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  return text;
}

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

double round_up(double value) {
  constexpr double kNear = 1e-9;   // a number that rounding has lifted over its step
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0})
    if (value <= step * decade * (1 + kNear)) return step * decade;
  return 10 * decade;
}

// Optimal string alignment: three rows of the table are enough.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    std::swap(before_last, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

namespace {

std::string lower(std::string_view word) {
  std::string letters(word);
  for (char& c : letters)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return letters;
}

}  // namespace

std::string nearest_word(std::string_view word, std::span<const std::string> candidates) {
  constexpr std::size_t kLongest = 100;  // the table is quadratic and the word is the user's
  if (word.size() > kLongest) return {};
  const std::string small = lower(word);
  std::string nearest;
  std::size_t least = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(small, lower(candidate));
    if (distance < least && distance < candidate.size()) {
      least = distance;
      nearest = candidate;
    }
  }
  constexpr std::size_t kShortest = 3;   // of what an abbreviation and the word it is of have in common
  if (least > 1 && small.size() >= kShortest)   // of two changed letters and a word that goes on, that
    for (const std::string& candidate : candidates)
      if (candidate.size() > small.size() && lower(candidate).starts_with(small)) return candidate;
  if (!nearest.empty()) return nearest;
  std::size_t most = kShortest - 1;
  for (const std::string& candidate : candidates) {
    const std::string other = lower(candidate);
    const std::size_t common = std::min(small.size(), other.size());
    if (common > most && small.compare(0, common, other, 0, common) == 0) most = common, nearest = candidate;
  }
  return nearest;
}

}  // namespace base
