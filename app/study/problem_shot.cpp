#include "app/study/problem_shot.h"

#include "app/shot/layers.h"
#include "app/shot/reader.h"
#include "app/shot/toml.h"
#include "base/error.h"

namespace app {

ProblemShot read_problem(const sim::ProblemRow& row, const Overrides& overrides) {
  const std::string name(row.name);
  ProblemShot read{{}, row.make(), {}};
  const Layers layers = make_layers(parse_toml(read.problem->shot(), name), name, overrides.quality, overrides.sets);
  const Node root = merged(layers);
  Reader reader(root, name);
  read.shot.params(reader);
  reader.table("problem", "the problem's own keys", [&](base::Params& p) { read.problem->params(p); });
  reader.finish();
  reader.throw_if_wrong();
  read.shot.name = name;
  read.shot.file = name;
  const std::string objection = read.problem->objection(read.shot.scene);
  if (!objection.empty()) throw base::Error({.file = name, .message = objection});
  Node keys;
  for (const std::string_view table : {"shot", "sim", "body", "collider", "effect", "problem"})
    if (const Node* found = reader.complete().find(table)) keys.at(table) = *found;
  read.text = shot_text(keys);
  return read;
}

}  // namespace app
