#pragma once
// Loops over fixed-size chunks: the work is cut the same way for any number of threads, and sums add the chunks in order, so
// results have the same bits whatever runs them.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace base {

/// Calls body(begin, end) for [0, count) cut into chunks of `chunk`; chunks run in any order, perhaps at the same time.
template <class Body>
void parallel_chunks(std::size_t count, std::size_t chunk, const Body& body) {
  const std::size_t chunks = (count + chunk - 1) / chunk;
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) { body(c * chunk, std::min(count, (c + 1) * chunk)); });
}

/// Reduces partial(begin, end) over chunks; the partial results are combined in ascending order.
template <class Value, class Partial, class Combine>
Value ordered_reduce(std::size_t count, std::size_t chunk, Value start, const Partial& partial, const Combine& combine) {
  const std::size_t chunks = (count + chunk - 1) / chunk;
  std::vector<Value> parts(chunks);
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) { parts[c] = partial(c * chunk, std::min(count, (c + 1) * chunk)); });
  for (const Value& part : parts) start = combine(std::move(start), part);
  return start;
}

}  // namespace base
