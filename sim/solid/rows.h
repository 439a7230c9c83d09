#pragma once
// Rows of a few numbers a particle <-> numbers of laws: element k of every row together.
#include <array>
#include <optional>
#include <type_traits>

#include "base/past_caches.h"
#include "sim/solid/lanes.h"

namespace sim {

/// Where the rows of the particles are that T holds.
template <class T, class Number>
using RowsAt = std::array<Number*, std::size_t(NumberTraits<T>::kWidth)>;

namespace detail {

/// c[l] holds four numbers of row l and four of row l + 4; afterwards number l of all eight rows. Its own inverse.
inline void transpose(__m256 (&c)[4]) {
  const __m256 t0 = _mm256_unpacklo_ps(c[0], c[1]), t1 = _mm256_unpackhi_ps(c[0], c[1]);
  const __m256 t2 = _mm256_unpacklo_ps(c[2], c[3]), t3 = _mm256_unpackhi_ps(c[2], c[3]);
  c[0] = _mm256_shuffle_ps(t0, t2, 0x44), c[1] = _mm256_shuffle_ps(t0, t2, 0xee);
  c[2] = _mm256_shuffle_ps(t1, t3, 0x44), c[3] = _mm256_shuffle_ps(t1, t3, 0xee);
}

/// The first of each group of four of n: groups of a row that is no multiple of four overlap.
constexpr int start_of_group(int n, int group) { return 4 * group + 4 <= n ? 4 * group : n - 4; }

}  // namespace detail

template <std::size_t n>
SIM_INLINE void load_rows(const RowsAt<double, const double>& at, std::array<double, n>& out) {
  for (std::size_t k = 0; k < n; ++k) out[k] = at[0][k];
}
template <std::size_t n>
SIM_INLINE void load_rows(const RowsAt<Lanes, const float>& at, std::array<Lanes, n>& out) {
  if constexpr (n < 4) {
    alignas(32) std::array<std::array<float, 8>, n> staged;
    for (std::size_t l = 0; l < 8; ++l)
      for (std::size_t k = 0; k < n; ++k) staged[k][l] = at[l][k];
    for (std::size_t k = 0; k < n; ++k) out[k] = Lanes(_mm256_load_ps(staged[k].data()));
  } else {
    for (int g = 0; g < int(n + 3) / 4; ++g) {
      const int from = detail::start_of_group(int(n), g);
      __m256 c[4];
      for (std::size_t l = 0; l < 4; ++l) c[l] = _mm256_set_m128(_mm_loadu_ps(at[l + 4] + from), _mm_loadu_ps(at[l] + from));
      detail::transpose(c);
      for (std::size_t k = 0; k < 4; ++k) out[std::size_t(from) + k] = Lanes(c[k]);
    }
  }
}

/// The same of columns, `stride` apart: eight numbers of each are read for Lanes.
template <std::size_t n>
SIM_INLINE void load_columns(const double* first, std::size_t stride, std::array<double, n>& out) {
  for (std::size_t k = 0; k < n; ++k) out[k] = first[k * stride];
}
template <std::size_t n>
SIM_INLINE void load_columns(const float* first, std::size_t stride, std::array<Lanes, n>& out) {
  for (std::size_t k = 0; k < n; ++k) out[k] = Lanes(_mm256_loadu_ps(first + k * stride));
}

template <std::size_t n>
SIM_INLINE void store_rows(const RowsAt<double, double>& at, const std::array<double, n>& from) {
  for (std::size_t k = 0; k < n; ++k) at[0][k] = from[k];
}
template <std::size_t n>
SIM_INLINE void store_rows(const RowsAt<Lanes, float>& at, const std::array<Lanes, n>& values) {
  if constexpr (n < 4) {
    for (std::size_t l = 0; l < 8; ++l)
      for (std::size_t k = 0; k < n; ++k) at[l][k] = values[k][int(l)];
  } else {
    for (int g = 0; g < int(n + 3) / 4; ++g) {
      const int from = detail::start_of_group(int(n), g);
      __m256 c[4];
      for (std::size_t k = 0; k < 4; ++k) c[k] = values[std::size_t(from) + k].v;
      detail::transpose(c);
      for (std::size_t l = 0; l < 4; ++l) {
        _mm_storeu_ps(at[l] + from, _mm256_castps256_ps128(c[l]));
        _mm_storeu_ps(at[l + 4] + from, _mm256_extractf128_ps(c[l], 1));
      }
    }
  }
}

/// Writes rows of n numbers that follow each other, as many particles' together as T holds; if asked past the caches.
template <class T, std::size_t n>
class RowWriter {
 public:
  RowWriter(RealOf<T>* first, bool past_caches) : at_(first) {
    if constexpr (kWidth > 1)
      if (past_caches) past_caches_.emplace(first);
  }
  /// Of T's particles the first `used`.
  SIM_INLINE void write(const std::array<T, n>& values, int used) {
    RowsAt<T, RealOf<T>> to;
    const bool stages = past_caches_.has_value();
    RealOf<T>* first = at_;
    if constexpr (kWidth > 1)
      if (stages) first = past_caches_->next();
    for (std::size_t l = 0; l < kWidth; ++l) to[l] = stages || int(l) < used ? first + l * n : spare_.data();
    store_rows(to, values);
    at_ += n * std::size_t(used);
    if constexpr (kWidth > 1)
      if (stages) past_caches_->put(int(n) * used);
  }
  /// Once all are written.
  void finish() {
    if constexpr (kWidth > 1)
      if (past_caches_) past_caches_->finish();
  }

 private:
  static constexpr std::size_t kWidth = std::size_t(NumberTraits<T>::kWidth);
  RealOf<T>* at_;
  std::array<RealOf<T>, n> spare_;
  std::conditional_t<(kWidth > 1), std::optional<base::PastCaches<int(n * kWidth)>>, std::optional<int>> past_caches_;
};

/// Where bit 0 of the particles' bytes is set; eight bytes are read for Lanes.
inline bool flagged(const std::uint8_t* flags, double) { return *flags & 1; }
inline Lanes::Bits flagged(const std::uint8_t* flags, Lanes) {
  const __m256i wide = _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(flags)));
  return reinterpret_cast<Lanes::Bits>(_mm256_sub_epi32(_mm256_setzero_si256(), _mm256_and_si256(wide, _mm256_set1_epi32(1))));
}

/// The first `count` lanes.
inline bool first_lanes(int, double) { return true; }
inline Lanes::Bits first_lanes(int count, Lanes) {
  const Lanes::Bits number = {0, 1, 2, 3, 4, 5, 6, 7};
  return number < count;
}

}  // namespace sim
