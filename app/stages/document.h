#pragma once
// JSON documents of a run's directory, read as what a stranger may have put there and written so that any program reads them.
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace app {

inline constexpr std::uintmax_t kLargestRecord = std::uintmax_t(1) << 20;      // [bytes] of one frame and stage
inline constexpr std::uintmax_t kLargestDocument = std::uintmax_t(1) << 27;    // [bytes] of a film: run.json, the record of a movie

/// Throws base::Error (exit 2) for a file that is no JSON, above `limit` bytes or nested deeper than any of ours: parsed, a byte can
/// take a hundred.
nlohmann::ordered_json read_document(const std::filesystem::path&, std::uintmax_t limit);

/// Indented, with a line's end; a name that is no UTF-8 is shown with replacement characters.
std::string document_text(const nlohmann::ordered_json&);

}  // namespace app
