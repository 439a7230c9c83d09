// Loaded before Embree (LD_PRELOAD), counts what a program asks of it; at its end the counts are in the file that EMBREE_CALLS names.
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>

namespace {

struct Counts {
  int devices = 0, geometries = 0;
  ~Counts() {
    const char* const name = std::getenv("EMBREE_CALLS");
    std::FILE* const file = name ? std::fopen(name, "w") : nullptr;
    if (!file) return;
    std::fprintf(file, "%d %d\n", devices, geometries);
    std::fclose(file);
  }
} counts;

}  // namespace

extern "C" {

void* rtcNewDevice(const char* config) {
  ++counts.devices;
  return reinterpret_cast<void* (*)(const char*)>(dlsym(RTLD_NEXT, "rtcNewDevice"))(config);
}

void* rtcNewGeometry(void* device, int type) {
  ++counts.geometries;
  return reinterpret_cast<void* (*)(void*, int)>(dlsym(RTLD_NEXT, "rtcNewGeometry"))(device, type);
}

}
