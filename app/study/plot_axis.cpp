#include "app/study/plot_axis.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/text.h"

namespace app {
namespace {

constexpr int kMostTicks = 7;

std::string superscript(int number) {
  static constexpr const char* kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = number < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(number))) text += kDigits[digit - '0'];
  return text;
}

std::vector<Tick> linear_ticks(double low, double high) {
  const double step = base::round_up((high - low) / kMostTicks);
  std::vector<Tick> ticks;
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
    ticks.push_back({k * step, tick_text(std::abs(k * step) < 1e-9 * step ? 0 : k * step)});
  return ticks;
}

std::vector<Tick> log_ticks(double low, double high) {
  const int first = static_cast<int>(std::floor(std::log10(low))), last = static_cast<int>(std::ceil(std::log10(high)));
  std::vector<Tick> ticks;
  const auto add = [&](double value) {
    if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) ticks.push_back({value, tick_text(value)});
  };
  const double decades = std::log10(high / low);
  if (decades < 0.6) return linear_ticks(low, high);
  const int stride = std::max(1, static_cast<int>(std::ceil(decades / kMostTicks)));
  for (int e = first; e <= last; ++e) {
    if (e % stride == 0) add(std::pow(10, e));
    // all alike
    if (decades > 4 && e != 0 && e != 1 && !ticks.empty() && ticks.back().value == std::pow(10, e)) ticks.back().text = "10" + superscript(e);
    if (decades > 3) continue;
    for (const double digit : {2.0, 5.0}) add(digit * std::pow(10, e));
  }
  return ticks.size() < 3 ? linear_ticks(low, high) : ticks;
}

}  // namespace

std::string tick_text(double value) {
  char text[32];
  const double size = std::abs(value);
  if (size == 0) return "0";
  if (size >= 0.999e-4 && size < 0.9999e5) {
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
  }
  std::snprintf(text, sizeof text, "%.3e", value);
  std::string digits = text;
  const std::size_t e = digits.find('e');
  const int power = std::stoi(digits.substr(e + 1));
  digits.resize(e);
  digits.erase(digits.find_last_not_of('0') + 1);
  if (digits.back() == '.') digits.pop_back();
  const std::string tail = "10" + superscript(power);
  return digits == "1" ? tail : digits == "-1" ? "-" + tail : digits + "×" + tail;
}

Axis with_whole_ticks(Axis axis) {
  std::erase_if(axis.ticks, [](const Tick& tick) { return tick.value != std::round(tick.value); });
  return axis;
}

double Axis::place(double value) const { return log ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low); }

Axis axis_for(double low, double high, bool log, double margin, bool keeps_zero) {
  Axis axis;
  axis.log = log;
  if (log) {
    const double widened = std::pow(high / low, margin), least = std::max(widened, high / low < 1.05 ? 1.5 : 1.0);
    axis.low = low / least;
    axis.high = high * least;
    axis.ticks = log_ticks(axis.low, axis.high);
    return axis;
  }
  double length = high - low;
  if (length <= 1e-12 * std::max(std::abs(low), std::abs(high))) length = std::max(std::abs(low), std::abs(high));
  if (length == 0) length = 1;
  const bool is_flat = high - low < 0.5 * length;   // a constant: some room around it
  axis.low = keeps_zero && low == 0 ? 0 : low - length * (is_flat ? 0.5 : margin);
  axis.high = keeps_zero && high == 0 && low < 0 ? 0 : high + length * (is_flat ? 0.5 : margin);
  axis.ticks = linear_ticks(axis.low, axis.high);
  return axis;
}

}  // namespace app
