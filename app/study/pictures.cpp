#include "app/study/pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "base/error.h"
#include "base/parallel.h"
#include "render/render.h"

namespace app {
namespace {

constexpr int kQuality = 88, kCoarsest = 40;
constexpr std::int64_t kNarrowest = 160;

/// What stands for a picture that cannot be read.
render::Image grey_tile() { return {.width = 16, .height = 9, .channels = {"R", "G", "B"}, .pixels = std::vector<float>(16 * 9 * 3, 0.85f)}; }

render::Image picture_or_tile(const std::filesystem::path& file, std::int64_t width) {
  try {
    const render::Image image = render::read_image(file);
    return image.channels.size() < 3 ? grey_tile() : render::shrunk(image, width);
  } catch (const base::Error&) {
    return grey_tile();
  }
}

// Read anew for each try: hundreds of pictures, decoded, would not fit into memory.
std::vector<std::string> encoded(const std::vector<PictureRequest>& requests, double scale, int quality) {
  std::vector<std::string> urls(requests.size());
  base::parallel_chunks(requests.size(), 1, [&](std::size_t i, std::size_t) {
    const auto width = std::max(std::min(kNarrowest, requests[i].width),
        static_cast<std::int64_t>(std::floor(scale * static_cast<double>(requests[i].width))));
    urls[i] = "data:image/jpeg;base64," + base64(render::jpeg(picture_or_tile(requests[i].file, width), quality));
  });
  return urls;
}

std::size_t total(const std::vector<std::string>& urls) {
  std::size_t sum = 0;
  for (const std::string& url : urls) sum += url.size();
  return sum;
}

}  // namespace

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k) three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? kDigits[three >> (18 - 6 * k) & 63u] : '=';
  }
  return out;
}

std::vector<std::string> data_urls(const std::vector<PictureRequest>& requests, std::size_t bytes) {
  double scale = 1;
  int quality = kQuality;
  std::vector<std::string> urls = encoded(requests, scale, quality);
  while (total(urls) > bytes) {
    scale *= std::min(0.9, std::sqrt(0.95 * static_cast<double>(bytes) / static_cast<double>(total(urls))));
    if (scale < 0.3) quality = std::max(kCoarsest, quality - 16);
    if (scale < 0.02) throw base::Error({.code = base::Exit::fault, .message = std::to_string(requests.size())
        + " pictures do not fit into one page"});
    urls = encoded(requests, scale, quality);
  }
  return urls;
}

}  // namespace app
