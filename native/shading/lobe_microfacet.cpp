#include "shading/lobe_microfacet.h"

#include "shading/albedo_tables.h"
#include "shading/ashikhmin_shirley.h"
#include "shading/beckmann.h"
#include "shading/fresnel.h"
#include "shading/ggx.h"

namespace cistern {
namespace {

GgxAlpha alpha_of(const MicrofacetLobe& lobe) { return {lobe.alpha_x, lobe.alpha_y}; }

Frame frame_of(const MicrofacetLobe& lobe) {
  if (lobe.alpha_x == lobe.alpha_y) return Frame(lobe.n);
  return {lobe.tangent, cross(lobe.n, lobe.tangent), lobe.n};
}

/// Reflectance at `cos_o`, before the tints. Sets `cos_t` where the dielectric curve is used or the lobe transmits.
Rgb facet_reflectance(const MicrofacetLobe& lobe, float cos_o, float* cos_t) {
  switch (lobe.fresnel) {
    case FresnelModel::NONE:
      return Rgb(lobe.reflects || fresnel_dielectric(cos_o, lobe.ior, cos_t) == 1.0f ? 1.0f : 0.0f);
    case FresnelModel::DIELECTRIC:
      return Rgb(fresnel_dielectric(cos_o, lobe.ior, cos_t));
    case FresnelModel::GENERALIZED_SCHLICK: {
      const float real = fresnel_dielectric(cos_o, lobe.ior, cos_t);
      return lerp(lobe.f0, lobe.f90_or_b, fresnel_fraction(real, lobe.ior));
    }
    case FresnelModel::F82_TINT:
      return fresnel_f82(cos_o, lobe.f0, lobe.f90_or_b);
    case FresnelModel::FILM_ON_DIELECTRIC:
      return fresnel_film_on_dielectric(lobe.film, cos_o, lobe.ior, lobe.f0, cos_t);
    case FresnelModel::FILM_ON_METAL:
      return fresnel_film_on_metal(lobe.film, cos_o, lobe.f0, lobe.f90_or_b);
    case FresnelModel::CONDUCTOR:
      return has_film(lobe.film) ? fresnel_film_on_conductor(lobe.film, cos_o, lobe.f0, lobe.f90_or_b)
                                 : fresnel_conductor(cos_o, lobe.f0, lobe.f90_or_b);
  }
  return Rgb(0.0f);
}

}  // namespace

FresnelTerms facet_fresnel(const MicrofacetLobe& lobe, float cos_o) {
  FresnelTerms terms;
  const Rgb reflectance = facet_reflectance(lobe, cos_o, &terms.cos_t);
  if (lobe.reflects) terms.reflectance = reflectance * lobe.reflection_tint;
  if (lobe.transmits) terms.transmittance = (Rgb(1.0f) - reflectance) * lobe.transmission_tint;
  return terms;
}

namespace {

/// The branch that `u` chooses and its direction, in the coordinates of `wo` and `h`; empty without energy. The caller
/// checks that it ends on its side of the surface.
struct Branch {
  Vec3 wi;
  Rgb f;
  float probability;
  bool is_transmission;
};
std::optional<Branch> choose_branch(const MicrofacetLobe& lobe, Vec3 wo, Vec3 h, float u) {
  const float cos_o = dot(wo, h);
  if (cos_o <= 0.0f) return {};
  const FresnelTerms terms = facet_fresnel(lobe, cos_o);
  const float p_reflect = terms.reflection_probability();
  if (u < p_reflect) return Branch{2.0f * cos_o * h - wo, terms.reflectance, p_reflect, false};
  if (is_black(terms.transmittance)) return {};
  const float inverse_ior = 1.0f / lobe.ior;
  return Branch{(cos_o * inverse_ior - terms.cos_t) * h - inverse_ior * wo, terms.transmittance, 1.0f - p_reflect,
                true};
}

float table_roughness(const MicrofacetLobe& lobe) {
  if (lobe.alpha_x == lobe.alpha_y) return std::sqrt(lobe.alpha_x);
  return std::sqrt(std::sqrt(lobe.alpha_x * lobe.alpha_y));
}

/// Isotropic lobes that only reflect, which nearly all are, need neither a tangent frame nor a branch: with
/// q(w) = cos_w (1 + 2 Lambda(w)) = sqrt(alpha^2 + (1 - alpha^2) cos_w^2), f cos_i = F D cos_i / (2 (q_o cos_i + q_i
/// cos_o)) and the density is D / (2 (cos_o + q_o)).
LobeEvaluation evaluate_isotropic_reflection(const MicrofacetLobe& lobe, const Vec3& wo, const Vec3& wi, float cos_i) {
  const float cos_o = dot(lobe.n, wo);
  if (cos_o <= 0.0f) return {};
  const Vec3 h = normalize(wo + wi);  // both are on the side of n
  const Rgb reflectance = lobe.is_sheet ? lobe.transmission_tint : facet_fresnel(lobe, dot(wo, h)).reflectance;
  if (is_black(reflectance)) return {};
  const float alpha2 = sqr(lobe.alpha_x);
  const float e = length_squared(cross(lobe.n, h)) + alpha2 * sqr(dot(lobe.n, h));
  const float density = kInvPi * alpha2 / sqr(e);
  const float q_o = std::sqrt(alpha2 + (1.0f - alpha2) * sqr(cos_o));
  const float q_i = std::sqrt(alpha2 + (1.0f - alpha2) * sqr(cos_i));
  return {reflectance * (0.5f * lobe.energy_scale * density * cos_i / (q_o * cos_i + q_i * cos_o)),
          0.5f * density / (cos_o + q_o)};
}

/// With k1 and k2 the directions: f = D(h) F / (4 h.k max(n.k1, n.k2)), density D(h) / (4 h.k). [Ashikhmin and Shirley
/// 2000, eqs. 4 and 8]
LobeEvaluation evaluate_ashikhmin_shirley(const MicrofacetLobe& lobe, const Vec3& wo, const Vec3& wi) {
  const Frame frame = frame_of(lobe);
  const Vec3 o = frame.to_local(wo), i = frame.to_local(wi);
  if (o.z <= 0.0f || i.z <= 0.0f) return {};
  const Vec3 h = normalize(o + i);
  const float cos_d = dot(o, h), density = ashikhmin_shirley_density(alpha_of(lobe), h) / (4.0f * cos_d);
  return {facet_fresnel(lobe, cos_d).reflectance * (lobe.energy_scale * density * i.z / std::max(o.z, i.z)), density};
}

/// Of a facet that reflects or refracts light towards `o`, or a half vector.
Vec3 sample_normal(const MicrofacetLobe& lobe, const Vec3& o, Vec2 u) {
  const GgxAlpha alpha = alpha_of(lobe);
  switch (lobe.microfacets) {
    case Microfacets::BECKMANN:
      return sample_beckmann_visible_normal(alpha, o, u);
    case Microfacets::ASHIKHMIN_SHIRLEY:
      return sample_ashikhmin_shirley(alpha, u);
    case Microfacets::GGX:
      break;
  }
  return sample_ggx_visible_normal(alpha, o, u);
}

/// Mean of the reflectance over the visible normals, before tints: from the tables, or of the macrosurface where there
/// are none.
Rgb mean_over_normals(const MicrofacetLobe& lobe, float mu) {
  switch (lobe.fresnel) {
    case FresnelModel::GENERALIZED_SCHLICK:
      return lerp(lobe.f0, lobe.f90_or_b, ggx_dielectric_fresnel_fraction(table_roughness(lobe), mu, lobe.ior));
    case FresnelModel::F82_TINT:
      return lerp(lobe.f0, Rgb(1.0f), ggx_schlick_fresnel_fraction(table_roughness(lobe), mu));
    case FresnelModel::DIELECTRIC:
      if (lobe.ior > 1.0f) {
        const float s = ggx_dielectric_fresnel_fraction(table_roughness(lobe), mu, lobe.ior);
        return Rgb(lerp(f0_from_ior(lobe.ior), 1.0f, s));
      }
      break;
    case FresnelModel::NONE:
    case FresnelModel::FILM_ON_DIELECTRIC:
    case FresnelModel::FILM_ON_METAL:
    case FresnelModel::CONDUCTOR:
      break;
  }
  float cos_t;
  return facet_reflectance(lobe, mu, &cos_t);
}

}  // namespace

LobeEvaluation evaluate_lobe(const MicrofacetLobe& lobe, const Vec3& wo, const Vec3& wi) {
  const float cos_wi = dot(lobe.n, wi);
  const bool is_transmission = cos_wi < 0.0f;
  if (cos_wi == 0.0f || !(is_transmission ? lobe.transmits : lobe.reflects) || is_delta(lobe)) return {};
  if (lobe.is_sheet) return evaluate_isotropic_reflection(lobe, wo, mirrored(wi, lobe.n), -cos_wi);
  if (lobe.microfacets == Microfacets::ASHIKHMIN_SHIRLEY) return evaluate_ashikhmin_shirley(lobe, wo, wi);
  const bool is_beckmann = lobe.microfacets == Microfacets::BECKMANN;
  if (!lobe.transmits && !is_beckmann && lobe.alpha_x == lobe.alpha_y)
    return evaluate_isotropic_reflection(lobe, wo, wi, cos_wi);
  const Frame frame = frame_of(lobe);
  const Vec3 o = frame.to_local(wo), i = frame.to_local(wi);
  if (o.z <= 0.0f) return {};

  Vec3 h = is_transmission ? lobe.ior * i + o : i + o;
  const float norm_squared = length_squared(h);
  if (norm_squared <= 0.0f) return {};
  h = h * (std::copysign(1.0f, h.z) / std::sqrt(norm_squared));
  const float cos_o = dot(o, h), cos_i = dot(i, h);
  if (cos_o <= 0.0f || (cos_i < 0.0f) != is_transmission) return {};

  const GgxAlpha alpha = alpha_of(lobe);
  const auto lambda = [&](Vec3 w) { return is_beckmann ? beckmann_lambda(alpha, w) : ggx_lambda(alpha, w); };
  const float lambda_o = lambda(o), lambda_i = lambda(i);
  // Jacobian dh / dwi times cos_o.
  const float jacobian = is_transmission ? sqr(lobe.ior) * std::abs(cos_i) * cos_o / norm_squared : 0.25f;
  const float normals = is_beckmann ? beckmann_normal_density(alpha, h) : ggx_normal_density(alpha, h);
  const float common = normals * jacobian / o.z;
  const FresnelTerms terms = facet_fresnel(lobe, cos_o);
  const float p_reflect = terms.reflection_probability();
  const Rgb f = is_transmission ? terms.transmittance : terms.reflectance;
  return {f * (lobe.energy_scale * common / (1.0f + lambda_o + lambda_i)),
          (is_transmission ? 1.0f - p_reflect : p_reflect) * common / (1.0f + lambda_o)};
}

std::optional<Vec3> sample_lobe(const MicrofacetLobe& lobe, const Vec3& wo, float u_branch, Vec2 u) {
  const Frame frame = frame_of(lobe);
  const Vec3 o = frame.to_local(wo);
  if (o.z <= 0.0f) return {};
  const Vec3 h = sample_normal(lobe, o, u);
  if (!lobe.transmits || lobe.is_sheet) {
    const Vec3 i = reflect(o, h);
    if (i.z <= 0.0f) return {};
    return frame.to_world(lobe.is_sheet ? Vec3{i.x, i.y, -i.z} : i);
  }
  const std::optional<Branch> branch = choose_branch(lobe, o, h, u_branch);
  if (!branch || branch->wi.z == 0.0f || (branch->wi.z < 0.0f) != branch->is_transmission) return {};
  return frame.to_world(branch->wi);
}

std::optional<DeltaSample> sample_delta_lobe(const MicrofacetLobe& lobe, Vec3 wo, float u_branch) {
  const std::optional<Branch> branch = choose_branch(lobe, wo, lobe.n, u_branch);
  if (!branch || (dot(lobe.n, branch->wi) < 0.0f) != branch->is_transmission) return {};
  return DeltaSample{normalize(branch->wi), branch->f * lobe.energy_scale, branch->probability};
}

SidedAlbedo microfacet_albedo_by_side(const MicrofacetLobe& lobe, const Vec3& wo) {
  const float mu = clamp01(dot(lobe.n, wo));
  if (lobe.is_sheet) return {{}, lobe.transmission_tint};
  const Rgb reflectance = mean_over_normals(lobe, mu);
  SidedAlbedo albedo;
  if (lobe.reflects) albedo.reflected = reflectance * lobe.reflection_tint;
  if (lobe.transmits) albedo.transmitted = (Rgb(1.0f) - reflectance) * lobe.transmission_tint;
  return albedo;
}

Rgb microfacet_albedo(const MicrofacetLobe& lobe, const Vec3& wo) {
  const SidedAlbedo albedo = microfacet_albedo_by_side(lobe, wo);
  return albedo.transmitted + albedo.reflected;
}

Rgb compensate_energy(MicrofacetLobe& lobe, const Vec3& wo, const Rgb& mean_reflectance) {
  const float mu = dot(lobe.n, wo);
  const float roughness = table_roughness(lobe);
  const bool is_glass = lobe.reflects && lobe.transmits;
  const float albedo = is_glass ? ggx_glass_albedo(roughness, mu, lobe.ior) : ggx_albedo(roughness, mu);
  lobe.energy_scale = 1.0f / albedo;
  const Rgb mean = min(mean_reflectance, Rgb(1.0f));
  if (mean == Rgb(1.0f)) return Rgb(1.0f);
  const float average_albedo = is_glass ? ggx_glass_average_albedo(roughness, lobe.ior) : ggx_average_albedo(roughness);
  const Rgb further_bounces = mean * average_albedo / (Rgb(1.0f) - mean * (1.0f - average_albedo));
  const float missing = (1.0f - albedo) / albedo;
  return (Rgb(1.0f) + further_bounces * missing) * albedo;
}

}  // namespace cistern
