#pragma once
// Numbers and words as people read them.
#include <concepts>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace base {

/// The shortest decimal that reads back as the same double: "0.02", "1e-06", "1000000".
std::string to_text(double);

/// "1 frame", "2 frames".
std::string count_of(std::integral auto n, std::string_view what) { return std::to_string(n) + " " + std::string(what) + (n == 1 ? "" : "s"); }

/// "a", "a and b", "a, b and c".
std::string listed(std::span<const std::string> words);

/// What a path ends in, in small letters: ".png" of "A.PNG".
std::string extension_of(const std::filesystem::path&);

/// To 1, 2 or 5 times a power of ten, as scales end; of a number above 0.
double round_up(double);

/// Edits (insert, delete, replace, swap of neighbours) that turn one word into the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The candidate nearest to a misspelt word, be it in small letters or in large ones, or else one that is the word's beginning, or whose beginning
/// the word is ("sim" and "simulation"); empty when none is near enough to be meant.
std::string nearest_word(std::string_view word, std::span<const std::string> candidates);

}  // namespace base
