#include "shading/bsdf_lanes.h"

#include "shading/fresnel.h"
#include "shading/lobe_microfacet.h"

namespace cistern {
namespace {

/// Whether directions are sampled by lobes whose normals nothing bends.
bool is_unbent(const Bsdf& bsdf, const LambertLobe& lobe) {
  return lobe.n == bsdf.ns && bump_reference(bsdf) == bsdf.ns;
}

bool has_form(const MicrofacetLobe& lobe) {
  const bool is_dielectric = lobe.fresnel == FresnelModel::NONE || lobe.fresnel == FresnelModel::DIELECTRIC ||
                             lobe.fresnel == FresnelModel::GENERALIZED_SCHLICK;
  return is_dielectric && lobe.reflects && !lobe.transmits && !lobe.is_sheet && lobe.alpha_x == lobe.alpha_y &&
         lobe.microfacets == Microfacets::GGX;
}

bool has_form(const Bsdf& bsdf) {
  if (turns_away(bsdf)) return false;
  if (bsdf.rough_sampling != RoughSampling::BSDF || bsdf.count == 0 || bsdf.count > 2) return false;
  int lambert = 0, microfacet = 0;
  for (const Lobe& lobe : std::span(bsdf.lobes.data(), static_cast<size_t>(bsdf.count))) {
    if (const auto* diffuse = std::get_if<LambertLobe>(&lobe.model)) {
      lambert += is_unbent(bsdf, *diffuse) ? 1 : 2;
    } else {
      const auto* reflection = std::get_if<MicrofacetLobe>(&lobe.model);
      microfacet += reflection && has_form(*reflection) ? 1 : 2;
    }
  }
  return lambert <= 1 && microfacet <= 1;
}

/// fresnel_dielectric.
Lanes dielectric_reflectance(const Lanes& cos_i, const Lanes& eta) {
  const Lanes square = eta * eta - 1.0f + cos_i * cos_i, g = sqrt(max(square, Lanes(0.0f)));
  const Lanes s = (cos_i - g) / (cos_i + g);
  const Lanes p = (eta * eta * cos_i - g) / (eta * eta * cos_i + g);
  Lanes reflectance = 0.5f * (s * s + p * p);
  where(!(square > 0.0f), reflectance) = 1.0f;
  return reflectance;
}

/// fresnel_fraction.
Lanes dielectric_fraction(const Lanes& reflectance, const Lanes& ior) {
  const Lanes above = ior + 1.0f, below = ior - 1.0f;
  return clamp((reflectance * (above * above) - below * below) / (4.0f * ior), Lanes(0.0f), Lanes(1.0f));
}

}  // namespace

bool BsdfLanes::set(size_t lane, const Bsdf& bsdf) {
  if (!has_form(bsdf)) return false;
  is_set_[lane] = true;
  ng_.set(lane, bsdf.ng);
  ns_.set(lane, bsdf.ns == Vec3{} ? bsdf.ng : bsdf.ns);
  wo_.set(lane, bsdf.wo);
  over_sample_weight_[lane] = 1.0f / bsdf.total_sample_weight;
  float guided = 0.0f;
  for (const Lobe& lobe : std::span(bsdf.lobes.data(), static_cast<size_t>(bsdf.count))) {
    if (!is_narrow(lobe)) guided += lobe.sample_weight;
    if (const auto* model = std::get_if<MicrofacetLobe>(&lobe.model)) {
      if (!is_delta(*model)) set_reflection(lane, bsdf, lobe, *model);
      continue;
    }
    diffuse_.set(lane, lobe.weight);
    even_.set(lane, lobe.even);
    diffuse_sample_weight_[lane] = lobe.sample_weight;
  }
  if (guided > 0.0f) guided_weight_[lane] = guided;
  return true;
}

void BsdfLanes::set_reflection(size_t lane, const Bsdf& bsdf, const Lobe& lobe, const MicrofacetLobe& model) {
  has_reflections_ = true;
  Reflection& r = reflection_;
  const float cos_o = dot(model.n, bsdf.wo), alpha2 = sqr(model.alpha_x);
  if (!(cos_o > 0.0f)) return;
  r.n.set(lane, model.n);
  if (!is_smooth(lobe)) r.weight.set(lane, lobe.weight * (0.5f * model.energy_scale));
  const bool is_mirror = model.fresnel == FresnelModel::NONE;
  const bool is_stretched = model.fresnel == FresnelModel::GENERALIZED_SCHLICK;
  r.f0.set(lane, model.reflection_tint * (is_stretched ? model.f0 : Rgb(is_mirror ? 1.0f : 0.0f)));
  r.f90.set(lane, model.reflection_tint * (is_stretched ? model.f90_or_b : Rgb(1.0f)));
  r.is_real[lane] = model.fresnel == FresnelModel::DIELECTRIC;
  r.ior[lane] = is_mirror ? 1.0f : model.ior;
  r.alpha2[lane] = alpha2;
  r.cos_o[lane] = cos_o;
  r.q_o[lane] = std::sqrt(alpha2 + (1.0f - alpha2) * sqr(cos_o));
  r.sample_weight[lane] = lobe.sample_weight;
  r.is_narrow[lane] = is_narrow(lobe);
}

/// As evaluate_isotropic_reflection.
void BsdfLanes::add_reflection(const Vec3Lanes& wi, Evaluation& evaluation, Lanes& guided_pdf) const {
  const Reflection& r = reflection_;
  const Lanes cos_i = dot(r.n, wi);
  const Vec3Lanes between = wo_ + wi;
  const Vec3Lanes h = between * (1.0f / length(between));
  const Lanes real = dielectric_reflectance(dot(wo_, h), r.ior);
  Lanes fraction = dielectric_fraction(real, r.ior);
  where(r.is_real, fraction) = real;
  const RgbLanes reflectance = r.f0 + (r.f90 - r.f0) * fraction;
  const Lanes cos_h = dot(r.n, h), square_sine = dot(cross(r.n, h), cross(r.n, h));
  const Lanes e = square_sine + r.alpha2 * cos_h * cos_h;
  const Lanes density = kInvPi * r.alpha2 / (e * e);
  const Lanes q_i = sqrt(r.alpha2 + (1.0f - r.alpha2) * cos_i * cos_i);
  const LaneMask is_reflected = cos_i > 0.0f && r.sample_weight > 0.0f && !is_black(reflectance);
  const Lanes pdf = where_or_zero(is_reflected, r.sample_weight * (0.5f * density / (r.cos_o + r.q_o)));
  guided_pdf += where_or_zero(!r.is_narrow, pdf);
  evaluation.pdf += where_or_zero(r.is_narrow, pdf);
  const Lanes f = density * cos_i / (r.q_o * cos_i + q_i * r.cos_o);
  evaluation.rough_cos += where_or_zero(is_reflected, r.weight * reflectance * f);
}

BsdfLanes::Evaluation BsdfLanes::evaluate(const Vec3Lanes& wi, const LaneMask& is_asked,
                                          const DirectionGuideLanes* guides) const {
  Evaluation evaluation;
  const Lanes cosine = dot(ns_, wi);
  const LaneMask can_leave = is_set_ && is_asked && cosine > 0.0f && dot(ng_, wi) > 0.0f;
  const Lanes diffuse_pdf = where_or_zero(can_leave, cosine * kInvPi);
  evaluation.rough_cos = diffuse_ * diffuse_pdf;
  evaluation.even_cos = where_or_zero(can_leave, even_ * diffuse_pdf);
  evaluation.pdf = 0.0f;
  Lanes guided_pdf = diffuse_sample_weight_ * diffuse_pdf;  // of lobes that are not narrow
  if (has_reflections_) add_reflection(wi, evaluation, guided_pdf);
  guided_pdf = where_or_zero(can_leave, guided_pdf);
  if (guides) guided_pdf = guides->pdf(guided_pdf / guided_weight_, wi) * guided_weight_;
  evaluation.pdf = where_or_zero(can_leave, (evaluation.pdf + guided_pdf) * over_sample_weight_);
  evaluation.rough_cos = where_or_zero(can_leave, evaluation.rough_cos);
  return evaluation;
}

}  // namespace cistern
