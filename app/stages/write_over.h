#pragma once
// Files that a command reads are not to be written over by what it makes.
#include <filesystem>
#include <string>
#include <vector>

namespace app {

/// Throws base::Error (exit 2) "OPTION OUT: COMPLAINT" where `out` is one of the files. They are asked for what they are: a link can have any name.
void refuse_to_write_over(const std::vector<std::filesystem::path>& files, const std::string& option, const std::filesystem::path& out,
                          const std::string& complaint);

}  // namespace app
