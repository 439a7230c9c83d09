#include "app/stages/write_over.h"

#include <algorithm>

#include "base/error.h"

namespace app {

void refuse_to_write_over(const std::vector<std::filesystem::path>& files, const std::string& option, const std::filesystem::path& out,
                          const std::string& complaint) {
  const auto is_out = [&](const std::filesystem::path& file) {
    std::error_code none;
    return std::filesystem::equivalent(out, file, none);
  };
  if (std::any_of(files.begin(), files.end(), is_out)) base::throw_input(option + " " + out.string(), complaint);
}

}  // namespace app
