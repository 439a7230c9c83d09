#pragma once
// Reflection adds energy where particles are few. Whoever reflects asks after every step.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

namespace sim {

/// Energy [J] against its running minimum: a flow without supply has no more than it had. Above kCaution of it the next step does not
/// reflect; above kAlarm none does any more.
class EnergyWatch {
 public:
  static constexpr double kCaution = 1.005, kAlarm = 1.02;
  void see(double energy) {
    least_ = std::min(least_, energy);
    alarmed_ = alarmed_ || energy > kAlarm * least_;
    cautious_ = energy > kCaution * least_;
  }
  bool reflects() const { return !alarmed_ && !cautious_; }
  bool alarmed() const { return alarmed_; }
  /// For checkpoints: all that it remembers.
  std::array<double, 3> state() const { return {least_, double(cautious_), double(alarmed_)}; }
  void restore(const std::array<double, 3>& s) { least_ = s[0], cautious_ = s[1] != 0, alarmed_ = s[2] != 0; }

 private:
  double least_ = std::numeric_limits<double>::max();
  bool cautious_ = false, alarmed_ = false;
};

}  // namespace sim
