#pragma once
// Runs something on a number of threads of its own, more than the machine has cores where that is asked: a limit alone adds none.
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

template <class Body>
auto on_threads(int count, const Body& body) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count));
  tbb::task_arena arena(count);
  return arena.execute(body);
}
