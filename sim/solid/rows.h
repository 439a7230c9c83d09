#pragma once
// Rows of a few numbers a particle <-> numbers of laws: element k of every row together.
#include <array>

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
