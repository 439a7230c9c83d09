#pragma once
// Files that are either whole or not there: written under a temporary name in the same directory (starting with a dot),
// every write and close checked, fsync, then renamed.
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace base {

/// Calls `write` with a temporary path that has the same extension as `path`, then syncs and renames it to `path`. When `write`
/// throws or anything fails, the temporary file is removed and `path` is as it was. Throws base::Error (exit 5).
void write_atomically(const std::filesystem::path& path, const std::function<void(const std::filesystem::path& temporary)>& write);

/// The whole text, atomically.
void write_text_atomically(const std::filesystem::path& path, std::string_view text);

/// The whole file as bytes; throws base::Error (exit 2) with "PATH: reason", also for a pipe or a device. Refuses above `limit` bytes before reading.
std::string read_file(const std::filesystem::path& path, std::uintmax_t limit = std::uintmax_t(1) << 30);

}  // namespace base
