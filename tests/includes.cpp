// Folders depend on each other in one direction: a header directly in a folder is public, one in a subfolder is private to its parent.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const std::map<std::string, std::set<std::string>> kMayInclude = {{"base", {}}, {"sim", {"base"}}, {"surface", {"base", "sim"}},
                                                                  {"render", {"base", "sim", "surface"}},
                                                                  {"app", {"base", "sim", "surface", "render"}}};

/// Third-party headers that one folder, and there one file or room, may know.
const std::map<std::string, std::vector<std::string>> kHomes = {
    {"embree3/", {"render/"}}, {"GL/", {"render/"}},  {"OpenImageIO/", {"render/"}}, {"openvdb/", {"surface/"}},
    {"cholmod.h", {"sim/"}}, {"hwy/", {"sim/transfer/"}},   {"CLI/", {"app/"}},    {"toml++/", {"app/shot/"}},    {"hdf5", {"sim/"}},
    {"assimp/", {"render/files/"}},  {"zlib.h", {"render/image/"}}};

std::vector<fs::path> sources_of(const std::string& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(POLYPIC_SOURCE_DIR) / folder))
    if (entry.path().extension() == ".h" || entry.path().extension() == ".cpp") files.push_back(fs::relative(entry.path(), POLYPIC_SOURCE_DIR));
  return files;
}

std::vector<std::string> includes_of(const fs::path& file, char open, char close) {
  std::vector<std::string> headers;
  std::ifstream in(fs::path(POLYPIC_SOURCE_DIR) / file);
  for (std::string line; std::getline(in, line);) {
    const std::string start = std::string("#include ") + open;
    if (line.starts_with(start)) headers.push_back(line.substr(start.size(), line.find(close, start.size()) - start.size()));
  }
  return headers;
}

// Why the file may not include the header; empty when it may.
std::string objection(const fs::path& file, const fs::path& header) {
  const std::string own = file.begin()->string(), other = header.begin()->string();
  if (!kMayInclude.contains(other) || !fs::exists(fs::path(POLYPIC_SOURCE_DIR) / header)) return "is not named from the root";
  if (own == other) return "";
  if (!kMayInclude.at(own).contains(other)) return "lies the wrong way";
  return header.parent_path() == other ? "" : "is private to " + other + "/";
}

}  // namespace

TEST(Includes, GoOneWayAndStayOutOfPrivateRooms) {
  std::size_t checked = 0;
  for (const auto& [folder, allowed] : kMayInclude)
    for (const fs::path& file : sources_of(folder))
      for (const std::string& header : includes_of(file, '"', '"')) {
        ++checked;
        EXPECT_EQ(objection(file, header), "") << file << " includes " << header;
      }
  EXPECT_GT(checked, 50u);
}

TEST(Includes, RuleObjectsToEveryKindOfBreach) {
  EXPECT_EQ(objection("app/main.cpp", "base/error.h"), "");
  EXPECT_EQ(objection("base/error.cpp", "sim/scene.h"), "lies the wrong way");
  EXPECT_EQ(objection("app/main.cpp", "error.h"), "is not named from the root");
  EXPECT_EQ(objection("app/main.cpp", "sim/transfer/modes.h"), "is private to sim/");
}

TEST(Includes, LibrariesStayInTheirHomes) {
  std::map<std::string, std::set<std::string>> found;
  for (const auto& [folder, allowed] : kMayInclude)
    for (const fs::path& file : sources_of(folder))
      for (const std::string& header : includes_of(file, '<', '>'))
        for (const auto& [library, homes] : kHomes) {
          if (!header.starts_with(library)) continue;
          found[library].insert(file.string());
          EXPECT_TRUE(std::any_of(homes.begin(), homes.end(), [&](const std::string& home) { return file.string().starts_with(home); }))
              << file << " includes " << header;
          EXPECT_FALSE(library == "openvdb/" && file.extension() == ".h" && file.parent_path() == "surface") << file << " shows OpenVDB to others";
        }
  for (const std::string library : {"embree3/", "GL/", "OpenImageIO/", "CLI/", "cholmod.h", "toml++/", "hdf5", "assimp/"})
    EXPECT_EQ(found[library].size(), 1u) << library << " is in several files";
}
