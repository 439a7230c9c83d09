#pragma once
// The ledger: what each pass of a frame cost. A pass is named in the fixed vocabulary of docs/files.md (sort, p2g, pressure ...);
// one that did not run has no row.
#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace base {

struct PassCost {
  std::int64_t calls = 0;
  double seconds = 0;        // wall clock
  std::int64_t bytes = 0;    // read and written, as the algorithm counts them
};

/// Costs of one frame and stage. Not thread-safe: passes run one after another.
class Ledger {
 public:
  /// Runs from construction to destruction of the returned object and adds one call to `name`.
  class Timer {
   public:
    Timer(Ledger& ledger, std::string_view name, std::int64_t bytes);
    ~Timer();
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;

   private:
    Ledger& ledger_;
    std::string name_;
    std::int64_t bytes_;
    std::chrono::steady_clock::time_point start_;
  };
  [[nodiscard]] Timer pass(std::string_view name, std::int64_t bytes = 0) { return {*this, name, bytes}; }
  void add(std::string_view name, const PassCost&);
  const std::map<std::string, PassCost, std::less<>>& passes() const { return passes_; }
  void clear() { passes_.clear(); }

 private:
  std::map<std::string, PassCost, std::less<>> passes_;
};

}  // namespace base
