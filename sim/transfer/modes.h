#pragma once
// Which products of one-dimensional modes a particle carries. A mode is a multi-index (a, b, c), one index an axis: 0 is the
// constant, 1 is w, 2 is g. PIC, APIC and PolyPIC are the same transfer with different sets.
#include <array>
#include <string_view>
#include <vector>

#include "sim/scene.h"

namespace sim {

inline constexpr std::array<std::string_view, 3> kModeSetNames{"multilinear", "quadratic", "full"};

template <int D>
using ModeIndex = std::array<int, D>;

/// The order of the supplement in 3-D, put right.
inline constexpr ModeIndex<3> kSupplementOrder3[] = {
    {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}, {2, 0, 0},
    {0, 2, 0}, {0, 0, 2}, {2, 2, 0}, {2, 0, 2}, {0, 2, 2}, {2, 2, 2}, {2, 1, 0}, {2, 0, 1}, {2, 1, 1},
    {1, 2, 0}, {0, 2, 1}, {1, 2, 1}, {1, 0, 2}, {0, 1, 2}, {1, 1, 2}, {2, 2, 1}, {2, 1, 2}, {1, 2, 2}};

/// All modes in the order of the PolyPIC supplement, with its swapped pairs put right: 3-D modes 6 and 7 are xz and yz, modes 13
/// and 14 are g1 g3 and g2 g3. Every prefix of it is a mode set. `degree` is 1 (linear kernel) or 2 (quadratic kernel).
template <int D>
std::vector<ModeIndex<D>> ordered_modes(int degree);

/// The modes a scheme keeps, in that order. PIC and FLIP keep the constant, APIC total degree <= 1, PolyPIC what is asked.
template <int D>
std::vector<ModeIndex<D>> mode_set(Transfer, Kernel, const base::CountOrName& wanted);

/// How many modes a set has for which there are fast transfers (lanes.h): those of PIC, APIC, PolyPIC's multilinear, quadratic and full ones; else 0.
int fast_set(const std::vector<ModeIndex<3>>&);

}  // namespace sim
