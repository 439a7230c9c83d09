#include "sim/empty_body.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/text.h"
#include "sim/colliders/solids.h"
#include "sim/fluid/sources.h"
#include "sim/seeding.h"
#include "sim/transfer/dimension.h"

namespace sim {
namespace {

/// What comes before a body at a place: the colliders, then the bodies named earlier.
struct Holder {
  std::string name;            // "body jelly"
  std::vector<Shape> shapes;   // at t = 0, images included
  bool holds_some = false;     // of the places in the body that is looked at
};

std::string name_of(const std::string& name, std::size_t place) { return name.empty() ? std::to_string(place + 1) : name; }

/// Whether a cell of the range has a place that the shape holds and no holder does. Cells are looked at all over the range from the first ones
/// on: in the order of their numbers a body half of which is taken would be looked at by half.
template <int D, class Real>
bool has_own_place(const Shape& shape, const CellRange<D>& range, const Options& o, const Lattice<D>& lattice, std::vector<Holder>& holders) {
  Cell<D> extent;
  std::int64_t count = 1;
  for (int a = 0; a < D; ++a) extent[a] = range.upper[a] - range.lower[a] + 1, count *= extent[a];
  std::int64_t stride = std::max<std::int64_t>(1, std::int64_t(0.618 * double(count)));   // the golden ratio spreads them evenly
  while (std::gcd(stride, count) != 1) ++stride;
  const int edge = places_along_edge<D>(o);
  for (std::int64_t i = 0, looked_at = 0; i < count; ++i, looked_at = (looked_at + stride) % count) {
    Cell<D> at;
    std::int64_t rest = looked_at;
    for (int a = D - 1; a >= 0; rest /= extent[a], --a) at[a] = range.lower[a] + int(rest % extent[a]);
    for (int sub = 0; sub < int(o.particles_per_cell); ++sub) {
      const base::Vec3 place = seed_place<D, Real>(o, edge, at, number_of<D>(at, lattice), sub).at;
      if (shape.distance(place) >= 0) continue;
      const auto holder = std::find_if(holders.begin(), holders.end(), [&](const Holder& h) { return any_holds(h.shapes, place); });
      if (holder == holders.end()) return true;
      holder->holds_some = true;
    }
  }
  return false;
}

/// Of a body without a particle.
template <int D>
base::Complaint complaint_about(const Body& body, const Options& o, bool outside, const std::vector<Holder>& holders) {
  base::Complaint complaint;
  std::vector<std::string> names;
  for (const Holder& holder : holders)
    if (holder.holds_some) names.push_back(holder.name);
  const base::Box bounds = body.shape.bounds();
  bool whole = true;   // none of it beyond the domain
  for (int a = 0; a < D; ++a) whole = whole && (o.periodic(a) || (bounds.lower[a] >= o.domain.lower[a] && bounds.upper[a] <= o.domain.upper[a]));
  const std::string it = whole ? "it" : "what of it lies in the domain";
  if (outside) complaint.message = "no particle: it lies outside the domain";
  else if (names.empty())
    complaint.message = fmt::format("no particle: {} is too small for their spacing of {:.4g} m", it, o.cell / places_along_edge<D>(o));
  else complaint.message = fmt::format("no particle: {} lies inside {}", it, base::listed(names));
  if (std::any_of(names.begin(), names.end(), [](const std::string& name) { return name.starts_with("body "); }))
    complaint.hint = "a place belongs to the first body that holds it";
  return complaint;
}

template <int D, class Real>
std::optional<EmptyBody> first_empty_body(const Scene& scene) {
  const Options& o = scene.options;
  const Lattice<D> lattice = lattice_of<D>(o);
  std::vector<Holder> holders;
  for (std::size_t c = 0; c < scene.colliders.size(); ++c) {
    Scene alone{.options = o, .bodies = {}, .sources = {}, .colliders = {scene.colliders[c]}, .effects = {}};
    holders.push_back({"collider " + name_of(scene.colliders[c].name, c), Solids<D>(alone, lattice).shapes});
  }
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const Body& body = scene.bodies[b];
    const std::vector<Shape> images = with_images(body.shape, o);
    for (Holder& holder : holders) holder.holds_some = false;
    bool outside = true, filled = false;
    for (std::size_t i = 0; i < images.size() && !filled; ++i) {
      const std::optional<CellRange<D>> range = cells_around<D>(images[i], o, lattice);
      if (!range) continue;
      outside = false;
      filled = has_own_place<D, Real>(images[i], *range, o, lattice, holders);
    }
    const std::string name = name_of(body.name, b);
    if (!filled) {
      EmptyBody empty{"body " + name, b, complaint_about<D>(body, o, outside, holders)};
      empty.complaint.key = "body." + name + ".shape";
      return empty;
    }
    holders.push_back({"body " + name, images});
  }
  return {};
}

/// Of a source that has no cell.
template <int D>
base::Complaint complaint_about(const Source& source, const Options& o, const Lattice<D>& lattice) {
  const std::vector<Shape> images = with_images(source.shape, o);
  const std::vector<std::int64_t> numbers = cells_around<D>(images, o, lattice);
  const bool any = std::any_of(numbers.begin(), numbers.end(), [&](std::int64_t number) {
    base::Vec3 middle = o.domain.lower;
    const Cell<D> at = cell_of<D>(number, lattice);
    for (int a = 0; a < D; ++a) middle[a] += o.cell * (at[std::size_t(a)] + 0.5);
    return any_holds(images, middle);
  });
  base::Complaint complaint;
  if (numbers.empty()) complaint.message = "no cell: it lies outside the domain";
  else complaint.message = any ? "no cell: those with their middles in it are a collider's or an earlier source's"
                                : fmt::format("no cell of {:.4g} m has its middle in it", o.cell);
  return complaint;
}

template <int D>
std::optional<EmptyBody> first_source_amiss(const Scene& scene) {
  if (scene.sources.empty()) return {};
  const Lattice<D> lattice = lattice_of<D>(scene.options);
  const Solids<D> solids(scene, lattice);
  const Sources<D> sources(scene, solids);
  for (std::size_t s = 0; s < scene.sources.size(); ++s) {
    const std::size_t cells = sources.cells(int(s)).size(), shut = sources.shut(int(s), solids).size();
    if (cells > 0 && shut == 0) continue;
    const std::string name = name_of(scene.sources[s].name, s), key = "source." + name;
    EmptyBody empty{"source " + name, s, complaint_about<D>(scene.sources[s], scene.options, lattice)};
    empty.complaint.key = key + ".shape";
    if (cells == 0) return empty;
    empty.complaint.message = fmt::format("{} of its {} cells pour into a wall, a collider or another source, where there is no room", shut, cells);
    empty.complaint.key = key + ".velocity";
    return empty;
  }
  return {};
}

}  // namespace

std::optional<EmptyBody> find_empty_body(const Scene& scene) {
  return with_numbers(scene.options, [&](auto dimension, auto number) {
    constexpr int D = decltype(dimension)::value;
    const std::optional<EmptyBody> body = first_empty_body<D, decltype(number)>(scene);
    return body ? body : first_source_amiss<D>(scene);
  });
}

}  // namespace sim
