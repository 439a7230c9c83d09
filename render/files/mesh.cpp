// The only file that knows Assimp.
#include "render/files/mesh.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <fstream>
#include <new>
#include <sstream>
#include <string>

#include "base/error.h"
#include "base/text.h"

namespace render::files {
namespace {

constexpr std::uintmax_t kLargestFile = std::uintmax_t(2) << 30;  // [bytes]
constexpr std::uint64_t kMostTriangles = 100'000'000;

std::string kind_of(const std::filesystem::path& path) {
  const std::string kind = base::extension_of(path);
  if (kind != ".obj" && kind != ".ply" && kind != ".stl") base::throw_input(path.string(), "is no mesh: must end in .obj, .ply or .stl");
  return kind;
}

/// The number of faces by a PLY file's header. The library believes it and makes room for what it counts; an element takes a byte at least.
std::uint64_t faces_by_header(const std::filesystem::path& path, std::uintmax_t size) {
  std::uint64_t faces = 0;
  std::ifstream in(path, std::ios::binary);
  std::string line;
  for (int number = 1; number <= 1000 && std::getline(in, line); ++number) {
    std::istringstream words(line);
    std::string word, name;
    words >> word;
    if (number == 1 && word != "ply") break;
    if (word == "end_header") return faces;
    if (word != "element") continue;
    std::uint64_t count = 0;
    if (!(words >> name >> count) || count > size)
      base::throw_input(path.string(), "line " + std::to_string(number) + ": \"" + line.substr(0, 80) + "\": more than a file of " +
                                           std::to_string(size) + " bytes holds");
    if (name == "face") faces = count;
  }
  base::throw_input(path.string(), "has no PLY header");
}

[[noreturn]] void refuse_vertex(const std::filesystem::path& path, std::uint64_t vertex, int axis) {
  base::throw_input(path.string(), "vertex " + std::to_string(vertex + 1) + ": " + "xyz"[axis] + " is not finite");
}

/// The first vertex of an OBJ file or a text PLY or STL that is not a number, by line: the library drops or changes such words.
void check_text(const std::filesystem::path& path, const std::string& kind) {
  std::ifstream in(path, std::ios::binary);
  std::string line;
  std::vector<std::string> words;
  const std::string mark = kind == ".obj" ? "v" : "vertex";
  for (std::uint64_t number = 1; std::getline(in, line); ++number) {
    if (line.find('\0') != std::string::npos) return;   // binary
    if (kind == ".ply") {
      if (line.starts_with("format binary")) return;
    } else {
      std::istringstream first(line);
      std::string word;
      if (!(first >> word) || word != mark) continue;
    }
    std::string lower(line);
    std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    std::istringstream all(lower);
    for (std::string word; all >> word;) {
      const std::size_t at = word.find_first_not_of("+-");
      if (at != std::string::npos && (word.compare(at, 3, "nan") == 0 || word.compare(at, 3, "inf") == 0) &&
          (word.size() <= at + 3 || word == "infinity" || word[at + 3] == '('))
        base::throw_input(path.string(), "line " + std::to_string(number) + ": " + word + " is not finite");
    }
  }
}

/// As read, and no fewer than `least`: the library's own passes over it take every corner of a face for one that is there.
void check_faces(const std::filesystem::path& path, const aiScene& scene, std::uint64_t least) {
  std::uint64_t found = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned i = 0; i < mesh.mNumFaces; ++i, ++found) {
      const aiFace& face = mesh.mFaces[i];
      const bool is_there = face.mNumIndices > 0 && std::all_of(face.mIndices, face.mIndices + face.mNumIndices, [&](unsigned k) { return k < mesh.mNumVertices; });
      if (!is_there) base::throw_input(path.string(), "face " + std::to_string(i + 1) + " has a corner that is not there, or none");
    }
  }
  if (found < least) base::throw_input(path.string(), "ends early: " + std::to_string(found) + " of " + std::to_string(least) + " faces");
}

const aiScene& import(Assimp::Importer& importer, const std::filesystem::path& path, std::uint64_t faces) {
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_LINE | aiPrimitiveType_POINT);
  try {
    const aiScene* scene = importer.ReadFile(path.string(), 0);
    if (scene) check_faces(path, *scene, faces);
    if (scene)
      scene = importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_JoinIdenticalVertices | aiProcess_PreTransformVertices);
    if (scene) return *scene;
  } catch (const std::bad_alloc&) {
    base::throw_input(path.string(), "does not fit into memory");
  }
  const std::string reason = importer.GetErrorString();
  base::throw_input(path.string(), "cannot be read as a mesh" + (reason.empty() ? "" : ": " + reason.substr(0, reason.find('\n'))));
}

}  // namespace

Triangles read_mesh(const std::filesystem::path& path) {
  const std::string kind = kind_of(path);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) base::throw_input(path.string(), error.message());
  if (size > kLargestFile)
    base::throw_input(path.string(), "too large: " + std::to_string(size) + " bytes; at most " + std::to_string(kLargestFile) + " are read");
  const std::uint64_t faces = kind == ".ply" ? faces_by_header(path, size) : 0;
  check_text(path, kind);

  Assimp::Importer importer;
  const aiScene& scene = import(importer, path, faces);
  Triangles result;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    const std::size_t first = result.position.size();
    if (first + mesh.mNumVertices > std::uint64_t(3) * kMostTriangles || result.triangles.size() + mesh.mNumFaces > kMostTriangles)
      base::throw_input(path.string(), "too large: more than " + std::to_string(kMostTriangles) + " triangles");
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D& p = mesh.mVertices[i];
      for (int axis = 0; axis < 3; ++axis)
        if (!std::isfinite(p[static_cast<unsigned>(axis)])) refuse_vertex(path, first + i, axis);
      result.position.emplace_back(p.x, p.y, p.z);
    }
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) continue;   // lines and points
      std::array<std::uint32_t, 3> corners{};
      for (unsigned k = 0; k < 3; ++k) {
        if (face.mIndices[k] >= mesh.mNumVertices)
          base::throw_input(path.string(), "triangle " + std::to_string(i + 1) + " has a corner that is not there");
        corners[k] = static_cast<std::uint32_t>(first + face.mIndices[k]);
      }
      result.triangles.push_back(corners);
    }
  }
  if (result.triangles.empty()) base::throw_input(path.string(), "holds no triangle");
  return result;
}

}  // namespace render::files
