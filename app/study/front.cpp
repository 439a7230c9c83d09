#include "app/study/front.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace app {
namespace {

constexpr double kSlack = 1.05;       // of a time that was measured
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

std::string ratio_text(double ratio) { return ratio < 10 ? fmt::format("{:.2g}", ratio) : fmt::format("{:.0f}", ratio); }

struct OnFront {
  const Variant* variant;
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

bool is_tie(const Variant& a, const Variant& b) { return a.seconds_min <= kSlack * b.seconds_max && b.seconds_min <= kSlack * a.seconds_max; }

void judge(Study& study) {
  for (StudyCase& c : study.cases) {
    std::vector<Variant*> all;
    for (Variant& v : study.variants)
      if (v.part == c.name && v.ran()) all.push_back(&v);
    std::vector<OnFront> front;
    for (Variant* const v : all) {
      v->ties.clear();
      for (const Variant* const w : all)
        if (w != v && is_tie(*v, *w)) v->ties.push_back(w->label);
      const std::optional<double> error = deciding(*v, c);
      v->pareto = error && std::none_of(all.begin(), all.end(), [&](const Variant* w) {
        const std::optional<double> other = deciding(*w, c);
        return w != v && other && dominates(*w, *other, *v, *error);
      });
      if (v->pareto) front.push_back({v, *error});
    }
    c.sentences = sentences(c, front);
  }
}

}  // namespace app
