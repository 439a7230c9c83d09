#pragma once
// Calls for memory before it is needed.

namespace base {

/// Into the second cache: the first one can wait for few lines at a time (24 on a Zen 4), and where calls take these places, every other read waits.
/// As __builtin_prefetch, but a function that does nothing else is not taken for one without effect (GCC 12 drops calls of those).
[[gnu::always_inline]] inline void prefetch(const void* at) {
  __builtin_prefetch(at, 0, 2);
  asm volatile("");
}
/// From the second cache into the first, for what is needed next.
[[gnu::always_inline]] inline void prefetch_near(const void* at) {
  __builtin_prefetch(at, 0, 3);
  asm volatile("");
}

}  // namespace base
