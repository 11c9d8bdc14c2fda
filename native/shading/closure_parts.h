#pragma once

#include "shading/closures.h"
#include "shading/lobe_microfacet.h"

namespace cistern {

// What the closures share; included by closures.cpp and closure_principled.cpp only.

/// Mean weight below which a closure or a layer is left out; as Cycles.
inline constexpr float kNegligibleWeight = 1e-5f;
/// Below this an index is no index.
inline constexpr float kMinIor = 1e-5f;
/// Of films; its square is a number.
inline constexpr float kMaxFilmIor = 1e6f;

inline Rgb non_negative(Rgb c) { return max(c, Rgb(0.0f)); }
inline Rgb saturate(Rgb c) { return max(Rgb(0.0f), min(c, Rgb(1.0f))); }
inline bool is_negligible(Rgb weight) { return !(average(weight) >= kNegligibleWeight); }

/// The closure's normal, unit; the interpolated one where the node gives none.
inline Vec3 closure_normal(Vec3 n, const SurfacePoint& point) { return n == point.ns ? n : normalize_or(n, point.ns); }

/// Cosine to ng that `specular_normal` demands of the mirror direction, which may be as shallow as the view.
inline float lowest_mirror_cosine(const SurfacePoint& point) {
  constexpr float kMinCosine = 0.01f, kFractionOfView = 0.9f;  // as Cycles
  return std::min(kFractionOfView * dot(point.wo, point.ng), kMinCosine);
}
/// The normal in the plane of `n` and ng that reflects wo by just that cosine.
Vec3 bent_normal(const Vec3& n, const SurfacePoint& point);

/// `n`, or as little bent towards ng as lifts the mirror direction of wo just above the surface. For specular lobes:
/// without it the outlines of coarse smooth meshes, and steep bumps, would reflect nothing. As it is on
/// strands, and where the material wants no corrections.
inline Vec3 specular_normal(Vec3 n, const SurfacePoint& point) {
  if (n == point.ng || !point.corrects_bumps || point.is_strand ||
      dot(point.ng, reflect(point.wo, n)) >= lowest_mirror_cosine(point))
    return n;
  return bent_normal(n, point);
}

/// Anisotropic alphas and tangent; isotropic without a usable tangent. `rotation` in turns around `axis`.
struct Anisotropy {
  float alpha_x, alpha_y;
  Vec3 tangent;
};
Anisotropy make_anisotropy(float alpha_x, float alpha_y, Vec3 tangent, float rotation, Vec3 axis);
/// Of Glossy and Glass: `amount` in (-1, 1) makes facets wider along the tangent (below 0) or across it.
Anisotropy node_anisotropy(float roughness, float amount, Vec3 tangent, float rotation, Vec3 axis);
/// Of Principled and Metallic: `amount` in [0, 1] lowers the aspect ratio to sqrt(1 - 0.9 amount).
/// [Burley 2012, Physically-Based Shading at Disney, §5.4]
Anisotropy disney_anisotropy(float roughness, float amount, Vec3 tangent, float rotation, Vec3 axis);

/// A reflecting lobe around `n`, without Fresnel.
MicrofacetLobe make_microfacet(Vec3 n, float alpha);
void set_anisotropy(MicrofacetLobe& lobe, const Anisotropy& anisotropy);

/// Reflection (if `reflects`) and refraction through a surface around a medium of index `ior`; without Fresnel.
MicrofacetLobe make_refraction(Vec3 n, const Anisotropy& facets, float ior, const SurfacePoint& point, bool reflects);

/// Gives the lobe a film where that is thick enough to be one: to a Schlick lobe of a dielectric or to one of a
/// metal.
void put_film_on(MicrofacetLobe& lobe, const ThinFilm& film);
/// The same for a surface around a medium of index `ior`, which may be seen from inside.
void put_film_around(MicrofacetLobe& lobe, ThinFilm film, float ior, const SurfacePoint& point);

/// Mean reflectance of one bounce for `compensate_energy`: of the tint where light is transmitted, else of the curve.
Rgb mean_schlick_reflectance(const MicrofacetLobe& lobe);

/// Appends the lobe, to be sampled in proportion to its albedo, and returns that albedo, weight included: black where
/// the weight is negligible or all of the lobe is kept back (Bsdf::gloss). With a `mean_reflectance`, light lost
/// between facets is added back.
Rgb add_microfacet(Bsdf& bsdf, MicrofacetLobe& lobe, Rgb weight, const std::optional<Rgb>& mean_reflectance);

/// What a Lambert lobe in place of a diffuse one may weigh, so as to seldom exceed it.
template <class Model>
float even_share(const Model&) {
  return 1.0f;
}
inline float even_share(const OrenNayarLobe& lobe) { return kPi * (lobe.a - 0.5f * lobe.b); }
inline float even_share(const RoughTranslucentLobe& lobe) {
  return even_share(static_cast<const OrenNayarLobe&>(lobe));
}

/// Appends a lobe whose albedo is its weight, unless that is negligible; `even` is what the weight would be whatever
/// the view.
template <class Model>
void add_diffuse(Bsdf& bsdf, const Model& model, Rgb weight, Rgb even) {
  const Rgb w = non_negative(weight);
  if (!is_negligible(w)) add_lobe(bsdf, model, w, average(w), even_share(model) * non_negative(even));
}
template <class Model>
void add_diffuse(Bsdf& bsdf, const Model& model, Rgb weight) {
  add_diffuse(bsdf, model, weight, weight);
}
/// Appends sheen and returns its albedo, weight included.
Rgb add_sheen(Bsdf& bsdf, Vec3 n, float roughness, Rgb weight);

/// Static parameter of closures.
inline SubsurfaceMethod subsurface_method(int32_t parameter) { return static_cast<SubsurfaceMethod>(parameter); }
/// Limits as in Cycles; `alpha`: width of the boundary's GGX lobe. That of skin is as rough as can be.
inline void set_boundary(Subsurface& subsurface, float ior, float alpha, float anisotropy) {
  subsurface.ior = std::clamp(ior, 1.01f, 3.8f);
  subsurface.alpha = subsurface.is_skin() ? 1.0f : clamp01(alpha);
  const float most = subsurface.method == SubsurfaceMethod::RANDOM_WALK ? 0.99f : 0.9f;
  subsurface.anisotropy = std::clamp(anisotropy, -0.99f, most);
}

/// For mean free paths of some ten roundings of coordinates: shorter ones lose light to rounding. As in Cycles at least
/// 1e-8 m.
inline float least_radius(const SurfacePoint& point, SubsurfaceMethod method) {
  constexpr float kClearances = 10.0f;
  const float free_paths = method == SubsurfaceMethod::RANDOM_WALK ? 1.0f : 4.0f * kPi;
  return std::max(1e-8f, free_paths * kClearances * point.clearance);
}

void add_principled(Bsdf& bsdf, std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point);
Rgb principled_emission(std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point);
/// `ray_kind`: PathState::ray_kind of what meets the surface.
Rgb principled_transparency(std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point,
                            uint8_t ray_kind);

}  // namespace cistern
