#pragma once
// Runs of nodes or faces that follow each other both in a tile and in the grid. A tile has four numbers of a node, a mass and three momenta, the grid
// masses and momenta apart. Where there are four in a run, their numbers are put in order as vectors.
#include <immintrin.h>

#include <cstring>
#include <type_traits>

namespace sim {

/// Whether a run's numbers are one vector: of a length that is known.
template <class Count>
constexpr bool kIsVector = false;
template <int count>
constexpr bool kIsVector<std::integral_constant<int, count>> = count == 2 || count == 4;

/// Adds a number of each face of a run.
template <class Real, class Count>
void add_numbers(const Real* __restrict own, Count count, Real* __restrict sum) {
  if constexpr (kIsVector<Count>) {
    typedef Real Numbers __attribute__((vector_size(Count::value * sizeof(Real))));
    Numbers a, b;
    std::memcpy(&a, own, sizeof a), std::memcpy(&b, sum, sizeof b);
    b += a;
    std::memcpy(sum, &b, sizeof b);
  } else {
    for (int k = 0; k < count; ++k) sum[k] += own[k];
  }
}

/// Adds masses and momenta of `count` nodes of a tile (D + 1 numbers each) to the grid's.
template <int D, class Real, class Count>
void add_nodes(const Real* __restrict own, Count count, Real* __restrict mass, Real* __restrict momentum) {
  if constexpr (D == 3 && std::is_same_v<Real, float> && std::is_same_v<Count, std::integral_constant<int, 4>>) {
    const auto in_order = [](const float* from, __m256i order) { return _mm256_permutevar8x32_ps(_mm256_loadu_ps(from), order); };
    const __m256 a = in_order(own, _mm256_setr_epi32(1, 2, 3, 5, 6, 7, 0, 4));       // six of momentum, two masses
    const __m256 b = in_order(own + 8, _mm256_setr_epi32(3, 5, 6, 7, 0, 4, 1, 2));   // the last four, masses, two between
    const __m128 masses = _mm_shuffle_ps(_mm256_extractf128_ps(a, 1), _mm256_extractf128_ps(b, 1), _MM_SHUFFLE(1, 0, 3, 2));
    _mm256_storeu_ps(momentum, _mm256_add_ps(_mm256_loadu_ps(momentum), _mm256_blend_ps(a, b, 0b11000000)));
    _mm_storeu_ps(momentum + 8, _mm_add_ps(_mm_loadu_ps(momentum + 8), _mm256_castps256_ps128(b)));
    _mm_storeu_ps(mass, _mm_add_ps(_mm_loadu_ps(mass), masses));
  } else {
    for (int k = 0; k < count; ++k) {
      mass[k] += own[k * (D + 1)];
      for (int c = 0; c < D; ++c) momentum[k * D + c] += own[k * (D + 1) + 1 + c];
    }
  }
}

/// The components of `count` vectors, each to an array of its own, `step` numbers from one to the next.
template <int D, class Real, class Count>
void split_components(const Real* __restrict vectors, Count count, Real* __restrict to, int step) {
  if constexpr (D == 3 && std::is_same_v<Real, float> && std::is_same_v<Count, std::integral_constant<int, 4>>) {
    const __m128 a = _mm_loadu_ps(vectors), b = _mm_loadu_ps(vectors + 4), c = _mm_loadu_ps(vectors + 8);   // x y z x, y z x y, z x y z
    const __m128 x = _mm_shuffle_ps(b, c, _MM_SHUFFLE(1, 1, 2, 2)), z = _mm_shuffle_ps(a, b, _MM_SHUFFLE(1, 1, 2, 2));
    const __m128 y0 = _mm_shuffle_ps(a, b, _MM_SHUFFLE(0, 0, 1, 1)), y2 = _mm_shuffle_ps(b, c, _MM_SHUFFLE(2, 2, 3, 3));
    _mm_storeu_ps(to, _mm_shuffle_ps(a, x, _MM_SHUFFLE(2, 0, 3, 0)));
    _mm_storeu_ps(to + step, _mm_shuffle_ps(y0, y2, _MM_SHUFFLE(2, 0, 2, 0)));
    _mm_storeu_ps(to + 2 * step, _mm_shuffle_ps(z, c, _MM_SHUFFLE(3, 0, 2, 0)));
  } else {
    for (int k = 0; k < count; ++k)
      for (int c = 0; c < D; ++c) to[c * step + k] = vectors[k * D + c];
  }
}

}  // namespace sim
