#include "app/study/problem_shot.h"

#include "app/shot/describe.h"
#include "app/shot/layers.h"
#include "app/shot/reader.h"
#include "app/shot/toml.h"
#include "base/error.h"
#include "sim/size.h"

namespace app {

std::vector<KeyRow> problem_keys(const sim::ProblemRow& row) {
  const std::unique_ptr<sim::Problem> problem = row.make();
  return keys_of("problem", [&](base::Params& p) { problem->params(p); });
}

ProblemShot read_problem(const sim::ProblemRow& row, const Overrides& overrides) {
  const std::string name(row.name);
  ProblemShot read{{}, row.make(), {}};
  const Layers layers = make_layers(parse_toml(read.problem->shot(), name), name, overrides.quality, overrides.sets);
  const Node root = merged(layers);
  Reader reader(root, name);
  read.shot.params(reader);
  reader.table("problem", "the problem's own keys", [&](base::Params& p) { read.problem->params(p); });
  reader.finish();
  try {
    reader.throw_if_wrong();
  } catch (const base::Error& e) {
    base::Complaint complaint = e.complaint();
    if (!complaint.key.starts_with("problem.") || complaint.message != "unknown key" || !complaint.hint.empty()) throw;
    for (const KeyRow& key : problem_keys(row)) complaint.hint += (complaint.hint.empty() ? "there is " : ", ") + key.key;
    throw base::Error(std::move(complaint));
  }
  read.shot.name = name;
  read.shot.file = name;
  const std::string objection = read.problem->objection(read.shot.scene);
  if (!objection.empty()) throw base::Error({.file = name, .message = objection});
  Node keys;
  for (const std::string_view table : {"sim", "body", "collider", "effect", "problem"})
    if (const Node* found = reader.complete().find(table)) keys.at(table) = *found;
  read.text = shot_text(keys);
  const sim::Options& o = read.shot.scene.options;
  const double projections = o.splitting == sim::Splitting::reflection ? 2 : 1, wider = o.kernel == sim::Kernel::quadratic ? 1.4 : 1;
  const double cells_a_step = o.is_solid() ? o.sound_cfl : o.cfl;
  read.work = projections * wider * sim::size_of(read.shot.scene).particles / (o.cell * cells_a_step);
  if (const Node* own = keys.find("problem"))
    if (const Node* time = own->find("time"); time && time->kind == Node::Kind::number) read.work *= time->number;
  return read;
}

}  // namespace app
