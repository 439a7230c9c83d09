#include "base/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <new>
#include <system_error>
#include <utility>

#include "base/error.h"

namespace base {
namespace {

std::string reason(int code) { return std::system_category().message(code); }

/// An open file that closes itself; close() is for when its result matters.
class File {
 public:
  explicit File(int descriptor) : descriptor_(descriptor) {}
  ~File() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int descriptor() const { return descriptor_; }
  bool is_open() const { return descriptor_ >= 0; }
  bool close() { return ::close(std::exchange(descriptor_, -1)) == 0; }

 private:
  int descriptor_;
};

/// Removes the file at the end unless it was renamed away.
struct Removal {
  std::filesystem::path path;
  ~Removal() {
    std::error_code ignored;
    if (!path.empty()) std::filesystem::remove(path, ignored);
  }
};

// Creates an empty file that nobody else has: other processes, and other hosts on a shared disk, may be at the same frame.
std::filesystem::path create_temporary(const std::filesystem::path& path) {
  static std::atomic<unsigned> count = 0;
  const std::string start = "." + path.stem().string() + ".tmp" + std::to_string(::getpid()) + "-";
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const auto temporary = path.parent_path() / (start + std::to_string(count++) + path.extension().string());
    File file(::open(temporary.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666));
    if (file.is_open()) return temporary;
    if (errno != EEXIST) throw_io(path.string(), reason(errno));
  }
  throw_io(path.string(), "no free temporary name beside it");
}

void sync(const std::filesystem::path& what, const std::filesystem::path& named) {
  File file(::open(what.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.is_open()) throw_io(named.string(), errno == ENOENT ? "nothing was written" : reason(errno));
  if (::fsync(file.descriptor()) != 0 && errno != EINVAL) throw_io(named.string(), reason(errno));  // EINVAL: a disk that cannot sync
  if (!file.close()) throw_io(named.string(), reason(errno));
}

}  // namespace

void write_atomically(const std::filesystem::path& path, const std::function<void(const std::filesystem::path&)>& write) {
  Removal removal{create_temporary(path)};
  const std::filesystem::path temporary = removal.path;
  try {
    write(temporary);
  } catch (const Error& e) {   // libraries tell what they were given
    Complaint complaint = e.complaint();
    for (std::string* text : {&complaint.file, &complaint.message})
      for (const auto& [from, to] :
           {std::pair{temporary.string(), path.string()}, std::pair{temporary.filename().string(), path.filename().string()}})
        for (std::size_t at; (at = text->find(from)) != std::string::npos;) text->replace(at, from.size(), to);
    throw Error(std::move(complaint));
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    throw_io(path.string(), e.what());
  }
  sync(temporary, path);
  if (::rename(temporary.c_str(), path.c_str()) != 0) throw_io(path.string(), reason(errno));
  removal.path.clear();
  sync(path.has_parent_path() ? path.parent_path() : ".", path);
}

void write_text_atomically(const std::filesystem::path& path, std::string_view text) {
  write_atomically(path, [&](const std::filesystem::path& temporary) {
    File file(::open(temporary.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
    if (!file.is_open()) throw_io(path.string(), reason(errno));
    while (!text.empty()) {
      const ssize_t written = ::write(file.descriptor(), text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) throw_io(path.string(), reason(errno));
      text.remove_prefix(static_cast<std::size_t>(written));
    }
    if (!file.close()) throw_io(path.string(), reason(errno));
  });
}

std::string read_file(const std::filesystem::path& path, std::uintmax_t limit) {
  File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));   // a pipe without a writer would hold up the open
  if (!file.is_open()) throw_input(path.string(), reason(errno));
  struct stat status {};
  if (::fstat(file.descriptor(), &status) != 0) throw_input(path.string(), reason(errno));
  if (S_ISDIR(status.st_mode)) throw_input(path.string(), reason(EISDIR));
  if (!S_ISREG(status.st_mode)) throw_input(path.string(), "is a pipe or a device, not a file");
  const auto refuse = [&] { throw_input(path.string(), "larger than " + std::to_string(limit) + " bytes"); };
  if (static_cast<std::uintmax_t>(status.st_size) > limit) refuse();

  std::string text(static_cast<std::size_t>(status.st_size) + 1, '\0');
  std::size_t filled = 0;
  while (true) {
    if (filled == text.size()) text.resize(2 * filled + 4096);  // a file that is growing
    const ssize_t got = ::read(file.descriptor(), text.data() + filled, text.size() - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw_input(path.string(), reason(errno));
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
    if (filled > limit) refuse();
  }
  text.resize(filled);
  return text;
}

}  // namespace base
