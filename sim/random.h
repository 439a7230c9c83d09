#pragma once
// Counter-based random numbers: a pure function of seed and counters, the same in any order of calls.
#include <cstdint>

namespace sim {

/// Finaliser of SplitMix64 [Steele14]: a bijection that scatters every bit.
constexpr std::uint64_t scramble(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

/// A number in [0, 1) from a seed and two counters.
constexpr double uniform(std::uint64_t seed, std::uint64_t first, std::uint64_t second) {
  return double(scramble(scramble(scramble(seed) ^ first) ^ second) >> 11) * 0x1p-53;
}

}  // namespace sim
