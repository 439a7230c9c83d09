// The least address space to start with. Libraries start threads before main, and where these find no room one ends the program without a word that
// a user could read, and another waits for ever. So it is looked at before them: functions in .preinit_array run before those of any library.
#include <fcntl.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>

#include "base/error.h"

namespace {

constexpr std::size_t kMegabyte = 1000 * 1000;
// [bytes] Of what libraries and main hold before a command begins 90 MB are there on any machine. Of each further core OpenBLAS starts a thread with
// 134 MB, a stack of 8 MB or what the limit says, and others a second thread.
constexpr std::size_t kAlways = 90 * kMegabyte, kEachCore = 160 * kMegabyte;

/// [bytes] that the program and its libraries take up; 0 where the system does not say.
std::size_t mapped_bytes() {
  char text[64] = {};
  const int file = ::open("/proc/self/statm", O_RDONLY);
  if (file < 0) return 0;
  const ssize_t length = ::read(file, text, sizeof text - 1);
  ::close(file);
  std::size_t pages = 0;
  for (ssize_t i = 0; i < length && text[i] >= '0' && text[i] <= '9'; ++i) pages = 10 * pages + std::size_t(text[i] - '0');
  return pages * std::size_t(::sysconf(_SC_PAGESIZE));
}

std::size_t cores() {
  cpu_set_t own;
  return ::sched_getaffinity(0, sizeof own, &own) == 0 ? std::size_t(CPU_COUNT(&own)) : 1;
}

void require_address_space(int count, char** words, char**) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  const std::size_t needed = mapped_bytes() + kAlways + kEachCore * (cores() - 1);
  if (limit.rlim_cur >= needed) return;
  char text[200];
  std::snprintf(text, sizeof text,
                "out of memory: to start on this machine the program needs %zu MB of address space, and its limit is %zu MB (ulimit -v)",
                needed / kMegabyte + 1, std::size_t(limit.rlim_cur) / kMegabyte);
  constexpr int kCode = static_cast<int>(base::Exit::user);
  ::dprintf(STDERR_FILENO, "polypic: %s\n", text);
  for (int i = 1; i < count; ++i)
    if (std::strcmp(words[i], "--json") == 0) {
      ::dprintf(STDOUT_FILENO, "{\n  \"error\": {\n    \"code\": %d,\n    \"message\": \"%s\"\n  }\n}\n", kCode, text);
      break;
    }
  ::_exit(kCode);
}

[[gnu::section(".preinit_array"), gnu::used]] void (*const run_before_libraries)(int, char**, char**) = require_address_space;

}  // namespace
