#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/stages/document.h"
#include "base/atomic_file.h"
#include "base/text.h"
#include "sim/problem.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

// The first comment of a shot file, which says what it shows.
std::string description_of(const std::filesystem::path& shot) {
  const std::string text = base::read_file(shot);
  const std::size_t start = text.find_first_not_of("# ", text.find('#'));
  return start == std::string::npos || text.find('#') == std::string::npos ? "" : text.substr(start, text.find('\n', start) - start);
}

Json shots_json() {
  Json shots = Json::array();
  for (const std::filesystem::path& file : shipped_shots()) {
    const Shot shot = read_shot(file, {});
    shots.push_back({{"name", shot.name},
                     {"frames", shot.frames},
                     {"width", shot.render.options.width},
                     {"height", shot.render.options.height},
                     {"description", description_of(file)},
                     {"file", file.string()}});
  }
  return shots;
}

Json looks_json() {
  Json looks = Json::array();
  for (const auto& [name, look] : render::shipped_looks()) looks.push_back({{"name", name}, {"model", look.model}});
  return looks;
}

// The names that the declaration of body.material accepts, which it gives in quotes.
Json materials_json() {
  Json materials = Json::array();
  for (const KeyRow& row : all_keys()) {
    if (row.key != "body.NAME.material") continue;
    for (std::size_t open = row.allowed.find('"'), close; open != std::string::npos; open = row.allowed.find('"', close + 1)) {
      close = row.allowed.find('"', open + 1);
      if (close == std::string::npos) break;
      materials.push_back({{"name", row.allowed.substr(open + 1, close - open - 1)}});
    }
  }
  return materials;
}

Json problems_json() {
  Json problems = Json::array();
  for (const sim::ProblemRow& row : sim::problem_rows()) problems.push_back({{"name", row.name}, {"meaning", row.meaning}});
  return problems;
}

void print_names(const char* title, const Json& entries) {
  std::string names;
  for (const Json& entry : entries) names += (names.empty() ? "" : ", ") + entry["name"].get<std::string>();
  std::printf("%s  %s\n", title, names.c_str());
}

}  // namespace

void list(const Request& request) {
  const Json out = {{"schema", 1}, {"shots", shots_json()}, {"materials", materials_json()}, {"looks", looks_json()}, {"problems", problems_json()}};
  if (request.json) {
    std::fputs(document_text(out).c_str(), stdout);
    return;
  }
  std::printf("shots\n");
  for (const Json& shot : out["shots"])
    std::printf("  %-16s %4lld frames  %lldx%lld  %s\n", shot["name"].get<std::string>().c_str(), shot["frames"].get<long long>(),
                shot["width"].get<long long>(), shot["height"].get<long long>(), shot["description"].get<std::string>().c_str());
  print_names("materials", out["materials"]);
  print_names("looks    ", out["looks"]);
  print_names("problems ", out["problems"]);
}

}  // namespace app
