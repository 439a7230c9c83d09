#include <numeric>

#include "sim/fluid/multigrid_level.h"

namespace sim {
namespace {

/// The parts of a tile that hang together within it.
template <int D>
struct Parts {
  std::array<std::uint16_t, std::size_t(Tile<D>::kCells)> label;   // from 1; 0: not unknown
  std::vector<std::uint8_t> open;                                  // of each label: touches air inside the tile
};

/// Calls visit(neighbouring cell or -1 outside the tile, face) for the faces of a cell; `extent` cells are in the tile along each axis.
template <int D, class Visit>
void visit_faces(const TileCoefficients<D>& k, const Cell<D>& extent, int cell, const Visit& visit) {
  using T = Tile<D>;
  constexpr int E = T::kEdge;
  const int p = cell / (E * E), r = cell / E % E, l = cell % E;
  visit(l > 0 ? cell - 1 : -1, k.face[D - 1][std::size_t(T::template face<D - 1>(p, r, l))]);
  visit(l < extent[D - 1] - 1 ? cell + 1 : -1, k.face[D - 1][std::size_t(T::template face<D - 1>(p, r, l + 1))]);
  visit(r > 0 ? cell - E : -1, k.face[D - 2][std::size_t(T::template face<D - 2>(p, r, l))]);
  visit(r < extent[D - 2] - 1 ? cell + E : -1, k.face[D - 2][std::size_t(T::template face<D - 2>(p, r + 1, l))]);
  if constexpr (D == 3) {
    visit(p > 0 ? cell - E * E : -1, k.face[0][std::size_t(T::template face<0>(p, r, l))]);
    visit(p < extent[0] - 1 ? cell + E * E : -1, k.face[0][std::size_t(T::template face<0>(p + 1, r, l))]);
  }
}

template <int D>
void label_parts(const TileCoefficients<D>& k, const Cell<D>& extent, Parts<D>& parts) {
  parts.label.fill(0);
  parts.open.assign(1, 0);
  std::vector<int> stack;
  for (int start = 0; start < Tile<D>::kCells; ++start) {
    if (k.kind[std::size_t(start)] != PoissonCell::unknown || parts.label[std::size_t(start)]) continue;
    const auto label = std::uint16_t(parts.open.size());
    bool open = false;
    parts.label[std::size_t(start)] = label;
    stack.assign(1, start);
    while (!stack.empty()) {
      const int cell = stack.back();
      stack.pop_back();
      open = open || k.extra[std::size_t(cell)] > 0;
      visit_faces<D>(k, extent, cell, [&](int other, float face) {
        if (other < 0 || face <= 0) return;
        if (k.kind[std::size_t(other)] != PoissonCell::unknown) open = true;
        else if (!parts.label[std::size_t(other)]) parts.label[std::size_t(other)] = label, stack.push_back(other);
      });
    }
    parts.open.push_back(open);
  }
}

/// Sets of nodes, joined; each knows whether it is open.
class Sets {
 public:
  explicit Sets(std::size_t n) : root_(n), open_(n, 0) { std::iota(root_.begin(), root_.end(), 0); }
  std::int32_t find(std::int32_t i) {
    while (root_[std::size_t(i)] != i) i = root_[std::size_t(i)] = root_[std::size_t(root_[std::size_t(i)])];
    return i;
  }
  void join(std::int32_t i, std::int32_t j) {
    i = find(i), j = find(j);
    if (i == j) return;
    root_[std::size_t(std::max(i, j))] = std::min(i, j);
    open_[std::size_t(std::min(i, j))] |= open_[std::size_t(std::max(i, j))];
  }
  void open(std::int32_t i) { open_[std::size_t(find(i))] = 1; }
  bool is_open(std::int32_t i) { return open_[std::size_t(find(i))]; }

 private:
  std::vector<std::int32_t> root_;
  std::vector<std::uint8_t> open_;
};

template <int D>
class Finder {
 public:
  using T = Tile<D>;
  explicit Finder(Level<D>& level) : level_(level), parts_(level.tile.size()), first_(level.tile.size() + 1, 0) {
    base::parallel_chunks(level.tile.size(), kTilesAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        if (level.coefficients[n]) {
          parts_[n] = std::make_unique<Parts<D>>();
          Cell<D> extent;
          for (int a = 0; a < D; ++a) extent[a] = level.extent(level.tile[n], a);
          label_parts<D>(*level.coefficients[n], extent, *parts_[n]);
        }
    });
    for (std::size_t n = 0; n < level.tile.size(); ++n) first_[n + 1] = first_[n] + (parts_[n] ? std::int32_t(parts_[n]->open.size()) - 1 : 1);
  }

  void run() {
    Sets sets(std::size_t(first_.back()));
    for (std::size_t n = 0; n < level_.tile.size(); ++n) {
      if (parts_[n])
        for (std::size_t label = 1; label < parts_[n]->open.size(); ++label)
          if (parts_[n]->open[label]) sets.open(first_[n] + std::int32_t(label) - 1);
      for (int a = 0; a < D; ++a)
        for (int side = 0; side < 2; ++side) join_across(n, a, side, sets);
    }
    collect(sets);
  }

 private:
  std::int32_t node(std::size_t n, int cell) const {
    if (!parts_[n]) return first_[n];
    const int label = parts_[n]->label[std::size_t(cell)];
    return label ? first_[n] + label - 1 : -1;
  }
  float face(std::size_t n, int axis, int p, int r, int l) const {
    const TileCoefficients<D>* k = level_.coefficients[n].get();
    if (!k) return level_.face;
    if (axis == D - 1) return k->face[D - 1][std::size_t(T::template face<D - 1>(p, r, l))];
    if (axis == D - 2) return k->face[D - 2][std::size_t(T::template face<D - 2>(p, r, l))];
    return k->face[0][std::size_t(T::template face<0>(p, r, l))];
  }
  /// Joins, or opens, what touches a side of tile n.
  void join_across(std::size_t n, int axis, int side, Sets& sets) {
    const std::int32_t other = level_.neighbour[n][std::size_t(neighbour_index<D>(axis, side))];
    if (!parts_[n] && other >= 0 && !parts_[std::size_t(other)]) return sets.join(first_[n], first_[std::size_t(other)]);
    const int here = side ? level_.extent(level_.tile[n], axis) - 1 : 0;
    const int there = side ? 0 : other >= 0 ? level_.extent(level_.tile[std::size_t(other)], axis) - 1 : 0;
    const bool is_plane = D == 3 && axis == 0, is_row = axis == D - 2, is_lane = axis == D - 1;
    for (int p = 0; p < (is_plane ? 1 : T::kPlanes); ++p)
      for (int r = 0; r < (is_row ? 1 : T::kEdge); ++r)
        for (int l = 0; l < (is_lane ? 1 : T::kEdge); ++l) {
          const int own = T::cell(is_plane ? here : p, is_row ? here : r, is_lane ? here : l);
          const std::int32_t i = node(n, own);
          if (i < 0 || face(n, axis, is_plane ? here + side : p, is_row ? here + side : r, is_lane ? here + side : l) <= 0) continue;
          const std::int32_t j = other < 0 ? -1 : node(std::size_t(other), T::cell(is_plane ? there : p, is_row ? there : r, is_lane ? there : l));
          if (j < 0) sets.open(i);
          else sets.join(i, j);
        }
  }
  void collect(Sets& sets) {
    level_.pieces.clear(), level_.masks.clear(), level_.component_cells.clear();
    std::vector<std::int32_t> component(std::size_t(first_.back()), -1);
    for (std::size_t n = 0; n < level_.tile.size(); ++n)
      for (std::int32_t node = first_[n]; node < first_[n + 1]; ++node) {
        if (sets.is_open(node)) continue;
        std::int32_t& c = component[std::size_t(sets.find(node))];
        if (c < 0) c = std::int32_t(level_.component_cells.size()), level_.component_cells.push_back(0);
        Piece piece{std::int32_t(n), c, -1};
        std::int64_t cells = T::kCells;
        if (parts_[n]) {
          piece.mask = std::int32_t(level_.masks.size());
          auto& mask = level_.masks.emplace_back();
          for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = parts_[n]->label[i] == node - first_[n] + 1;
          cells = std::count(mask.begin(), mask.end(), 1);
        }
        level_.component_cells[std::size_t(c)] += double(cells);
        level_.pieces.push_back(piece);
      }
  }

  Level<D>& level_;
  std::vector<std::unique_ptr<Parts<D>>> parts_;   // null where plain
  std::vector<std::int32_t> first_;                // node of each tile
};

}  // namespace

template <int D>
void find_closed_components(Level<D>& level) {
  Finder<D>(level).run();
}

template <int D, class Real>
double remove_means(const Level<D>& level, std::vector<Real>& field) {
  using T = Tile<D>;
  if (level.pieces.empty()) return 0;
  std::vector<double> part(level.pieces.size()), mean(level.component_cells.size(), 0.0);
  const auto for_pieces = [&](const auto& body) {
    base::parallel_chunks(level.pieces.size(), kTilesAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t m = begin; m < end; ++m) {
        const Piece& piece = level.pieces[m];
        body(m, field.data() + level.begin(piece.tile), piece.mask < 0 ? nullptr : level.masks[std::size_t(piece.mask)].data());
      }
    });
  };
  for_pieces([&](std::size_t m, const Real* value, const std::uint8_t* mask) {
    double sum = 0;
    for (int i = 0; i < T::kCells; ++i)
      if (!mask || mask[i]) sum += double(value[i]);
    part[m] = sum;
  });
  for (std::size_t m = 0; m < part.size(); ++m) mean[std::size_t(level.pieces[m].component)] += part[m];
  double most = 0;
  for (std::size_t c = 0; c < mean.size(); ++c) mean[c] /= level.component_cells[c], most = std::max(most, std::abs(mean[c]));
  for_pieces([&](std::size_t m, Real* value, const std::uint8_t* mask) {
    const Real less = Real(mean[std::size_t(level.pieces[m].component)]);
    for (int i = 0; i < T::kCells; ++i)
      if (!mask || mask[i]) value[i] -= less;
  });
  return most;
}

template void find_closed_components(Level<2>&);
template void find_closed_components(Level<3>&);
template double remove_means(const Level<2>&, std::vector<float>&);
template double remove_means(const Level<3>&, std::vector<float>&);
template double remove_means(const Level<2>&, std::vector<double>&);
template double remove_means(const Level<3>&, std::vector<double>&);

}  // namespace sim
