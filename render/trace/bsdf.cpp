#include "render/trace/bsdf.h"

#include "render/trace/microfacet.h"
#include "render/trace/optics.h"

namespace render::trace {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// Reflectance of a conductor: Schlick's curve, lowered around 82 degrees where `edge` is below 1 [Kutz21 eq 4].
Vec3f conductor(const Vec3f& straight, const Vec3f& edge, float cosine) {
  constexpr float kAt = 1.0f / 7;  // cosine of 82 degrees
  const auto schlick = [&](float c) -> Vec3f { return straight + std::pow(1 - c, 5.0f) * (Vec3f::Ones() - straight); };
  const Vec3f dip = schlick(kAt).cwiseProduct(Vec3f::Ones() - edge) / (kAt * std::pow(1 - kAt, 6.0f));
  return (schlick(cosine) - cosine * std::pow(1 - cosine, 6.0f) * dip).cwiseMax(0.0f).cwiseMin(1.0f);
}

/// Mean of conductor() over uniformly incident light: 2 c dc, in closed form.
Vec3f mean_conductor(const Vec3f& straight, const Vec3f& edge) {
  constexpr float kAt = 1.0f / 7;
  const Vec3f dip =
      (straight + std::pow(1 - kAt, 5.0f) * (Vec3f::Ones() - straight)).cwiseProduct(Vec3f::Ones() - edge) / (kAt * std::pow(1 - kAt, 6.0f));
  return (straight + (Vec3f::Ones() - straight) / 21 - dip / 126).cwiseMax(0.0f).cwiseMin(1.0f);
}

}  // namespace

float coat_share(const Material& material, float cosine) {
  if (material.ior == 1) return 0;
  float cos_t;
  return material.alpha > 0 ? material.albedo.at(cosine) : fresnel(std::clamp(cosine, 0.0f, 1.0f), material.ior, cos_t);
}

Reflector::Reflector(const Material& material, const Vec3f& color, const Vec3f& out)
    : material_(material), color_(color), out_(out), facet_share_(0) {
  if (material.model == Model::conductor) facet_share_ = material.alpha > 0 ? material.albedo.at(out.z()) : 1;
  if (material.model == Model::coated) {
    const float coat = coat_share(material, out.z()), below = (1 - coat) * std::max(color.maxCoeff(), 1e-3f);
    facet_share_ = coat / (coat + below);
  }
}

Vec3f Reflector::reflectance(float cosine) const {
  if (material_.model == Model::conductor) return conductor(color_, material_.edge, cosine);
  float cos_t;
  return Vec3f::Constant(fresnel(std::clamp(cosine, 0.0f, 1.0f), material_.ior, cos_t));
}

Vec3f Reflector::facets(const Vec3f& in) const {
  if (material_.alpha == 0 || facet_share_ == 0) return Vec3f::Zero();
  const Ggx ggx{material_.alpha};
  const Vec3f half = (in + out_).normalized();
  return ggx.facets(half) * ggx.shadowing(out_, in) / (4 * std::max(out_.z(), 1e-6f)) * reflectance(std::min(1.0f, half.dot(out_)));
}

Vec3f Reflector::body(const Vec3f& in) const {
  switch (material_.model) {
    case Model::conductor: {
      if (material_.alpha == 0) return Vec3f::Zero();
      // a series: each further facet reflects the mean [Kulla17]
      const Vec3f f = mean_conductor(color_, material_.edge);
      const float kept = material_.albedo.mean, lost = std::max(1e-7f, 1 - kept);
      const Vec3f tint = f.cwiseProduct(f) * kept;
      const float shape = (1 - material_.albedo.at(out_.z())) * (1 - material_.albedo.at(in.z())) / lost * in.z() / kPi;
      return shape * tint.cwiseQuotient(Vec3f::Ones() - lost * f);
    }
    case Model::coated:
    case Model::translucent: {
      // in through the coat, any number of times back from its inner side, out again
      const float through = (1 - coat_share(material_, in.z())) / (1 - material_.albedo.mean);
      if (material_.model == Model::translucent) return through * in.z() / kPi * color_;
      const Vec3f below = (1 - material_.inside) * color_.cwiseQuotient(Vec3f::Ones() - material_.inside * color_);
      return (1 - coat_share(material_, out_.z())) * through * in.z() / kPi * below;
    }
    default: return in.z() / kPi * color_;
  }
}

Vec3f Reflector::value(const Vec3f& in) const { return in.z() > 0 && out_.z() > 0 ? Vec3f(facets(in) + body(in)) : Vec3f(Vec3f::Zero()); }

float Reflector::density(const Vec3f& in) const {
  if (in.z() <= 0 || out_.z() <= 0) return 0;
  const float below = (1 - facet_share_) * in.z() / kPi;
  if (material_.alpha == 0 || facet_share_ == 0) return below;
  const Vec3f half = (in + out_).normalized();
  return below + facet_share_ * Ggx{material_.alpha}.visible_density(out_, half) / (4 * std::max(out_.dot(half), 1e-6f));
}

Scattered Reflector::sample(sampling::Point u, float choice) const {
  if (out_.z() <= 0) return {};
  Scattered s;
  if (choice >= facet_share_) {
    s.direction = cosine_direction(u);
  } else if (material_.alpha == 0) {
    return {.direction = Vec3f(-out_.x(), -out_.y(), out_.z()), .weight = reflectance(out_.z()) / facet_share_};
  } else {
    const Vec3f facet = Ggx{material_.alpha}.visible_normal(out_, u);
    s.direction = 2 * out_.dot(facet) * facet - out_;
  }
  s.density = density(s.direction);
  if (s.density > 0) s.weight = value(s.direction) / s.density;
  return s;
}

RoughBoundary make_rough_boundary(float alpha, float eta) {
  return {.alpha = alpha, .eta = eta, .first = boundary_albedo(alpha, eta), .second = boundary_albedo(alpha, 1 / eta)};
}

// Of what meets several facets, from here a share `reflected_` comes back. What is transmitted must obey reciprocity, so both
// directions exchange the same amount: half of what the side that loses less (by n^2) has to give.
RoughDielectric::RoughDielectric(const RoughBoundary& boundary, bool back, const Vec3f& out)
    : here_(back ? boundary.second : boundary.first), there_(back ? boundary.first : boundary.second), alpha_(boundary.alpha),
      eta_(back ? 1 / boundary.eta : boundary.eta), out_(out), lost_(std::max(0.0f, 1 - here_.at(out.z()))) {
  const float mine = std::max(1e-7f, 1 - here_.mean), other = std::max(1e-7f, 1 - there_.mean) * eta_ * eta_;
  reflected_ = 1 - 0.5f * std::min(1.0f, other / mine);
}

float RoughDielectric::share(const Vec3f& in) const {
  if (out_.z() <= 0 || in.z() == 0) return 0;
  const Ggx ggx{alpha_};
  float cos_t;
  if (in.z() > 0) {
    const Vec3f half = (in + out_).normalized();
    const float single =
        fresnel(std::min(1.0f, half.dot(out_)), eta_, cos_t) * ggx.facets(half) * ggx.shadowing(out_, in) / (4 * std::max(out_.z(), 1e-6f));
    return single + reflected_ * lost_ * std::max(0.0f, 1 - here_.at(in.z())) / std::max(1e-7f, 1 - here_.mean) * in.z() / kPi;
  }
  const float several =
      (1 - reflected_) * lost_ * std::max(0.0f, 1 - there_.at(-in.z())) / std::max(1e-7f, 1 - there_.mean) * -in.z() / kPi / (eta_ * eta_);
  Vec3f half = (eta_ * in + out_).normalized();
  if (half.z() < 0) half = -half;
  const float a = out_.dot(half), b = in.dot(half);
  if (a <= 0 || b >= 0) return several;
  const float spread = b + a / eta_;
  return several + (1 - fresnel(std::min(1.0f, a), eta_, cos_t)) * ggx.facets(half) * ggx.shadowing(out_, in) * std::abs(a * b) /
                       (spread * spread * std::max(out_.z(), 1e-6f)) / (eta_ * eta_);
}

float RoughDielectric::density(const Vec3f& in) const {
  if (out_.z() <= 0 || in.z() == 0) return 0;
  const Ggx ggx{alpha_};
  float cos_t;
  if (in.z() > 0) {
    const Vec3f half = (in + out_).normalized();
    const float a = std::clamp(half.dot(out_), 1e-6f, 1.0f);
    return (1 - lost_) * fresnel(a, eta_, cos_t) * ggx.visible_density(out_, half) / (4 * a) + lost_ * reflected_ * in.z() / kPi;
  }
  const float several = lost_ * (1 - reflected_) * -in.z() / kPi;
  Vec3f half = (eta_ * in + out_).normalized();
  if (half.z() < 0) half = -half;
  const float a = out_.dot(half), b = in.dot(half);
  if (a <= 0 || b >= 0) return several;
  const float spread = b + a / eta_;
  return several + (1 - lost_) * (1 - fresnel(std::min(1.0f, a), eta_, cos_t)) * ggx.visible_density(out_, half) * std::abs(b) / (spread * spread);
}

Scattered RoughDielectric::sample(sampling::Point u, float choice) const {
  if (out_.z() <= 0) return {};
  Scattered s;
  if (choice < lost_) {
    s.direction = cosine_direction(u);
    if (choice >= lost_ * reflected_) s.direction.z() = -s.direction.z();
  } else {
    choice = (choice - lost_) / (1 - lost_);
    const Vec3f facet = Ggx{alpha_}.visible_normal(out_, u);
    const float cos_i = std::clamp(out_.dot(facet), 0.0f, 1.0f);
    float cos_t;
    const bool mirrored = choice < fresnel(cos_i, eta_, cos_t);
    s.direction = mirrored ? Vec3f(2 * cos_i * facet - out_) : refract(-out_, facet, cos_i, cos_t, eta_).normalized();
    if ((s.direction.z() > 0) != mirrored) return {};  // into the surface, or out of it: it meets another facet
  }
  s.density = density(s.direction);
  if (s.density > 0) s.weight = value(s.direction) / s.density;
  return s;
}

}  // namespace render::trace
