#pragma once
// Runs a case's scene frame by frame and keeps what cases ask of it.
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sim/watch.h"
#include "sim/verify.h"

namespace sim::verify {

/// The larger one; no number stays none, and no case passes with that.
inline double worse(double most, double off) { return std::isnan(off) || off > most ? off : most; }

struct Course {
  std::vector<Totals> totals;             // after each frame, the start's first
  std::string stopped;                    // what it stopped with; empty: it went all the way
  bool is_finite = true;                  // every position, velocity and sum of every frame
  std::shared_ptr<Simulation> simulation; // as it ended
  Scene scene;

  const Totals& start() const { return totals.front(); }
  const Totals& end() const { return totals.back(); }
  double energy(std::size_t frame) const;         // [J] kinetic, elastic and potential
  double largest_energy() const;                  // over that at the start
  std::int64_t sum(std::int64_t Totals::* counter) const;
};

/// What a course is besides its scene.
struct Plan {
  double fps = 24;
  int frames = 24;
  std::function<void(State&)> prepare = {};                // changes the state it starts from
  std::function<void(const Simulation&)> see = {};         // after each frame
  bool watched = true;                                     // by sim/watch.h, as every run is
  double most_energy = 10;                                 // over that at the start: what has more has blown up, and is followed no further
};
Course follow(const Scene&, const Plan&);

/// The course's energy curve, picture and what must hold of any: finite numbers, mass to the last particle, no unexpected stop.
CaseOutcome report(const Course&, double value, std::string outcome);

/// "energy 1.0002 of the start" and the like.
std::string say(const char* format, ...) __attribute__((format(printf, 1, 2)));

/// Numbers of one column of a state, row by row, changed in place.
template <class Number>
void edit(State& state, std::string_view name, const std::function<void(std::int64_t row, Number* values)>& change) {
  for (Column& c : state.columns) {
    if (c.name != name) continue;
    std::vector<Number> row(std::size_t(c.width));
    for (std::int64_t r = 0; r < c.rows; ++r) {
      std::byte* const at = c.bytes.data() + std::size_t(r * c.width) * sizeof(Number);
      std::memcpy(row.data(), at, row.size() * sizeof(Number));
      change(r, row.data());
      std::memcpy(at, row.data(), row.size() * sizeof(Number));
    }
  }
}
/// The same of a column of the scene's precision.
void edit_reals(State&, std::string_view name, Precision, const std::function<void(std::int64_t row, double* values)>&);

}  // namespace sim::verify
