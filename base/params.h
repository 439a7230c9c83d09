#pragma once
// Parameters, declared once. A struct of options lists its keys in `void params(base::Params& p)`; the shot reader, the
// `params` command, the documentation table and the tests all visit that one list:
//
//   void params(Params& p) {
//     p("young", young, "Pa", "Young's modulus", above(0));
//     p.choice("kernel", kernel, kKernelNames, "interpolation kernel");
//     p.require(size_is_ok, "cell", "domain is no multiple of it; the nearest is 0.02 m");
//   }
//
// The value a member holds before the visit is its default.
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/vec.h"

namespace base {

/// Set of allowed numbers: one interval, each end open or closed.
struct Range {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;
  bool contains(double v) const { return (low_open ? v > low : v >= low) && (high_open ? v < high : v <= high); }
  std::string text() const;  // "above 0", "at least 1", "between 0 and 1 (both excluded)"; empty when all is allowed
};
inline Range any() { return {}; }
inline Range above(double low) { return {.low = low, .low_open = true}; }
inline Range at_least(double low) { return {.low = low}; }
inline Range between(double low, double high) { return {low, high, true, true}; }   // both ends excluded
inline Range within(double low, double high) { return {low, high, false, false}; }  // both ends included

/// Declaration of one key. `unit` is SI in brackets' stead ("m", "m/s", "1"); empty where a unit makes no sense.
struct Key {
  std::string_view name, unit, meaning;
  Range range = {};
  std::span<const std::string_view> choices = {};  // texts: what is accepted, or empty when anything is
  std::string default_text = {};                   // what an unset optional means ("half of sim.cell")
};

/// A count or one of a few names: sim.modes = 4 | "full".
struct CountOrName {
  std::int64_t count = 0;  // 0 when a name is given
  std::string name;
};

/// A visitor over declared keys. Numbers are finite; vectors have vector_size() numbers, each within the range, and then zeros.
class Params {
 public:
  virtual ~Params() = default;

  /// From here on vectors and the corners of boxes are written with `n` numbers, 2 or 3.
  void vectors_have(std::int64_t n) { vector_size_ = n; }
  std::int64_t vector_size() const { return vector_size_; }

  void operator()(std::string_view name, double& v, std::string_view unit, std::string_view meaning, Range r = {}) { number({name, unit, meaning, r}, v); }
  void operator()(std::string_view name, std::int64_t& v, std::string_view unit, std::string_view meaning, Range r = {}) { integer({name, unit, meaning, r}, v); }
  void operator()(std::string_view name, Vec3& v, std::string_view unit, std::string_view meaning, Range r = {}) { vector({name, unit, meaning, r}, v); }
  void operator()(std::string_view name, Box& v, std::string_view unit, std::string_view meaning) { box({name, unit, meaning}, v); }
  void operator()(std::string_view name, bool& v, std::string_view meaning) { flag({name, "", meaning}, v); }
  void operator()(std::string_view name, std::string& v, std::string_view meaning, std::span<const std::string_view> choices = {}) { text({name, "", meaning, {}, choices}, v); }
  /// An optional number stays empty when the shot is silent; `default_text` says what that means.
  void operator()(std::string_view name, std::optional<double>& v, std::string_view unit, std::string_view meaning, Range r, std::string default_text) { optional_number({name, unit, meaning, r, {}, std::move(default_text)}, v); }
  void operator()(std::string_view name, std::optional<Vec3>& v, std::string_view unit, std::string_view meaning, std::string default_text) { optional_vector({name, unit, meaning, {}, {}, std::move(default_text)}, v); }
  void operator()(std::string_view name, std::optional<Box>& v, std::string_view unit, std::string_view meaning, std::string default_text) { optional_box({name, unit, meaning, {}, {}, std::move(default_text)}, v); }

  /// An enumeration from 0, written as text; `names` in the order of its values.
  template <class Enum>
  void choice(std::string_view name, Enum& v, std::span<const std::string_view> names, std::string_view meaning) {
    std::string word(names[static_cast<std::size_t>(v)]);
    text({name, "", meaning, {}, names}, word);
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i] == word) v = static_cast<Enum>(i);
  }
  /// Only some of its values, each with its name.
  template <class Enum>
  void choice(std::string_view name, Enum& v, std::span<const std::string_view> names, std::span<const Enum> values, std::string_view meaning) {
    std::size_t at = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (values[i] == v) at = i;
    std::string word(names[at]);
    text({name, "", meaning, {}, names}, word);
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i] == word) v = values[i];
  }
  virtual void count_or_name(const Key&, CountOrName&) = 0;

  /// A nested table of keys. Returns whether the shot has it.
  virtual bool table(std::string_view name, std::string_view meaning, const std::function<void(Params&)>& keys) = 0;
  /// A name, or a table whose key `preset` holds that name and whose other keys override it: body.material.
  /// `keys` is called with the name already in `preset`, so that it can start from the preset's values.
  virtual void preset_or_table(std::string_view name, std::string& preset, std::span<const std::string_view> names, std::string_view meaning,
                               const std::function<void(Params&)>& keys) = 0;
  /// An array of tables, [[body]]: each entry is a T with a params() of its own, which it visits as a copy of `start`.
  template <class T>
  void list(std::string_view name, std::vector<T>& entries, std::string_view meaning, const T& start = {}) {
    list_of(name, meaning, [&](std::size_t n) { entries.resize(n, start); }, [&](std::size_t i, Params& p) { entries[i].params(p); });
  }
  /// Named tables, [look.NAME]. An entry that is already there is changed, not replaced.
  template <class T>
  void named(std::string_view name, std::map<std::string, T>& entries, std::string_view meaning) {
    map_of(name, meaning, [&](const std::string& entry, Params& p) { entries[entry].params(p); });
  }

  /// Keys that apply only where `condition` holds. `needs` puts it into words for whoever sets one elsewhere: "kind = \"area\"". A visitor that
  /// describes all keys calls every `keys`, whatever the condition.
  virtual void where(bool condition, std::string_view /*needs*/, const std::function<void()>& keys) {
    if (condition) keys();
  }
  /// The same, where words would say nothing: what is not in there has a reason of its own (without).
  virtual bool when(bool condition) { return condition; }
  /// A table that has no effect here: a reader that meets it complains with `reason`.
  virtual void without(std::string_view /*table*/, std::string_view /*reason*/) {}
  /// A law over several keys. When it fails the reader complains at `key` (a key of this table) with `message`.
  virtual void require(bool /*holds*/, std::string_view /*key*/, const std::string& /*message*/) {}

 protected:
  virtual void number(const Key&, double&) = 0;
  virtual void integer(const Key&, std::int64_t&) = 0;
  virtual void flag(const Key&, bool&) = 0;
  virtual void text(const Key&, std::string&) = 0;
  virtual void vector(const Key&, Vec3&) = 0;
  virtual void box(const Key&, Box&) = 0;
  virtual void optional_number(const Key&, std::optional<double>&) = 0;
  virtual void optional_vector(const Key&, std::optional<Vec3>&) = 0;
  virtual void optional_box(const Key&, std::optional<Box>&) = 0;
  virtual void list_of(std::string_view name, std::string_view meaning, const std::function<void(std::size_t)>& resize,
                       const std::function<void(std::size_t, Params&)>& entry) = 0;
  virtual void map_of(std::string_view name, std::string_view meaning, const std::function<void(const std::string&, Params&)>& entry) = 0;

 private:
  std::int64_t vector_size_ = 3;
};

}  // namespace base
