#include "base/ledger.h"

#include <time.h>

#include <fstream>

#include "base/error.h"

namespace base {
namespace {

[[noreturn]] void refuse(std::string_view what, std::string_view name, const std::string& stage) {
  throw Error({.code = Exit::fault, .message = std::string(what) + " " + std::string(name) + " is not in the plan of " + stage});
}

}  // namespace

double process_seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

std::int64_t peak_memory() {
  std::ifstream status("/proc/self/status");
  std::int64_t kilobytes = 0;
  for (std::string word; status >> word;)
    if (word == "VmHWM:") status >> kilobytes;
  return kilobytes * 1024;
}

Ledger::Timer::Timer(Ledger& ledger, std::string_view name, std::int64_t bytes)
    : ledger_(ledger), name_(name), bytes_(bytes), start_(ledger.start()) {}

Ledger::Timer::~Timer() {
  const double cpu = process_seconds();   // asking takes up to a microsecond, which is still of this pass
  const Moment now{std::chrono::steady_clock::now(), cpu};
  const std::chrono::duration<double> passed = now.clock - start_.clock;
  ledger_.add(name_, {1, passed.count(), bytes_, now.cpu - start_.cpu});
  ledger_.last_ = now;
}

Ledger::Moment Ledger::start() const {
  constexpr std::chrono::microseconds kNothing(2);
  const auto now = std::chrono::steady_clock::now();
  return now - last_.clock < kNothing ? last_ : Moment{now, process_seconds()};
}

void Ledger::require_planned(std::string_view pass) const {
  if (plan_ && !plan_->runs(pass)) refuse("pass", pass, plan_->stage);
}

void Ledger::add(std::string_view name, const PassCost& cost) {
  auto found = passes_.find(name);
  if (found == passes_.end()) found = passes_.emplace(name, PassCost{}).first;
  found->second.calls += cost.calls;
  found->second.seconds += cost.seconds;
  found->second.bytes += cost.bytes;
  found->second.cpu_seconds += cost.cpu_seconds;
}

void Ledger::hold(std::string_view attribute, std::int64_t bytes) {
  const auto is_it = [&](const Attribute& a) { return a.name == attribute; };
  if (plan_ && std::none_of(plan_->attributes.begin(), plan_->attributes.end(), is_it)) refuse("attribute", attribute, plan_->stage);
  attributes_[std::string(attribute)] = bytes;
}

}  // namespace base
