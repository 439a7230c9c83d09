#include "base/checksum.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <vector>

#include "base/error.h"

namespace base {
namespace {

constexpr std::uint64_t kOdd = 0x9fb21c651e98df25u;
constexpr std::size_t kBlock = 32, kRead = std::size_t(1) << 20;   // [bytes]

}  // namespace

void Checksum::mix(const std::byte* block) {
  for (std::size_t i = 0; i < lane_.size(); ++i) {
    std::uint64_t word;
    std::memcpy(&word, block + 8 * i, 8);
    lane_[i] = std::rotl(lane_[i] ^ word, 29) * kOdd;
  }
}

void Checksum::add(std::span<const std::byte> bytes) {
  length_ += bytes.size();
  if (filled_ > 0) {
    const std::size_t part = std::min(kBlock - filled_, bytes.size());
    std::copy_n(bytes.begin(), part, rest_.begin() + static_cast<std::ptrdiff_t>(filled_));
    filled_ += part;
    bytes = bytes.subspan(part);
    if (filled_ < kBlock) return;
    mix(rest_.data());
    filled_ = 0;
  }
  for (; bytes.size() >= kBlock; bytes = bytes.subspan(kBlock)) mix(bytes.data());
  std::copy(bytes.begin(), bytes.end(), rest_.begin());
  filled_ = bytes.size();
}

std::uint64_t Checksum::value() const {
  Checksum end = *this;
  std::fill(end.rest_.begin() + static_cast<std::ptrdiff_t>(filled_), end.rest_.end(), std::byte{0});
  if (filled_ > 0) end.mix(end.rest_.data());
  std::uint64_t sum = length_ * kOdd;
  for (const std::uint64_t lane : end.lane_) {
    sum = (sum ^ lane) * kOdd;
    sum ^= sum >> 32;
  }
  return sum;
}

std::uint64_t checksum(std::span<const std::byte> bytes) {
  Checksum sum;
  sum.add(bytes);
  return sum.value();
}

std::optional<FileSum> sum_of(const std::filesystem::path& path, std::uint64_t offset) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);   // a pipe without a writer would hold up the open
  if (file < 0) return {};
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {   // a device may have no end
    ::close(file);
    return {};
  }
  Checksum sum;
  std::uint64_t at = offset;
  std::vector<std::byte> block(kRead);
  ssize_t got;
  while ((got = ::pread(file, block.data(), block.size(), static_cast<off_t>(at))) != 0) {
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) break;
    sum.add(std::span(block).first(static_cast<std::size_t>(got)));
    at += static_cast<std::uint64_t>(got);
  }
  ::close(file);
  if (got < 0) return {};
  return FileSum{at - offset, sum.value()};
}

FileSum sum_of_written(const std::filesystem::path& path, const std::filesystem::path& name, std::uint64_t offset) {
  errno = 0;
  if (const auto sum = sum_of(path, offset)) return *sum;
  throw_io(name.string(), "cannot be read back: " + std::system_category().message(errno != 0 ? errno : EIO));
}

}  // namespace base
