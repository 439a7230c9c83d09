#include "app/compare/compare.h"

#include <nlohmann/json.hpp>

#include "app/compare/files.h"
#include "app/compare/run.h"
#include "app/stages/write_over.h"
#include "base/error.h"
#include "base/text.h"
#include "surface/surface.h"

namespace app {
namespace {

namespace fs = std::filesystem;

enum class Kind { image, volume, points, run };

const char* name_of(Kind kind) {
  constexpr const char* names[] = {"an image", "a volume", "points", "a run"};
  return names[static_cast<int>(kind)];
}

Kind kind_of(const fs::path& path) {
  std::error_code failure;
  const fs::file_status status = fs::status(path, failure);
  if (failure) base::throw_input(path.string(), failure.message());
  if (fs::is_directory(status)) {
    if (!is_run(path)) base::throw_input(path.string(), "not the directory of a run: there is no frame in its ledger");
    return Kind::run;
  }
  if (!fs::is_regular_file(status)) base::throw_input(path.string(), "is a pipe or a device, not a file");
  const std::string extension = base::extension_of(path);
  if (extension == ".png" || extension == ".exr") return Kind::image;
  if (extension == ".vdb") return surface::holds_points(path) ? Kind::points : Kind::volume;
  base::throw_input(path.string(), "nothing that is compared: .png, .exr, .vdb, or the directory of a run");
}

}  // namespace

nlohmann::ordered_json compare(const fs::path& a, const fs::path& b, const Tolerance& tolerance, const std::optional<fs::path>& picture) {
  surface::initialize();
  const Kind kind = kind_of(a), other = kind_of(b);
  if (kind != other) base::throw_input(b.string(), std::string(name_of(other)) + ", and the other is " + name_of(kind));
  if (picture && kind != Kind::image) base::throw_input("--out " + picture->string(), "a difference picture is drawn of two images only");
  if (picture) refuse_to_write_over({a, b}, "--out", *picture, "is one of the images that are compared");
  switch (kind) {
    case Kind::image: return compare_image_files(a, b, tolerance, picture);
    case Kind::volume: return compare_volume_files(a, b, tolerance);
    case Kind::points: return compare_point_files(a, b, tolerance);
    case Kind::run: return compare_runs(a, b, tolerance);
  }
  return {};
}

}  // namespace app
