#include "sim/problems/followed.h"

#include <cmath>
#include <cstring>

namespace sim {
namespace {

/// Calls body(number) with a number of the column's type.
template <class Body>
void with_type(Column::Type type, const Body& body) {
  switch (type) {
    case Column::Type::int32: return body(std::int32_t{});
    case Column::Type::int64: return body(std::int64_t{});
    case Column::Type::float32: return body(float{});
    case Column::Type::float64: return body(double{});
  }
}

}  // namespace

ProblemResult follow(Simulation& simulation, int frames, base::Ledger& ledger, const std::function<void(const Totals&)>& see) {
  ProblemResult result;
  base::Ledger clock;
  Totals now = simulation.totals();
  const double start = now.energy();
  const auto sample = [&] {
    result.time.push_back(now.time);
    result.energy.push_back(now.energy() / start);
    if (see) see(now);
  };
  sample();
  for (int f = 0; f < frames; ++f) {
    {
      const base::Ledger::Timer timer(clock, "step", 0);
      simulation.advance(ledger, {});
    }
    now = simulation.totals();
    result.steps += now.substeps;
    for (const auto& [stage, change] : now.energy_changes) result.energy_changes[stage] += change / start;
    sample();
  }
  result.particles = now.particles;
  result.particle_energy = result.energy.back();
  result.whole = clock.passes().at("step");
  result.errors.energy = std::abs(result.energy.back() - 1);
  return result;
}

std::vector<double> column_of(const State& state, const std::string& name) {
  const Column* const column = state.find(name);
  std::vector<double> values;
  if (!column) return values;
  values.resize(std::size_t(column->rows * column->width));
  with_type(column->type, [&](auto number) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      std::memcpy(&number, column->bytes.data() + i * sizeof number, sizeof number);
      values[i] = double(number);
    }
  });
  return values;
}

void set_column(State& state, const std::string& name, const std::vector<double>& values) {
  for (Column& column : state.columns) {
    if (column.name != name) continue;
    with_type(column.type, [&](auto number) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        number = static_cast<decltype(number)>(values[i]);
        std::memcpy(column.bytes.data() + i * sizeof number, &number, sizeof number);
      }
    });
  }
}

std::vector<double> places_of(const State& state, int axis) {
  const std::vector<double> cell = column_of(state, "cell"), offset = column_of(state, "offset");
  const std::size_t width = width_of(state, "cell");
  std::vector<double> places(cell.size() / width);
  for (std::size_t p = 0; p < places.size(); ++p) places[p] = cell[p * width + std::size_t(axis)] + offset[p * width + std::size_t(axis)];
  return places;
}

std::size_t width_of(const State& state, const std::string& name) {
  const Column* const column = state.find(name);
  return column ? std::size_t(column->width) : 1;
}

}  // namespace sim
