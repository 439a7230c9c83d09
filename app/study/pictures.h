#pragma once
// Picture files as parts of a page.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace app {

struct PictureRequest {
  std::filesystem::path file;
  std::int64_t width = 0;   // [pixels] at most
};

/// Each as "data:image/jpeg;base64,...", all together within `bytes`: made smaller, then coarser, where they would not fit. One that cannot be
/// read is a grey tile.
std::vector<std::string> data_urls(const std::vector<PictureRequest>&, std::size_t bytes);

std::string base64(const std::string& bytes);

}  // namespace app
