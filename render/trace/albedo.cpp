#include "render/trace/albedo.h"

#include "render/trace/microfacet.h"
#include "render/trace/optics.h"

namespace render::trace {
namespace {

constexpr int kSide = 32;  // points of a table's integrals, squared

/// The table of share(out), where `share` is a mean over facets seen from `out`.
template <class Facet>
Albedo tabulate(float alpha, const Facet& facet) {
  const Ggx ggx{alpha};
  Albedo table;
  for (int i = 0; i <= Albedo::kCells; ++i) {
    const float root = std::max(0.02f, static_cast<float>(i)) / Albedo::kCells, cosine = root * root;
    const Vec3f out(std::sqrt(1 - cosine * cosine), 0, cosine);
    double sum = 0;
    for (int a = 0; a < kSide; ++a)
      for (int b = 0; b < kSide; ++b)
        sum += static_cast<double>(
            facet(ggx, out, ggx.visible_normal(out, {(static_cast<float>(a) + 0.5f) / kSide, (static_cast<float>(b) + 0.5f) / kSide})));
    table.share[static_cast<std::size_t>(i)] = static_cast<float>(sum / (kSide * kSide));
  }
  return table;
}

/// The mean of the table as it is interpolated: in s = sqrt(c), 4 s^3 ds.
Albedo with_mean(Albedo table) {
  constexpr int kSteps = 4096;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double s = (i + 0.5) / kSteps;
    sum += 4 * s * s * s / kSteps * static_cast<double>(table.at(static_cast<float>(s * s)));
  }
  table.mean = static_cast<float>(sum);
  return table;
}

float reflected(const Ggx& ggx, const Vec3f& out, const Vec3f& facet) {
  const Vec3f in = 2 * out.dot(facet) * facet - out;
  return in.z() > 0 ? ggx.shadowing(out, in) / ggx.masking(out) : 0;
}

/// H(mu) of isotropic scatterers at the nodes of a rule on [0, 1], and the mean it gives to reflection.
double uniform_reflection(double scattering) {
  constexpr int kNodes = 48;
  const double escape = std::sqrt(1 - scattering);
  std::array<double, kNodes> mu{}, weight{}, h{};
  for (std::size_t i = 0; i < kNodes; ++i) {  // midpoints in s, mu = s^2 (3 - 2 s): smooth ends
    const double s = (static_cast<double>(i) + 0.5) / kNodes;
    mu[i] = s * s * (3 - 2 * s);
    weight[i] = 6 * s * (1 - s) / kNodes;
    h[i] = 1;
  }
  for (int pass = 0; pass < 400; ++pass) {
    double change = 0;
    for (std::size_t i = 0; i < kNodes; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < kNodes; ++j) sum += weight[j] * mu[j] * h[j] / (mu[i] + mu[j]);
      const double next = 1 / (escape + 0.5 * scattering * sum);
      change = std::max(change, std::abs(next - h[i]) / next);
      h[i] = next;
    }
    if (change < 1e-10) break;
  }
  double moment = 0;
  for (std::size_t i = 0; i < kNodes; ++i) moment += weight[i] * mu[i] * h[i];
  return 1 - 2 * escape * moment;
}

}  // namespace

Albedo mirror_albedo(float alpha) { return with_mean(tabulate(alpha, reflected)); }

Albedo coat_albedo(float alpha, float eta) {
  if (alpha > 0)
    return with_mean(tabulate(alpha, [eta](const Ggx& ggx, const Vec3f& out, const Vec3f& facet) {
      float cos_t;
      return fresnel(std::min(1.0f, out.dot(facet)), eta, cos_t) * reflected(ggx, out, facet);
    }));
  Albedo table;
  for (int i = 0; i <= Albedo::kCells; ++i) {
    const float root = static_cast<float>(i) / Albedo::kCells;
    float cos_t;
    table.share[static_cast<std::size_t>(i)] = eta == 1 ? 0 : fresnel(root * root, eta, cos_t);
  }
  return with_mean(table);
}

Albedo boundary_albedo(float alpha, float eta) {
  return with_mean(tabulate(alpha, [eta](const Ggx& ggx, const Vec3f& out, const Vec3f& facet) {
    const float cos_i = std::min(1.0f, out.dot(facet));
    float cos_t;
    const float f = fresnel(cos_i, eta, cos_t);
    float share = f * reflected(ggx, out, facet);
    if (f < 1) {
      const Vec3f in = refract(-out, facet, cos_i, cos_t, eta);
      if (in.z() < 0) share += (1 - f) * ggx.shadowing(out, in) / ggx.masking(out);
    }
    return share;
  }));
}

double half_space_albedo(double scattering) { return scattering >= 1 ? 1 : uniform_reflection(scattering); }

double scattering_albedo(double color) {
  if (color <= 0 || color >= 1) return color <= 0 ? 0 : 1;
  double low = 0, high = 1;
  for (int k = 0; k < 30; ++k) {
    const double middle = 0.5 * (low + high);
    (half_space_albedo(middle) < color ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace render::trace
