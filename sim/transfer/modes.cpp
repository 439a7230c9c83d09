#include "sim/transfer/modes.h"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace sim {
namespace {

constexpr ModeIndex<2> kSupplementOrder2[] = {{0, 0}, {1, 0}, {0, 1}, {1, 1}, {2, 0}, {0, 2}, {2, 1}, {1, 2}, {2, 2}};

template <int D>
int total_degree(const ModeIndex<D>& mode) {
  return std::accumulate(mode.begin(), mode.end(), 0);
}

template <int D>
int highest_degree(const ModeIndex<D>& mode) {
  return *std::max_element(mode.begin(), mode.end());
}

template <int D, class Keeps>
std::vector<ModeIndex<D>> filtered(int degree, const Keeps& keeps) {
  std::vector<ModeIndex<D>> modes = ordered_modes<D>(degree);
  std::erase_if(modes, [&](const ModeIndex<D>& mode) { return !keeps(mode); });
  return modes;
}

}  // namespace

template <int D>
std::vector<ModeIndex<D>> ordered_modes(int degree) {
  std::vector<ModeIndex<D>> modes;
  if constexpr (D == 2) modes.assign(std::begin(kSupplementOrder2), std::end(kSupplementOrder2));
  else modes.assign(std::begin(kSupplementOrder3), std::end(kSupplementOrder3));
  std::erase_if(modes, [&](const ModeIndex<D>& mode) { return highest_degree<D>(mode) > degree; });
  return modes;
}

template <int D>
std::vector<ModeIndex<D>> mode_set(Transfer transfer, Kernel kernel, const base::CountOrName& wanted) {
  const int degree = kernel == Kernel::linear ? 1 : 2;
  if (transfer == Transfer::pic || transfer == Transfer::flip) return filtered<D>(degree, [](const auto& m) { return total_degree<D>(m) == 0; });
  if (transfer == Transfer::apic) return filtered<D>(degree, [](const auto& m) { return total_degree<D>(m) <= 1; });
  if (wanted.name == "multilinear") return filtered<D>(degree, [](const auto& m) { return highest_degree<D>(m) <= 1; });
  if (wanted.name == "quadratic") return filtered<D>(degree, [](const auto& m) { return total_degree<D>(m) <= 2; });
  std::vector<ModeIndex<D>> modes = ordered_modes<D>(degree);
  assert(wanted.count >= 0 && wanted.count <= std::int64_t(modes.size()) && "the scene was checked");
  if (wanted.count > 0) modes.resize(std::size_t(wanted.count));
  return modes;
}

int fast_set(const std::vector<ModeIndex<3>>& modes) {
  for (const Transfer transfer : {Transfer::pic, Transfer::apic})
    if (modes == mode_set<3>(transfer, Kernel::quadratic, {})) return int(modes.size());
  for (const char* const name : {"multilinear", "quadratic", ""})
    if (modes == mode_set<3>(Transfer::polypic, Kernel::quadratic, {0, name})) return int(modes.size());
  return 0;
}

template std::vector<ModeIndex<2>> ordered_modes<2>(int);
template std::vector<ModeIndex<3>> ordered_modes<3>(int);
template std::vector<ModeIndex<2>> mode_set<2>(Transfer, Kernel, const base::CountOrName&);
template std::vector<ModeIndex<3>> mode_set<3>(Transfer, Kernel, const base::CountOrName&);

}  // namespace sim
