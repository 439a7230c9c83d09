// Sets what every thread inherits, then carries out the command line.
#include <dlfcn.h>
#include <fcntl.h>
#include <pmmintrin.h>
#include <unistd.h>
#include <xmmintrin.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "app/commands/commands.h"
#include "base/error.h"

namespace {

// Denormal numbers cost a hundred times a normal one and mean nothing here. Threads copy this setting from the one that starts them.
void flush_denormals() {
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
}

// A file opened while a standard stream is closed would take its number, and what is printed would go into that file.
bool has_standard_streams() {
  for (const int stream : {0, 1, 2})
    if (::fcntl(stream, F_GETFD) < 0 && ::open("/dev/null", O_RDWR) != stream) return false;   // takes the lowest number that is free
  return true;
}

// BLAS and OpenMP inside the direct solver run on one thread: their sums would follow the number of threads. They are found by
// name because which BLAS is installed is the system's choice, and only this one has threads.
void use_one_blas_thread() {
  for (const char* name : {"openblas_set_num_threads", "omp_set_num_threads"})
    if (void* const found = ::dlsym(RTLD_DEFAULT, name)) reinterpret_cast<void (*)(int)>(found)(1);
}

}  // namespace

int main(int count, char** words) {
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) {
    std::fputs("polypic: this processor has no AVX2 and FMA, which the program is built for\n", stderr);
    return static_cast<int>(base::Exit::user);
  }
  if (!has_standard_streams()) return static_cast<int>(base::Exit::io);   // with no place to say so
  std::signal(SIGPIPE, SIG_IGN);   // a reader of the output that goes away ends no command
  std::signal(SIGXFSZ, SIG_IGN);   // a file over the limit is a write that fails, not a crash
  flush_denormals();
  use_one_blas_thread();
  const int code = app::run_command_line(count, words);
  if (code == 0) return 0;
  std::fflush(nullptr);
  std::_Exit(code);   // after a failure the threads of a library may wait for memory for ever, and at a plain end it would wait for them
}
