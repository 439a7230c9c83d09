#pragma once
// Reflection adds energy where particles are few. Whoever reflects asks after every step.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

namespace sim {

/// Energy less the work done on the flow [J] against its running minimum: no flow has more than it had and was given. Above kCaution of it
/// the next step does not reflect; above kAlarm none does any more. Work counts from 0 at the start.
class EnergyWatch {
 public:
  static constexpr double kCaution = 1.005, kAlarm = 1.02;
  void see(double energy) {
    least_ = std::min(least_, energy - work_);
    const double gained = energy - work_ - least_, had = std::max(least_ + work_, 0.0);
    alarmed_ = alarmed_ || gained > (kAlarm - 1) * had;
    cautious_ = gained > (kCaution - 1) * had;
  }
  void add_work(double work) { work_ += work; }
  bool reflects() const { return !alarmed_ && !cautious_; }
  bool alarmed() const { return alarmed_; }
  /// For checkpoints: all that it remembers.
  using State = std::array<double, 4>;
  State state() const { return {least_, double(cautious_), double(alarmed_), work_}; }
  void restore(const State& s) { least_ = s[0], cautious_ = s[1] != 0, alarmed_ = s[2] != 0, work_ = s[3]; }

 private:
  double least_ = std::numeric_limits<double>::max(), work_ = 0;
  bool cautious_ = false, alarmed_ = false;
};

}  // namespace sim
