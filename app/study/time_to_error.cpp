#include "app/study/time_to_error.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "app/study/text.h"
#include "base/text.h"

namespace app {
namespace {

constexpr std::size_t kMostLevels = 8;   // of more only the powers of ten, and of more of those the least

constexpr double kNoError = 1e-16;       // what is exact counts as this

/// Where the variants' errors pass `level`.
std::optional<TimeToError::Reach> reach_of(double level, const std::vector<const Variant*>& front, Measure measure) {
  const auto error = [&](std::size_t i) { return std::max(kNoError, *front[i]->errors[measure]); };
  std::size_t i = 0;
  while (i < front.size() && error(i) > level) ++i;
  if (i == front.size()) return {};
  if (i == 0) return TimeToError::Reach{front.front()->seconds_median, error(0) < level};
  const double part = std::log(error(i - 1) / level) / std::log(error(i - 1) / error(i));
  return TimeToError::Reach{front[i - 1]->seconds_median * std::pow(front[i]->seconds_median / front[i - 1]->seconds_median, part), false};
}

/// Round numbers below `most`, down to `least`.
std::vector<double> round_levels(double most, double least, std::initializer_list<double> digits) {
  std::vector<double> levels;
  for (int power = int(std::floor(std::log10(most))); power >= int(std::floor(std::log10(least))); --power)
    for (const double digit : digits)
      if (const double level = digit * std::pow(10, power); level <= most && level >= least) levels.push_back(level);
  return levels;
}

}  // namespace

std::vector<const Variant*> own_front(const Study& study, const StudyCase& part, const std::string& scheme) {
  std::vector<const Variant*> all, front;
  for (const Variant& v : study.variants)
    if (v.part == part.name && v.scheme == scheme && v.ran() && v.errors[part.decides]) all.push_back(&v);
  std::stable_sort(all.begin(), all.end(), [](const Variant* a, const Variant* b) { return a->seconds_median < b->seconds_median; });
  for (const Variant* v : all)
    if (front.empty() || *v->errors[part.decides] < *front.back()->errors[part.decides]) front.push_back(v);
  return front;
}

std::vector<std::string> schemes_of(const Study& study, const StudyCase& part) {
  std::vector<std::string> schemes;
  for (const Variant& v : study.variants)
    if (v.part == part.name && !v.scheme.empty() && std::find(schemes.begin(), schemes.end(), v.scheme) == schemes.end()) schemes.push_back(v.scheme);
  return schemes;
}

TimeToError time_to_error(const Study& study, const StudyCase& part) {
  TimeToError times;
  std::vector<std::vector<const Variant*>> fronts;
  std::vector<double> first, last;   // the largest and the least error of each front
  for (const std::string& scheme : schemes_of(study, part)) {
    std::vector<const Variant*> front = own_front(study, part, scheme);
    if (front.empty()) continue;
    first.push_back(std::max(kNoError, *front.front()->errors[part.decides])), last.push_back(std::max(kNoError, *front.back()->errors[part.decides]));
    times.rows.push_back({scheme, {}}), fronts.push_back(std::move(front));
  }
  if (first.size() < 2) return times;
  std::sort(last.begin(), last.end());
  const double most = *std::max_element(first.begin(), first.end()), least = last[1];
  times.levels = round_levels(most, least, {5, 2, 1});
  if (times.levels.empty()) times.levels = {least};
  if (times.levels.size() > kMostLevels) times.levels = round_levels(most, least, {1});
  if (times.levels.size() > kMostLevels) times.levels.erase(times.levels.begin(), times.levels.end() - std::ptrdiff_t(kMostLevels));
  for (std::size_t k = 0; k < fronts.size(); ++k)
    for (const double level : times.levels) times.rows[k].reaches.push_back(reach_of(level, fronts[k], part.decides));
  return times;
}

std::array<std::string, 3> sentences_of(const TimeToError& times, const std::string& error) {
  std::size_t l = times.levels.size() - 1;
  const auto come = [&](std::size_t level) {
    return std::size_t(std::count_if(times.rows.begin(), times.rows.end(), [&](const TimeToError::Row& row) { return row.reaches[level].has_value(); }));
  };
  while (l > 0 && 2 * come(l) < times.rows.size()) --l;
  std::vector<std::pair<TimeToError::Reach, std::string>> there;
  std::vector<std::string> others;
  for (const TimeToError::Row& row : times.rows) {
    if (row.reaches[l]) there.emplace_back(*row.reaches[l], row.scheme);
    else others.push_back(row.scheme);
  }
  std::stable_sort(there.begin(), there.end(), [](const auto& a, const auto& b) { return a.first.seconds < b.first.seconds; });
  const auto most = [](const TimeToError::Reach& reach) { return reach.at_most ? "at most " : ""; };
  std::vector<std::string> longer;
  for (std::size_t i = 1; i < there.size(); ++i)
    longer.push_back(there[i].second + " " + most(there[i].first) + ratio_text(there[i].first.seconds / there[0].first.seconds));
  return {fmt::format("An error of {} of {:.3g} takes {} {}{:.3g} s.", error, times.levels[l], there[0].second, most(there[0].first), there[0].first.seconds),
          longer.empty() ? "" : "Times as long take " + base::listed(longer) + ".",
          others.empty() ? "" : "Nothing that was tried brings " + base::listed(others) + " there."};
}

}  // namespace app
