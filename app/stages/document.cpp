#include "app/stages/document.h"

#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/error.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kDeepest = 32;

bool is_deep(const std::string& text) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (quoted && text[i] == '\\') ++i;
    else if (text[i] == '"') quoted = !quoted;
    else if (!quoted && (text[i] == '[' || text[i] == '{') && ++depth > kDeepest) return true;
    else if (!quoted && (text[i] == ']' || text[i] == '}')) --depth;
  }
  return false;
}

}  // namespace

Json read_document(const std::filesystem::path& path, std::uintmax_t limit) {
  const std::string text = base::read_file(path, limit);
  if (is_deep(text)) base::throw_input(path.string(), "not a document of this program");
  Json document = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (document.is_discarded()) base::throw_input(path.string(), "not a JSON document");
  return document;
}

std::string document_text(const Json& document) { return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

}  // namespace app
