#pragma once

#include "shading/lobe_diffuse.h"

namespace cistern {

// GGX or Beckmann microfacets with height-correlated Smith masking [Heitz 2014], sampled by visible normals; reflection
// and refraction after [Walter et al. 2007, eqs. 20 and 21] without the (eta)^2 by which radiance grows where it enters
// a denser medium: as in Cycles, so that light loses nothing on the way in and out. Then f(a, b) = eta^2 f(b, a).
// Density: that of the visible normal times the Jacobian of reflection or refraction times the probability of the
// branch, which is its share of the Fresnel terms. Light lost between facets is returned by `energy_scale`.
// Or Ashikhmin and Shirley's reflection (ashikhmin_shirley.h), by half vectors and their density.
// Or a sheet: f(wo, wi) of GGX reflection without Fresnel for wi mirrored at the surface, times the transmission tint.

/// alpha_x * alpha_y at and below which the lobe is a delta lobe.
inline constexpr float kDeltaAlphaProduct = 2e-10f;
inline bool is_delta(const MicrofacetLobe& lobe) { return lobe.alpha_x * lobe.alpha_y <= kDeltaAlphaProduct; }

/// Zero for a delta lobe and below the surface.
LobeEvaluation evaluate_lobe(const MicrofacetLobe& lobe, const Vec3& wo, const Vec3& wi);
/// Not for delta lobes. `u_branch` chooses between reflection and refraction.
std::optional<Vec3> sample_lobe(const MicrofacetLobe& lobe, const Vec3& wo, float u_branch, Vec2 u);

/// What a facet reflects and transmits; a side that the lobe does not have is black.
struct FresnelTerms {
  Rgb reflectance, transmittance;
  float cos_t = 0.0f;  // of the refracted ray, 0 where there is none; only where the lobe transmits

  float reflection_probability() const {
    const float total = average(reflectance + transmittance);
    return total > 0.0f ? average(reflectance) / total : 0.0f;
  }
};
/// `cos_o`: between the facet's normal and the direction. Not of sheets.
FresnelTerms facet_fresnel(const MicrofacetLobe& lobe, float cos_o);

struct DeltaSample {
  Vec3 wi;
  Rgb f;              // value: the weight is f / probability
  float probability;  // of the branch
};
/// For delta lobes.
std::optional<DeltaSample> sample_delta_lobe(const MicrofacetLobe& lobe, Vec3 wo, float u_branch);

/// Estimate of the directional albedo, energy lost between facets taken as returned; lobe weight not included.
/// [tables: albedo_tables.h]
Rgb microfacet_albedo(const MicrofacetLobe& lobe, const Vec3& wo);

/// The same by sides.
struct SidedAlbedo {
  Rgb reflected, transmitted;
};
SidedAlbedo microfacet_albedo_by_side(const MicrofacetLobe& lobe, const Vec3& wo);

/// Sets `energy_scale` so that a lobe without Fresnel reflects everything, and returns by how much the lobe's weight
/// must be multiplied for the light that was absorbed on further bounces, given the mean reflectance of one bounce.
/// [Kulla and Conty 2017, appendix; Turquin 2019, Practical multiple scattering compensation for microfacet models]
Rgb compensate_energy(MicrofacetLobe& lobe, const Vec3& wo, const Rgb& mean_reflectance);

}  // namespace cistern
