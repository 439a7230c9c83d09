#include "app/stages/lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <ctime>
#include <system_error>
#include <thread>
#include <utility>

#include "base/error.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr milliseconds kPause{20};
constexpr int kTries = 250;   // 5 s: longer than anyone who is not at work holds a directory alone

[[noreturn]] void fail(const fs::path& file) { base::throw_io(file.parent_path().string(), std::system_category().message(errno)); }

/// The descriptor of the lock's file, locked; -1 when another holds it.
int open_locked(const fs::path& file, int kind) {
  while (true) {
    const int descriptor = ::open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    if (descriptor < 0) fail(file);
    if (::flock(descriptor, kind | LOCK_NB) != 0) {
      const int reason = errno;
      ::close(descriptor);
      errno = reason;
      if (reason != EWOULDBLOCK) fail(file);   // such as a disk without locks
      return -1;
    }
    struct stat status {};
    if (::fstat(descriptor, &status) == 0 && status.st_nlink > 0) return descriptor;
    ::close(descriptor);   // its former owner removed it meanwhile: a lock on nothing
  }
}

// Who holds it, for people. That it cannot be written holds nobody up.
void sign(int descriptor) {
  std::array<char, 256> host{}, time{};
  ::gethostname(host.data(), host.size() - 1);
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  std::strftime(time.data(), time.size(), "%Y-%m-%d %H:%M:%S UTC", &utc);
  const std::string owner = "process " + std::to_string(::getpid()) + " on " + host.data() + " since " + time.data();
  if (::ftruncate(descriptor, 0) == 0) [[maybe_unused]] const auto written = ::pwrite(descriptor, owner.data(), owner.size(), 0);
}

}  // namespace

std::optional<Lock> Lock::try_take(const fs::path& file) {
  const int descriptor = open_locked(file, LOCK_EX);
  if (descriptor < 0) return {};
  sign(descriptor);
  return Lock(file, descriptor);
}

Lock Lock::take(const fs::path& file, const std::function<void()>& meanwhile) {
  while (true) {
    if (auto lock = try_take(file)) return std::move(*lock);
    meanwhile();
    std::this_thread::sleep_for(kPause);
  }
}

Lock::Lock(Lock&& other) noexcept : file_(std::move(other.file_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

Lock::~Lock() {
  if (descriptor_ < 0) return;
  ::unlink(file_.c_str());   // while it is held: who opened it meanwhile sees that it is gone
  ::close(descriptor_);
}

std::string owner_of(const fs::path& lock) {
  std::array<char, 512> text{};
  const int descriptor = ::open(lock.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  const ssize_t got = descriptor < 0 ? 0 : ::pread(descriptor, text.data(), text.size() - 1, 0);
  if (descriptor >= 0) ::close(descriptor);
  return got > 0 ? std::string(text.data(), static_cast<std::size_t>(got)) : "another process";
}

FolderLock::FolderLock(const Folder& folder) : folder_(folder) {
  std::error_code failure, none;
  fs::path made = fs::absolute(folder.root(), failure).lexically_normal();   // fails where the working directory is gone
  if (failure) base::throw_io(folder.root().string(), "the working directory: " + failure.message());
  for (; made.has_relative_path() && fs::symlink_status(made, none).type() == fs::file_type::not_found; made = made.parent_path())
    made_.push_back(made);
  fs::create_directories(folder.root(), failure);
  if (failure == std::errc::file_exists) base::throw_io(folder.root().string(), "is a link to nothing");
  if (failure) base::throw_io(folder.root().string(), failure.message());
  for (int i = 0; i < kTries && descriptor_ < 0; ++i) {
    if (i > 0) std::this_thread::sleep_for(kPause);
    descriptor_ = open_locked(folder.lock(), LOCK_EX);
    alone_ = descriptor_ >= 0;
    if (!alone_) descriptor_ = open_locked(folder.lock(), LOCK_SH);
  }
  if (descriptor_ < 0) base::throw_input(folder.root().string(), "in use by " + owner_of(folder.lock()));
  sign(descriptor_);
  if (alone_) folder_.remove_leftovers();
}

void FolderLock::let_others_in() {
  alone_ = false;
  while (::flock(descriptor_, LOCK_SH) != 0)
    if (errno != EINTR) fail(folder_.lock());
}

FolderLock::~FolderLock() {
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) {
    std::error_code none;
    folder_.remove_leftovers();
    fs::remove(folder_.lock(), none);
    for (const fs::path& made : made_) fs::remove(made, none);   // goes only where nothing came of it: a run that failed leaves no trace
  }
  ::close(descriptor_);
}

}  // namespace app
