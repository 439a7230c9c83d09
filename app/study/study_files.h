#pragma once
// A study as cost.csv and cost.json (docs/cost-of-accuracy.md says what each column is).
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "app/study/study.h"

namespace app {

/// A row a variant; fields as RFC 4180 has them, empty where a value does not apply.
std::string csv_text(const Study&);
/// Schema 1; what does not apply is absent.
nlohmann::ordered_json study_json(const Study&);
/// For people: a table of each case with its sentences.
std::string study_table(const Study&);

}  // namespace app
