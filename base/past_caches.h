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
inline constexpr std::size_t kLineBytes = 64;

/// memcpy past the caches. Whoever hands them to another thread calls written_past_caches() first.
inline void copy_past_caches(void* to, const void* from, std::size_t bytes) {
  constexpr std::size_t kVector = 32;
  auto* at = static_cast<char*>(to);
  const auto* source = static_cast<const char*>(from);
  const std::size_t lead = std::min(-reinterpret_cast<std::uintptr_t>(at) % kLineBytes, bytes), whole = (bytes - lead) / kLineBytes * kLineBytes;
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
  explicit PastCaches(float* first) : at_(first) {}
  PastCaches(const PastCaches&) = delete;
  PastCaches& operator=(const PastCaches&) = delete;

  /// Where the next piece is to be put; then how many of its numbers count.
  float* next() { return held_numbers_ + held_; }
  void put(int count) {
    held_ += count;
    if (held_ >= kTogether) write(held_ - int(reinterpret_cast<std::uintptr_t>(at_ + held_) % kLineBytes / sizeof(float)));
  }
  /// Once all are put.
  void finish() {
    write(held_);
    written_past_caches();
  }

 private:
  static constexpr int kTogether = std::max(kMost, 512);   // so that most have left the store queue: it cannot hand them on in other pieces

  void write(int count) {
    copy_past_caches(at_, held_numbers_, sizeof(float) * std::size_t(count));
    at_ += count, held_ -= count;
    std::memmove(held_numbers_, held_numbers_ + count, sizeof(float) * std::size_t(held_));
  }

  alignas(kLineBytes) float held_numbers_[kTogether + kMost];   // what is to be written at at_
  float* at_;
  int held_ = 0;
};

}  // namespace base
