#include "sim/fluid/multigrid_interpolation.h"

namespace sim {
namespace {

/// The coarse values that a fine tile interpolates from; 0 where there is no tile.
template <int D>
void load_coarse(const Level<D>& coarse, const std::vector<float>& from, const Cell<D>& tile,
                 const std::array<std::int32_t, kNeighbours<D>>& numbers, float* __restrict buffer) {
  using T = Tile<D>;
  constexpr int E = T::kEdge, H = Level<D>::kHalf;
  const Slots<D> slot = slots<D>(coarse, tile);
  const bool upper = tile[D - 1] % 2;
  for (int p = 0; p < (D == 3 ? H : 1); ++p)
    for (int r = 0; r < H; ++r) {
      const Slot sp = D == 3 ? slot[0][std::size_t(p)] : Slot{-1, 0}, sr = slot[D - 2][std::size_t(r)];
      const std::int32_t* near = &numbers[std::size_t((sp.step + 1) * 9 + (sr.step + 1) * 3)];
      const int row = T::cell(sp.local, sr.local, 0);
      const auto value = [&](Slot s) { return near[s.step + 1] >= 0 ? from[std::size_t(coarse.begin(near[s.step + 1]) + row + s.local)] : 0.0f; };
      float* const to = buffer + (p * H + r) * H;
      if (coarse.wraps_short(D - 1)) {
        for (int l = 0; l < H; ++l) to[l] = value(slot[D - 1][std::size_t(l)]);
        continue;
      }
      const int first = upper ? 0 : 1;   // the parent's own cells: all slots but the one across its side
      if (near[1] >= 0) {
        const float* own = from.data() + coarse.begin(near[1]) + row + (upper ? E / 2 - 1 : 0);
        for (int l = 0; l < H - 1; ++l) to[first + l] = own[l];
      } else {
        for (int l = 0; l < H - 1; ++l) to[first + l] = 0;
      }
      to[upper ? H - 1 : 0] = value(slot[D - 1][std::size_t(upper ? H - 1 : 0)]);
    }
}

/// Adds what a fine tile restricted to the cells of one coarse tile, `child` being where the fine tile is: 0 to 3 along each axis, from the
/// one before the coarse tile to the one behind it.
template <int D>
void add_child(const float* __restrict restricted, const std::array<int, D>& child, float* __restrict b) {
  using T = Tile<D>;
  constexpr int E = T::kEdge, H = Level<D>::kHalf;
  const auto first = [](int at) { return at == 0 ? H - 1 : at == 1 ? 1 : 0; };           // slot
  const auto count = [](int at) { return at == 0 || at == 3 ? 1 : H - 1; };
  const auto local = [](int at) { return at < 2 ? 0 : at == 2 ? E / 2 - 1 : E - 1; };    // cell of the first slot
  const int plane = D == 3 ? child[0] : 0, row = child[D - 2], lane = child[D - 1];
  for (int p = 0; p < (D == 3 ? count(plane) : 1); ++p)
    for (int r = 0; r < count(row); ++r) {
      const float* const from = restricted + ((D == 3 ? first(plane) + p : 0) * H + first(row) + r) * H + first(lane);
      float* const to = b + T::cell(D == 3 ? local(plane) + p : 0, local(row) + r, local(lane));
      for (int l = 0; l < count(lane); ++l) to[l] += from[l];
    }
}

/// The same where a periodic side cuts a tile short: every slot is asked for its cell.
template <int D>
void add_child_across_short_side(const Level<D>& coarse, const Cell<D>& tile, const std::array<std::int32_t, kNeighbours<D>>& numbers,
                                 const float* restricted, std::int32_t number, float* b) {
  using T = Tile<D>;
  constexpr int H = Level<D>::kHalf;
  const Slots<D> slot = slots<D>(coarse, tile);
  for (int p = 0; p < (D == 3 ? H : 1); ++p)
    for (int r = 0; r < H; ++r)
      for (int l = 0; l < H; ++l) {
        const Slot sp = D == 3 ? slot[0][std::size_t(p)] : Slot{-1, 0}, sr = slot[D - 2][std::size_t(r)], sl = slot[D - 1][std::size_t(l)];
        const int near = (sp.step + 1) * 9 + (sr.step + 1) * 3 + sl.step + 1;
        if (numbers[std::size_t(near)] == number) b[T::cell(sp.local, sr.local, sl.local)] += restricted[(p * H + r) * H + l];
      }
}

template <int D, class AlsoDo>
double smooth_tiles(const Level<D>& level, const std::vector<float>& from, float omega, std::vector<float>& to, const AlsoDo& also) {
  return base::ordered_reduce(level.tile.size(), kTilesAtOnce, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    Padded<D, float> x;
    for (std::size_t n = begin; n < end; ++n) {
      x.load(level, from.data(), std::int32_t(n));
      Padded<D, float>::call_for(level, from.data(), n + kTilesAhead);
      const TileCoefficients<D>* k = level.coefficients[n].get();
      const float* b = level.b.data() + level.begin(std::int32_t(n));
      float* out = to.data() + level.begin(std::int32_t(n));
      const float plain = omega * level.plain_inverse_diagonal();
      using L = Lanes<float>;
      if (k)
        visit_lanes<D, float>(x, k, level.face, [&](int at, const L::V& own, const L::V& Ax) {
          L::store(own + omega * L::load(k->inverse_diagonal.data() + at) * (L::load(b + at) - Ax), out + at);
        });
      else
        visit_lanes<D, float>(x, nullptr, level.face, [&](int at, const L::V& own, const L::V& Ax) {
          L::store(own + plain * (L::load(b + at) - Ax), out + at);
        });
      sum += also(n, out);
    }
    return sum;
  }, [](double s, double more) { return s + more; });
}

}  // namespace

template <int D>
void smooth(const Level<D>& level, const std::vector<float>& from, float omega, std::vector<float>& to) {
  smooth_tiles(level, from, omega, to, [](std::size_t, const float*) { return 0.0; });
}

template <int D>
double smooth_and_dot(const Level<D>& level, const std::vector<float>& from, float omega, const std::vector<double>& r, std::vector<float>& to) {
  constexpr int E = Tile<D>::kEdge;
  return smooth_tiles(level, from, omega, to, [&](std::size_t n, const float* out) {
    const double* residual = r.data() + level.begin(std::int32_t(n));
    double lane[E] = {}, sum = 0;
    for (int i = 0; i < Tile<D>::kCells; i += E)
      for (int l = 0; l < E; ++l) lane[l] += residual[i + l] * double(out[i + l]);
    for (const double v : lane) sum += v;
    return sum;
  });
}

template <int D>
void restrict_residual(Level<D>& level, const std::vector<float>& from) {
  using T = Tile<D>;
  base::parallel_chunks(level.tile.size(), kTilesAtOnce, [&](std::size_t begin, std::size_t end) {
    Padded<D, float> x;
    alignas(64) float residual[T::kCells];
    for (std::size_t n = begin; n < end; ++n) {
      x.load(level, from.data(), std::int32_t(n));
      Padded<D, float>::call_for(level, from.data(), n + kTilesAhead);
      const TileCoefficients<D>* k = level.coefficients[n].get();
      const float* b = level.b.data() + level.begin(std::int32_t(n));
      using L = Lanes<float>;
      if (k)
        visit_lanes<D, float>(x, k, level.face, [&](int at, const L::V&, const L::V& Ax) {
          L::store((L::load(b + at) - Ax) * L::load(k->interpolation.data() + at), residual + at);
        });
      else
        visit_lanes<D, float>(x, nullptr, level.face, [&](int at, const L::V&, const L::V& Ax) { L::store(L::load(b + at) - Ax, residual + at); });
      Interpolation<D>::narrow(residual, level.restricted.data() + n * std::size_t(Level<D>::kCoarse));
    }
  });
}

template <int D>
void gather_restricted(const Level<D>& fine, float omega, Level<D>& coarse) {
  using T = Tile<D>;
  bool wraps_short = false;
  for (int a = 0; a < D; ++a) wraps_short = wraps_short || fine.wraps_short(a) || coarse.wraps_short(a);
  base::parallel_chunks(coarse.tile.size(), 1, [&](std::size_t n, std::size_t) {
    float* const b = coarse.b.data() + coarse.begin(std::int32_t(n));
    std::fill(b, b + T::kCells, 0.0f);
    std::array<std::int32_t, kChildren<D>> done;
    int known = 0;
    for (int c = 0; c < kChildren<D>; ++c) {
      const std::int32_t number = coarse.children[n][std::size_t(c)];
      if (number < 0) continue;
      std::array<int, D> child;
      for (int a = 0; a < D; ++a) child[std::size_t(a)] = c >> (2 * (D - 1 - a)) & 3;
      const float* const from = fine.restricted.data() + std::size_t(number) * std::size_t(Level<D>::kCoarse);
      if (!wraps_short) {
        add_child<D>(from, child, b);
      } else if (std::find(done.begin(), done.begin() + known, number) == done.begin() + known) {
        done[std::size_t(known++)] = number;   // around a short axis the same tile may be met twice
        add_child_across_short_side<D>(coarse, fine.tile[std::size_t(number)], fine.parents[std::size_t(number)], from, std::int32_t(n), b);
      }
    }
    float* const x = coarse.x.data() + coarse.begin(std::int32_t(n));
    if (const TileCoefficients<D>* k = coarse.coefficients[n].get()) {
      for (int i = 0; i < T::kCells; ++i) {
        if (k->inverse_diagonal[std::size_t(i)] == 0) b[i] = 0;
        x[i] = omega * k->inverse_diagonal[std::size_t(i)] * b[i];
      }
    } else {
      const float step = omega * coarse.plain_inverse_diagonal();
      for (int i = 0; i < T::kCells; ++i) x[i] = step * b[i];
    }
  });
}

template <int D>
void add_interpolated(const Level<D>& coarse, const std::vector<float>& from, const Level<D>& fine, std::vector<float>& to) {
  using T = Tile<D>;
  base::parallel_chunks(fine.tile.size(), kTilesAtOnce, [&](std::size_t begin, std::size_t end) {
    alignas(64) float buffer[Level<D>::kCoarse], wide[T::kCells];
    for (std::size_t n = begin; n < end; ++n) {
      load_coarse<D>(coarse, from, fine.tile[n], fine.parents[n], buffer);
      Interpolation<D>::widen(buffer, wide);
      float* const out = to.data() + fine.begin(std::int32_t(n));
      if (const TileCoefficients<D>* k = fine.coefficients[n].get())
        for (int i = 0; i < T::kCells; ++i) out[i] += k->interpolation[std::size_t(i)] * wide[i];
      else
        for (int i = 0; i < T::kCells; ++i) out[i] += wide[i];
    }
  });
}

template void smooth(const Level<2>&, const std::vector<float>&, float, std::vector<float>&);
template void smooth(const Level<3>&, const std::vector<float>&, float, std::vector<float>&);
template double smooth_and_dot(const Level<2>&, const std::vector<float>&, float, const std::vector<double>&, std::vector<float>&);
template double smooth_and_dot(const Level<3>&, const std::vector<float>&, float, const std::vector<double>&, std::vector<float>&);
template void restrict_residual(Level<2>&, const std::vector<float>&);
template void restrict_residual(Level<3>&, const std::vector<float>&);
template void gather_restricted(const Level<2>&, float, Level<2>&);
template void gather_restricted(const Level<3>&, float, Level<3>&);
template void add_interpolated(const Level<2>&, const std::vector<float>&, const Level<2>&, std::vector<float>&);
template void add_interpolated(const Level<3>&, const std::vector<float>&, const Level<3>&, std::vector<float>&);

}  // namespace sim
