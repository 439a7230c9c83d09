#include <nlohmann/json.hpp>

#include "app/stages/document.h"
#include "app/study/cost.h"
#include "app/study/study_files.h"
#include "base/atomic_file.h"

namespace app {

void write_study(const Study& study, const std::filesystem::path& out) {
  base::write_text_atomically(out / "cost.csv", csv_text(study));
  base::write_text_atomically(out / "cost.json", document_text(study_json(study)));
}

}  // namespace app
