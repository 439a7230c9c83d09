#pragma once
// Two results of the program side by side: images, volumes, points, or the directories of two runs. The answer is a document, of
// which `same` is the verdict and what does not apply is absent.
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>

namespace app {

/// A value fails when it differs by more than `fail`, in its own unit; two results are the same when at most `percent` of their
/// values fail. A value that is not finite always fails.
struct Tolerance {
  double fail = 0;
  double percent = 0;   // [%]
  bool exact() const { return fail == 0 && percent == 0; }
};

/// Throws base::Error (exit 2) for a file that cannot be read, and for two that are not of a kind.
nlohmann::ordered_json compare(const std::filesystem::path& a, const std::filesystem::path& b, const Tolerance&,
                               const std::optional<std::filesystem::path>& picture);

}  // namespace app
