#pragma once
// The exact state of a simulation between frames, as columns of plain numbers: what a checkpoint holds.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace sim {

/// One array of the state: `rows` x `width` numbers of one type, little-endian as in memory.
struct Column {
  enum class Type { int32, int64, float32, float64 };
  std::string name;                  // "cell", "offset", "coefficients", "id"
  Type type = Type::float32;
  std::int64_t rows = 0, width = 1;
  std::vector<std::byte> bytes;
};

struct State {
  std::int64_t frame = 1;            // the frame it stands at
  std::vector<Column> columns;

  const Column* find(std::string_view name) const {
    for (const Column& c : columns)
      if (c.name == name) return &c;
    return nullptr;
  }
};

template <class Number>
constexpr Column::Type column_type() {
  static_assert(std::is_integral_v<Number> ? std::is_signed_v<Number> : std::is_floating_point_v<Number>);
  static_assert(sizeof(Number) == 4 || sizeof(Number) == 8);
  if constexpr (std::is_integral_v<Number>) return sizeof(Number) == 4 ? Column::Type::int32 : Column::Type::int64;
  return sizeof(Number) == 4 ? Column::Type::float32 : Column::Type::float64;
}

/// A column from an array whose elements are `width` Numbers side by side.
template <class Number, class Element>
Column make_column(std::string name, const std::vector<Element>& values, std::int64_t width) {
  static_assert(std::is_trivially_copyable_v<Number>);
  Column c{std::move(name), column_type<Number>(), 0, width, {}};
  c.bytes.resize(values.size() * sizeof(Element));
  c.rows = std::int64_t(c.bytes.size() / (sizeof(Number) * std::size_t(width)));
  if (!values.empty()) std::memcpy(c.bytes.data(), static_cast<const void*>(values.data()), c.bytes.size());
  return c;
}

/// The array back; false when type, width or rows are others.
template <class Number, class Element>
bool read_column(const State& state, std::string_view name, std::int64_t rows, std::int64_t width, std::vector<Element>& values) {
  const Column* const c = state.find(name);
  const auto bytes = std::size_t(rows * width) * sizeof(Number);
  if (!c || c->type != column_type<Number>() || c->rows != rows || c->width != width || c->bytes.size() != bytes) return false;
  values.resize(bytes / sizeof(Element));
  if (bytes) std::memcpy(static_cast<void*>(values.data()), c->bytes.data(), bytes);
  return true;
}

/// The numbers of a column, whatever their type, row by row; none where there is no such column.
inline std::vector<double> reals(const State& state, std::string_view name) {
  std::vector<double> values;
  const auto fill = [&]<class Number>(const Column& c, Number) {
    std::vector<Number> own(c.bytes.size() / sizeof(Number));
    std::memcpy(own.data(), c.bytes.data(), own.size() * sizeof(Number));
    values.assign(own.begin(), own.end());
  };
  const Column* const c = state.find(name);
  if (!c || c->bytes.empty()) return values;
  switch (c->type) {
    case Column::Type::int32: fill(*c, std::int32_t{}); break;
    case Column::Type::int64: fill(*c, std::int64_t{}); break;
    case Column::Type::float32: fill(*c, 0.0f); break;
    case Column::Type::float64: fill(*c, 0.0); break;
  }
  return values;
}

}  // namespace sim
