#pragma once
// How far two rows of values lie apart, whatever the values are: what `diff` counts for pixels, voxels and particles.
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace base {

/// Sums over pairs. `limit` and all lengths are in the unit of the values.
struct Differences {
  double limit = 0;                       // a pair further apart than this is over
  std::uint64_t count = 0, over = 0;      // pairs
  std::uint64_t not_finite = 0;           // pairs with a NaN or an infinity in them: always over, and in none of the sums
  double sum = 0, squares = 0, largest = 0;

  /// `weight` pairs that lie `difference` apart.
  void add(double difference, std::uint64_t weight = 1) {
    count += weight;
    if (!std::isfinite(difference)) {
      not_finite += weight;
      over += weight;
      return;
    }
    const double w = static_cast<double>(weight);
    sum += w * difference;
    squares += w * difference * difference;
    largest = std::max(largest, difference);
    if (difference > limit) over += weight;
  }
  void add(const Differences& other) {
    count += other.count;
    over += other.over;
    not_finite += other.not_finite;
    sum += other.sum;
    squares += other.squares;
    largest = std::max(largest, other.largest);
  }

  std::uint64_t measured() const { return count - not_finite; }
  /// Zero where nothing was measured.
  double mean() const { return measured() > 0 ? sum / static_cast<double>(measured()) : 0; }
  double rms() const { return measured() > 0 ? std::sqrt(squares / static_cast<double>(measured())) : 0; }
  double percent_over() const { return count > 0 ? 100 * static_cast<double>(over) / static_cast<double>(count) : 0; }
};

}  // namespace base
