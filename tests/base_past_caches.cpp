// What is written past the caches is what would be written the usual way, and nothing beside it.
#include "base/past_caches.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace {

constexpr std::size_t kMargin = 40;   // numbers before and behind what is written

/// Calls body(first number written, how many) for places and lengths that begin and end anywhere in a line.
template <class Body>
void for_places(const Body& body) {
  for (std::size_t first = 0; first < 17; ++first)
    for (const std::size_t count : {1u, 5u, 15u, 16u, 17u, 31u, 500u, 5003u}) body(first, count);
}

std::vector<float> expected(std::size_t first, std::size_t count) {
  std::vector<float> all(first + count + kMargin, -1);
  std::iota(all.begin() + std::ptrdiff_t(first), all.end() - std::ptrdiff_t(kMargin), 0.0f);
  return all;
}

TEST(PastCaches, KeepsNumbersPutAFewAtATime) {
  constexpr std::size_t kMost = 72;
  for_places([](std::size_t first, std::size_t count) {
    for (const std::size_t piece : {1u, 9u, 50u, 72u}) {
      std::vector<float> all(first + count + kMargin, -1);
      base::PastCaches<kMost> past_caches(&all[first]);
      for (std::size_t at = 0; at < count; at += piece) {
        const std::size_t counts = std::min(piece, count - at);
        float* const next = past_caches.next();
        for (std::size_t i = 0; i < kMost; ++i) next[i] = i < counts ? float(at + i) : -7;   // what does not count may be anything
        past_caches.put(int(counts));
      }
      past_caches.finish();
      ASSERT_EQ(all, expected(first, count)) << first << " " << count << " " << piece;
    }
  });
}

TEST(PastCaches, CopiesWhatBeginsAndEndsAnywhere) {
  for_places([](std::size_t first, std::size_t count) {
    std::vector<float> all(first + count + kMargin, -1), from(count + 3);
    std::iota(from.begin() + 3, from.end(), 0.0f);
    base::copy_past_caches(&all[first], &from[3], count * sizeof(float));
    base::written_past_caches();
    ASSERT_EQ(all, expected(first, count)) << first << " " << count;
  });
}

}  // namespace
