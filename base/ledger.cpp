#include "base/ledger.h"

namespace base {

Ledger::Timer::Timer(Ledger& ledger, std::string_view name, std::int64_t bytes)
    : ledger_(ledger), name_(name), bytes_(bytes), start_(std::chrono::steady_clock::now()) {}

Ledger::Timer::~Timer() {
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start_;
  ledger_.add(name_, {1, passed.count(), bytes_});
}

void Ledger::add(std::string_view name, const PassCost& cost) {
  auto found = passes_.find(name);
  if (found == passes_.end()) found = passes_.emplace(name, PassCost{}).first;
  found->second.calls += cost.calls;
  found->second.seconds += cost.seconds;
  found->second.bytes += cost.bytes;
}

}  // namespace base
