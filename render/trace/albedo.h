#pragma once
// Directional albedos: the share of light that a rough boundary returns when each ray meets one facet only [Heitz14]. What they lack to
// 1 is light that meets several facets; it is given back as a lobe that depends on the two directions apart [Kulla17], which keeps
// reflection reciprocal and a white surface white.
#include <algorithm>
#include <array>
#include <cmath>

namespace render::trace {

/// A share as a function of the cosine to the normal: linear between nodes at equal steps of its root, so that grazing light is resolved.
struct Albedo {
  static constexpr int kCells = 48;
  std::array<float, kCells + 1> share{};
  float mean = 0;  // of uniformly incident light: the integral of 2 c share(c) over c from 0 to 1
  float at(float cosine) const {
    const float place = std::sqrt(std::clamp(cosine, 0.0f, 1.0f)) * kCells;
    const int cell = std::min(static_cast<int>(place), kCells - 1);
    const auto i = static_cast<std::size_t>(cell);
    return share[i] + (place - static_cast<float>(cell)) * (share[i + 1] - share[i]);
  }
};

/// Facets that reflect everything.
Albedo mirror_albedo(float alpha);
/// What a dielectric boundary reflects of light that comes from outside; eta = n_inside / n_outside. Smooth at alpha = 0.
Albedo coat_albedo(float alpha, float eta);
/// What a rough dielectric boundary reflects and transmits; eta = n_t / n_i.
Albedo boundary_albedo(float alpha, float eta);

/// Single-scattering albedo of isotropic scatterers that gives a half space of them the albedo `color` under uniformly incident light,
/// from Chandrasekhar's H function [Chandrasekhar60 ch. V]. 0 ... 1 to 0 ... 1.
double scattering_albedo(double color);
/// The reverse.
double half_space_albedo(double scattering);

}  // namespace render::trace
