#pragma once
// Particles as they are stored: integer cell, offset in it, and the coefficients of the mode set for each velocity component.
// A float world position would lose motion far from the origin; a float offset does not.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "sim/transfer/lattice.h"

namespace sim {

template <int D, class Real>
using Vec = Eigen::Matrix<Real, D, 1>;

/// A component's coefficients, a number for each mode: modes follow each other in a particle's row, D components each.
template <int D, class Number>
class Coefficients {
 public:
  Coefficients(Number* first, int modes) : first_(first), modes_(std::size_t(modes)) {}
  Number& operator[](std::size_t mode) const { return first_[mode * std::size_t(D)]; }
  std::size_t size() const { return modes_; }

 private:
  Number* first_;
  std::size_t modes_;
};

template <int D, class Real>
struct Particles {
  std::vector<Cell<D>> cell;
  std::vector<Vec<D, Real>> offset;        // [cells] in [0, 1)
  std::vector<Real> coefficients;          // [m/s] row, mode, component: row-major
  /// Of each particle, its row of coefficients; empty when particle p has row p. A sort leaves the rows where they are, for the next gather
  /// writes them all anew.
  std::vector<std::uint32_t> rows;
  std::vector<std::int64_t> id;            // from 0
  int modes = 1;                           // coefficients a component
  double mass = 0;                         // [kg] of each particle

  std::size_t size() const { return id.size(); }
  std::size_t row() const { return std::size_t(D * modes); }
  std::size_t row_of(std::size_t p) const { return rows.empty() ? p : rows[p]; }
  Coefficients<D, Real> component(std::size_t p, int a) { return {&coefficients[row_of(p) * row() + std::size_t(a)], modes}; }
  Coefficients<D, const Real> component(std::size_t p, int a) const { return {&coefficients[row_of(p) * row() + std::size_t(a)], modes}; }
  /// Moves every row to its particle.
  void settle() {
    if (rows.empty()) return;
    std::vector<Real> moved(coefficients.size());
    for (std::size_t p = 0; p < size(); ++p) std::copy_n(&coefficients[rows[p] * row()], row(), &moved[p * row()]);
    coefficients.swap(moved);
    rows.clear();
  }
  /// Mean velocity: the constant modes [m/s].
  Vec<D, Real> velocity(std::size_t p) const {
    Vec<D, Real> v;
    for (int a = 0; a < D; ++a) v[a] = component(p, a)[0];
    return v;
  }
  /// Position in cells from the domain's lower corner.
  Vec<D, double> place(std::size_t p) const {
    Vec<D, double> x;
    for (int a = 0; a < D; ++a) x[a] = double(cell[p][a]) + double(offset[p][a]);
    return x;
  }
  void resize(std::size_t n) {
    cell.resize(n), offset.resize(n), id.resize(n), coefficients.resize(n * row()), rows.clear();
  }
};

/// A place along an axis, moved by `step` [cells]: an offset that rounds to 1 becomes 0 of the next cell.
template <class Real>
[[gnu::always_inline]] inline void move_along(int& cell, Real& offset, Real step) {
  const Real moved = offset + step, whole = std::floor(moved), rest = moved - whole;
  const bool next = rest >= 1;
  cell += int(whole) + int(next);
  offset = next ? Real(0) : rest;
}

/// Where something is: cell and offset.
template <int D, class Real>
struct Site {
  Cell<D> cell;
  Vec<D, Real> offset;
  /// Moves by `step` [cells].
  [[gnu::always_inline]] void move(const Vec<D, Real>& step) {
    for (int a = 0; a < D; ++a) move_along(cell[a], offset[a], step[a]);
  }
};

}  // namespace sim
