#pragma once
// Writing past the caches: what nobody reads soon neither throws out what is needed nor is read before it is written over.
#include <immintrin.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace base {

/// More bytes than this are gone from the caches before they are read again.
inline constexpr std::size_t kHeldByCaches = std::size_t(1) << 25;

/// memcpy past the caches. Whoever hands them to another thread calls written_past_caches() first.
inline void copy_past_caches(void* to, const void* from, std::size_t bytes) {
  constexpr std::size_t kLine = 64, kVector = 32;
  auto* at = static_cast<char*>(to);
  const auto* source = static_cast<const char*>(from);
  const std::size_t lead = std::min(-reinterpret_cast<std::uintptr_t>(at) % kLine, bytes), whole = (bytes - lead) / kLine * kLine;
  std::memcpy(at, source, lead);
  for (std::size_t b = lead; b < lead + whole; b += kVector)
    _mm256_stream_si256(reinterpret_cast<__m256i*>(at + b), _mm256_loadu_si256(reinterpret_cast<const __m256i*>(source + b)));
  std::memcpy(at + lead + whole, source + lead + whole, bytes - lead - whole);
}
inline void written_past_caches() { _mm_sfence(); }

/// Numbers that follow each other, written a few at a time. They come together here and leave as whole lines; the first and the last line, parts of
/// which may be another thread's, go the usual way. `kMost`: of one piece, those that do not count among them.
template <int kMost>
class PastCaches {
 public:
  explicit PastCaches(float* first) {
    skipped_ = held_ = int(reinterpret_cast<std::uintptr_t>(first) % kLineBytes / sizeof(float));
    line_ = first - held_;
  }
  PastCaches(const PastCaches&) = delete;
  PastCaches& operator=(const PastCaches&) = delete;

  /// Where the next piece is to be put; then how many of its numbers count.
  float* next() { return lines_ + held_; }
  void put(int count) {
    held_ += count;
    if (held_ >= kTogether) write_lines();
  }
  /// Once all are put.
  void finish() {
    write_lines();
    if (held_ > skipped_) std::memcpy(line_ + skipped_, lines_ + skipped_, sizeof(float) * std::size_t(held_ - skipped_));
    _mm_sfence();
  }

 private:
  static constexpr int kLineBytes = 64, kLine = kLineBytes / sizeof(float), kVector = 8;
  static constexpr int kTogether = std::max(kMost, 512);   // so that most have left the store queue: it cannot hand them on in other pieces

  void write_lines() {
    int at = 0;
    if (skipped_ > 0 && held_ >= kLine) {
      std::memcpy(line_ + skipped_, lines_ + skipped_, sizeof(float) * std::size_t(kLine - skipped_));
      at = kLine, skipped_ = 0;
    }
    for (; at + kLine <= held_; at += kLine)
      for (int part = 0; part < kLine; part += kVector) _mm256_stream_ps(line_ + at + part, _mm256_load_ps(lines_ + at + part));
    line_ += at, held_ -= at;
    std::memmove(lines_, lines_ + at, sizeof(float) * std::size_t(held_));
  }

  alignas(kLineBytes) float lines_[kLine + kTogether + kMost];   // what is to be written from line_ on, the beginning of a line
  float* line_;
  int held_, skipped_;                                           // numbers; of the first line those that are not ours
};

}  // namespace base
