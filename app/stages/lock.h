#pragma once
// Who works where in a run's directory. Locks are flock()s on files whose names start with a dot: the system frees them when their
// owner ends, however it ends, so a file that is left behind holds nobody up: it is taken over. Each file says who holds it.
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/stages/folder.h"

namespace app {

/// One file, held by one owner until the end of this object; the file is gone then.
class Lock {
 public:
  /// Empty when another holds it. Throws base::Error (exit 5) where there can be none.
  static std::optional<Lock> try_take(const std::filesystem::path& file);
  /// Waits for it, calling `meanwhile` (which may throw) several times a second.
  static Lock take(const std::filesystem::path& file, const std::function<void()>& meanwhile);
  Lock(Lock&& other) noexcept;
  Lock& operator=(Lock&&) = delete;
  ~Lock();

 private:
  Lock(std::filesystem::path file, int descriptor) : file_(std::move(file)), descriptor_(descriptor) {}
  std::filesystem::path file_;
  int descriptor_;
};

/// "process 77 on HOST since 2026-01-31 12:00:00 UTC", as the lock's file says; "another process" when it does not.
std::string owner_of(const std::filesystem::path& lock);

/// Held as long as a process works in a directory. Who finds nobody else there holds it alone at first, may change what the
/// directory is for (another shot, --restart) and lets others in then; they work side by side with it.
class FolderLock {
 public:
  /// Makes the directory. Throws base::Error: exit 5 where it cannot be made, 2 where somebody holds it alone for long.
  explicit FolderLock(const Folder&);
  /// The last to leave removes what is left over, and the directory itself when nothing came of it.
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  bool alone() const { return alone_; }
  void let_others_in();

 private:
  const Folder folder_;
  std::vector<std::filesystem::path> made_;   // directories that were not there before, innermost first
  int descriptor_ = -1;
  bool alone_ = false;
};

}  // namespace app
