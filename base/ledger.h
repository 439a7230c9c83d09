#pragma once
// The ledger: what each pass of a frame cost, and what particles held. A pass is named in the fixed vocabulary of docs/files.md (sort,
// p2g, pressure ...); one that did not run has no row, and one that the plan does not name cannot run.
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "base/plan.h"

namespace base {

struct PassCost {
  std::int64_t calls = 0;
  double seconds = 0;        // wall clock
  std::int64_t bytes = 0;    // read and written, as the algorithm counts them
  double cpu_seconds = 0;    // of all threads of the process
};

/// CPU seconds of all threads of this process so far.
double process_seconds();

/// The most resident memory this process had so far [bytes]. (getrusage also counts what its parent had when it started it.)
std::int64_t peak_memory();

/// Costs of one frame and stage. Not thread-safe: passes run one after another.
class Ledger {
  struct Moment {
    std::chrono::steady_clock::time_point clock{};
    double cpu = 0;   // [s]
  };

 public:
  /// Takes whatever comes: for passes that run outside of any stage.
  Ledger() = default;
  /// Takes what `plan` names; anything else is a fault of the program and throws base::Error (exit 1) with its name.
  explicit Ledger(Plan plan) : plan_(std::move(plan)) {}

  /// Runs from construction to destruction of the returned object and adds one call to its pass.
  class Timer {
   public:
    Timer(Ledger& ledger, std::string_view name, std::int64_t bytes);
    ~Timer();
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;
    /// Bytes that are not known before the work is done.
    void count(std::int64_t bytes) { bytes_ += bytes; }

   private:
    Ledger& ledger_;
    std::string name_;
    std::int64_t bytes_;
    Moment start_;
  };
  [[nodiscard]] Timer pass(std::string_view name, std::int64_t bytes = 0) {
    require_planned(name);
    return {*this, name, bytes};
  }
  void add(std::string_view name, const PassCost&);
  const std::map<std::string, PassCost, std::less<>>& passes() const { return passes_; }

  /// An array that holds `bytes` for all particles together.
  void hold(std::string_view attribute, std::int64_t bytes);
  const std::map<std::string, std::int64_t, std::less<>>& attributes() const { return attributes_; }

  void clear() { passes_.clear(), attributes_.clear(); }

 private:
  void require_planned(std::string_view pass) const;
  /// Now; or when the pass before ended, where that is so short ago that nothing but this lies between: asking for CPU seconds takes as long as a
  /// small pass, and the two are then without a gap.
  Moment start() const;

  std::optional<Plan> plan_;
  Moment last_;   // end of a pass
  std::map<std::string, PassCost, std::less<>> passes_;
  std::map<std::string, std::int64_t, std::less<>> attributes_;
};

}  // namespace base
