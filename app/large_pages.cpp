// operator new of the program: arrays of many megabytes lie in pages of 2 MB where the system has them. Particles are looked up all over such arrays,
// and with pages of 4 kB most of these look-ups also miss the processor's table of pages.
#include <sys/mman.h>

#include <cstdlib>
#include <new>

namespace {

constexpr std::size_t kPage = std::size_t(2) << 20, kLarge = 4 * kPage;

void* allocate(std::size_t size) noexcept {
  if (size < kLarge) return std::malloc(size ? size : 1);
  void* const place = std::aligned_alloc(kPage, (size + kPage - 1) / kPage * kPage);
  if (place) madvise(place, size / kPage * kPage, MADV_HUGEPAGE);   // a wish: where it is not granted nothing else changes
  return place;
}

}  // namespace

void* operator new(std::size_t size) {
  for (;;) {
    if (void* const place = allocate(size)) return place;
    const std::new_handler handler = std::get_new_handler();
    if (!handler) throw std::bad_alloc();
    handler();
  }
}
void operator delete(void* place) noexcept { std::free(place); }
void operator delete(void* place, std::size_t) noexcept { std::free(place); }
