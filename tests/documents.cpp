// What pages say of each other: works that are named are in the bibliography, and what one cites is this version.
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>
#include <string>

#include "base/atomic_file.h"

namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& file) { return base::read_file(fs::path(POLYPIC_SOURCE_DIR) / file); }

/// Every match's first group.
std::set<std::string> found_in(const std::string& text, const std::regex& pattern) {
  std::set<std::string> found;
  for (std::sregex_iterator m(text.begin(), text.end(), pattern), end; m != end; ++m) found.insert((*m)[1]);
  return found;
}

}  // namespace

TEST(Bibliography, HasEveryWorkThatIsNamed) {
  const std::set<std::string> known = found_in(text_of("docs/bibliography.md"), std::regex("\n\\| ([A-Za-z]+[0-9]{2}) \\|"));
  ASSERT_GT(known.size(), 40u);
  std::set<std::string> named;
  for (const char* folder : {"base", "sim", "surface", "render", "app", "docs"})
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(POLYPIC_SOURCE_DIR) / folder)) {
      const std::string kind = entry.path().extension();
      if (kind != ".h" && kind != ".cpp" && kind != ".md") continue;
      named.merge(found_in(text_of(entry.path()), std::regex("\\[([A-Z][A-Za-z]+[0-9]{2})\\]")));
    }
  EXPECT_GT(named.size(), 40u);
  for (const std::string& key : named) EXPECT_TRUE(known.contains(key)) << key;
}

TEST(Citation, IsOfThisVersion) { EXPECT_NE(text_of("CITATION.cff").find("\nversion: " POLYPIC_VERSION "\n"), std::string::npos); }
