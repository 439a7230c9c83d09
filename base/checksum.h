#pragma once
// Whether bytes are those that were written: a 64-bit checksum as fast as memory, for caches of gigabytes. Against chance, not
// against malice.
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

namespace base {

/// Four lanes take turns with 8-byte little-endian words, lane <- rotate_left(lane xor word, 29) * odd constant, and are folded
/// with the length at the end; a last block is filled up with zeros. A change within one word always shows: each step is a bijection.
class Checksum {
 public:
  void add(std::span<const std::byte> bytes);
  std::uint64_t value() const;

 private:
  void mix(const std::byte* block);

  std::array<std::uint64_t, 4> lane_{0x9ae16a3b2f90404fu, 0xc949c7defed1a5b5u, 0x8f14c3a5d1e9b027u, 0xe220a8397b1dcdafu};
  std::array<std::byte, 32> rest_{};   // the beginning of a block
  std::size_t filled_ = 0;
  std::uint64_t length_ = 0;
};
std::uint64_t checksum(std::span<const std::byte> bytes);

struct FileSum {
  std::uint64_t bytes = 0, checksum = 0;
  bool operator==(const FileSum&) const = default;
};
/// Of a file from `offset` to its end; empty when it is none or cannot be read.
std::optional<FileSum> sum_of(const std::filesystem::path&, std::uint64_t offset = 0);
/// Of a file that was just written; throws base::Error (exit 5) with the reason when it cannot be read. Errors call it `name`.
FileSum sum_of_written(const std::filesystem::path&, const std::filesystem::path& name, std::uint64_t offset = 0);

}  // namespace base
