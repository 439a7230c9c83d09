#include "app/study/front.h"

#include <algorithm>

#include <fmt/format.h>

#include "app/study/text.h"
#include "app/study/time_to_error.h"

namespace app {
namespace {

constexpr double kSlack = 1.05, kSlackOfOne = 1.25;   // of a time that was measured; of one that was measured once
constexpr double kOtherWayRound = 1.25;
constexpr double kSameError = 1.01;

/// The deciding error of a variant, or the noise where it is not above it.
std::optional<double> deciding(const Variant& v, const StudyCase& c) {
  if (!v.ran()) return {};
  return v.errors[c.decides] ? v.errors[c.decides] : c.noise[c.decides];
}

bool dominates(const Variant& a, double error_a, const Variant& b, double error_b) {
  if (error_a > error_b * kSameError) return false;
  const bool same_error = error_a * kSameError >= error_b, same_time = is_tie(a, b);
  if (same_error && same_time) return std::pair(a.seconds_median, error_a) < std::pair(b.seconds_median, error_b);
  return same_time || a.seconds_median < b.seconds_median;
}

struct OnFront {
  Variant* variant;
  double error;
};

std::array<std::string, 3> sentences(const StudyCase& c, std::vector<OnFront> front) {
  if (front.empty()) return {"No variant could be measured.", "", ""};
  std::sort(front.begin(), front.end(), [](const OnFront& a, const OnFront& b) { return a.error > b.error; });   // and so from fast to slow
  const auto best = std::min_element(front.begin(), front.end(), [](const OnFront& a, const OnFront& b) {
    return a.error * a.variant->seconds_median < b.error * b.variant->seconds_median;
  });
  const std::string error(kMeasureNames[static_cast<std::size_t>(c.decides)]);
  std::array<std::string, 3> said;
  said[0] = fmt::format("Best value: {}, with an error of {} of {:.3g} in {:.3g} s.", best->variant->label, error, best->error,
                        best->variant->seconds_median);
  const auto next = best + 1;
  if (next == front.end()) said[1] = "No variant that was tried has less error.";
  else
    said[1] = fmt::format("The next rung, {}, costs {} times the time and leaves {} of the error.", next->variant->label,
                          ratio_text(next->variant->seconds_median / best->variant->seconds_median), ratio_text(next->error / best->error));
  if (best == front.begin()) said[2] = "No faster variant that was tried is worth it.";
  else
    said[2] =
        fmt::format("The rung below, {}, takes {} of the time and has {} times the error.", (best - 1)->variant->label,
                    ratio_text((best - 1)->variant->seconds_median / best->variant->seconds_median), ratio_text((best - 1)->error / best->error));
  return said;
}

}  // namespace

void sum_up_seconds(Variant& v) {
  if (v.seconds.empty()) return;
  std::vector<double> sorted = v.seconds;
  std::sort(sorted.begin(), sorted.end());
  v.seconds_min = sorted.front(), v.seconds_max = sorted.back();
  v.seconds_median = 0.5 * (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]);
}

bool is_tie(const Variant& a, const Variant& b) {
  const double slack = a.seconds.size() > 1 && b.seconds.size() > 1 ? kSlack : kSlackOfOne;
  return a.seconds_min <= slack * b.seconds_max && b.seconds_min <= slack * a.seconds_max;
}

std::string doubt_of_the_clock(const Study& study) {
  std::size_t pairs = 0, reversed = 0;
  std::string first;
  for (const Variant& a : study.variants)
    for (const Variant& b : study.variants) {
      if (a.part != b.part || !a.ran() || !b.ran() || a.seconds_median >= b.seconds_median || is_tie(a, b)) continue;
      ++pairs;
      if (a.cpu_seconds <= kOtherWayRound * b.cpu_seconds) continue;
      if (reversed++ == 0) first = a.label + " and " + b.label;
    }
  if (reversed == 0) return "";
  constexpr const char* kDoubt = "the clock and CPU seconds put {} of {} pairs the other way round ({}{}): threads waited, or something else ran";
  return fmt::format(kDoubt, reversed, pairs, first, reversed > 1 ? " ..." : "");
}

void judge(Study& study) {
  for (StudyCase& c : study.cases) {
    std::vector<Variant*> all;
    for (Variant& v : study.variants)
      if (v.part == c.name && v.ran()) all.push_back(&v);
    std::vector<OnFront> known, front;
    for (Variant* const v : all) {
      v->ties.clear(), v->pareto = false;
      for (const Variant* const w : all)
        if (w != v && is_tie(*v, *w)) v->ties.push_back(w->label);
      if (const std::optional<double> error = deciding(*v, c)) known.push_back({v, *error});
    }
    // From the least error on. Ties are not transitive: one that is beaten by a tie alone is beaten only if the winner stays on the front itself.
    std::sort(known.begin(), known.end(), [](const OnFront& a, const OnFront& b) {
      return std::pair(a.error, a.variant->seconds_median) < std::pair(b.error, b.variant->seconds_median);
    });
    for (const OnFront& v : known) {
      const auto beats = [&](const OnFront& w) { return w.variant != v.variant && dominates(*w.variant, w.error, *v.variant, v.error); };
      const auto beats_clearly = [&](const OnFront& w) { return beats(w) && !is_tie(*w.variant, *v.variant); };
      v.variant->pareto = std::none_of(front.begin(), front.end(), beats) && std::none_of(known.begin(), known.end(), beats_clearly);
      if (v.variant->pareto) front.push_back(v);
    }
    c.sentences = sentences(c, front);
    if (!study.is_refined) continue;
    c.times = time_to_error(study, c);
    if (!c.times.levels.empty()) c.sentences = sentences_of(c.times, std::string(kMeasureNames[static_cast<std::size_t>(c.decides)]));
  }
  if (std::string doubt = doubt_of_the_clock(study); !doubt.empty()) study.notes.push_back(std::move(doubt));
}

}  // namespace app
