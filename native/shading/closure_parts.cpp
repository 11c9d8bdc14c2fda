#include "shading/closure_parts.h"

#include "shading/fresnel.h"
#include "shading/lobe_sheen.h"

namespace cistern {

Vec3 bent_normal(const Vec3& n, const SurfacePoint& point) {
  const float view_z = dot(point.wo, point.ng), lowest = lowest_mirror_cosine(point);
  // In the plane of n (x) and ng (z) look for a unit N with 2 (N.wo) N.z - wo.z = lowest. Squared, that is a quadratic
  // in N.z^2; which root is right depends on the side of wo.
  const Vec3 x = normalize_or(n - dot(n, point.ng) * point.ng, n);
  const float view_x = dot(point.wo, x);
  const float a = sqr(view_x) + sqr(view_z);
  const float half_b = a + view_z * lowest;
  const float root = safe_sqrt(sqr(half_b) - a * sqr(lowest + view_z));
  const float z_squared = clamp01(0.5f * (view_x < 0.0f ? half_b + root : half_b - root) / a);
  return normalize_or(safe_sqrt(1.0f - z_squared) * x + std::sqrt(z_squared) * point.ng, n);
}

Anisotropy make_anisotropy(float alpha_x, float alpha_y, Vec3 tangent, float rotation, Vec3 axis) {
  if (rotation != 0.0f) {  // Rodrigues
    const float angle = 2.0f * kPi * rotation, c = std::cos(angle);
    tangent = tangent * c + cross(axis, tangent) * std::sin(angle) + axis * (dot(axis, tangent) * (1.0f - c));
  }
  return {clamp01(alpha_x), clamp01(alpha_y), tangent};
}

Anisotropy node_anisotropy(float roughness, float amount, Vec3 tangent, float rotation, Vec3 axis) {
  constexpr float kIsotropic = 1e-4f, kMost = 0.99f;
  const float alpha = sqr(clamp01(roughness)), squeeze = 1.0f - std::min(std::abs(amount), kMost);
  if (!(std::abs(amount) > kIsotropic)) return {alpha, alpha, {}};
  const float narrow = alpha * squeeze, wide = alpha / squeeze;
  return amount < 0.0f ? make_anisotropy(wide, narrow, tangent, rotation, axis)
                       : make_anisotropy(narrow, wide, tangent, rotation, axis);
}

Anisotropy disney_anisotropy(float roughness, float amount, Vec3 tangent, float rotation, Vec3 axis) {
  const float alpha = sqr(roughness);
  if (amount <= 0.0f) return {alpha, alpha, {}};
  const float aspect = std::sqrt(1.0f - 0.9f * amount);
  return make_anisotropy(alpha / aspect, alpha * aspect, tangent, rotation, axis);
}

MicrofacetLobe make_microfacet(Vec3 n, float alpha) {
  MicrofacetLobe lobe;
  lobe.n = n;
  lobe.alpha_x = lobe.alpha_y = clamp01(alpha);
  return lobe;
}

void set_anisotropy(MicrofacetLobe& lobe, const Anisotropy& anisotropy) {
  lobe.alpha_x = anisotropy.alpha_x;
  lobe.alpha_y = anisotropy.alpha_y;
  if (lobe.alpha_x == lobe.alpha_y) return;
  const Vec3 bitangent = normalize_or(cross(lobe.n, anisotropy.tangent), {});
  if (bitangent == Vec3{})
    lobe.alpha_x = lobe.alpha_y = std::sqrt(lobe.alpha_x * lobe.alpha_y);
  else
    lobe.tangent = cross(bitangent, lobe.n);
}

/// Then light goes straight on however rough the surface.
bool is_index_matched(const MicrofacetLobe& lobe) {
  constexpr float kMatched = 1e-4f;  // as Cycles
  return lobe.transmits && !lobe.is_sheet && std::abs(lobe.ior - 1.0f) < kMatched;
}

MicrofacetLobe make_refraction(Vec3 n, const Anisotropy& facets, float ior, const SurfacePoint& point, bool reflects) {
  MicrofacetLobe lobe = make_microfacet(n, 0.0f);
  set_anisotropy(lobe, facets);
  const float inside = std::max(ior, kMinIor);
  lobe.ior = point.is_backface ? 1.0f / inside : inside;
  lobe.reflects = reflects;
  lobe.transmits = true;
  if (is_index_matched(lobe)) lobe.alpha_x = lobe.alpha_y = 0.0f;
  return lobe;
}

void put_film_on(MicrofacetLobe& lobe, const ThinFilm& film) {
  if (!has_film(film)) return;
  lobe.film = {film.thickness_nm, std::clamp(film.ior, kMinIor, kMaxFilmIor)};
  if (lobe.fresnel == FresnelModel::CONDUCTOR) return;
  const bool is_metal = lobe.fresnel == FresnelModel::F82_TINT;
  lobe.fresnel = is_metal ? FresnelModel::FILM_ON_METAL : FresnelModel::FILM_ON_DIELECTRIC;
}

void put_film_around(MicrofacetLobe& lobe, ThinFilm film, float ior, const SurfacePoint& point) {
  if (point.is_backface) film.ior /= std::max(ior, kMinIor);
  put_film_on(lobe, film);
}

Rgb mean_schlick_reflectance(const MicrofacetLobe& lobe) {
  if (lobe.transmits && !is_black(lobe.transmission_tint)) return lobe.transmission_tint;
  const float s = fresnel_fraction(fresnel_dielectric_average(lobe.ior), lobe.ior);
  return lobe.reflection_tint * lerp(lobe.f0, lobe.f90_or_b, s);
}

namespace {

bool is_all_kept_back(const MicrofacetLobe& lobe, const GlossLimits& gloss) {
  return !(lobe.reflects && gloss.has_reflection) && !(lobe.transmits && gloss.has_refraction);
}

/// `lobe` has part of its gloss at least.
MicrofacetLobe limited(MicrofacetLobe lobe, const GlossLimits& gloss) {
  if (!gloss.has_reflection) lobe.reflection_tint = Rgb(0.0f);
  if (!gloss.has_refraction) lobe.transmission_tint = Rgb(0.0f);
  if (is_index_matched(lobe)) return lobe;
  lobe.alpha_x = std::max(lobe.alpha_x, gloss.least_alpha);
  lobe.alpha_y = std::max(lobe.alpha_y, gloss.least_alpha);
  return lobe;
}

}  // namespace

Rgb add_microfacet(Bsdf& bsdf, MicrofacetLobe& lobe, Rgb weight, const std::optional<Rgb>& mean_reflectance) {
  Rgb w = non_negative(weight);
  if (is_negligible(w) || is_all_kept_back(lobe, bsdf.gloss)) return Rgb(0.0f);
  const Rgb albedo = lobe.fresnel == FresnelModel::NONE ? Rgb(1.0f) : microfacet_albedo(lobe, bsdf.wo);
  float sample_weight = average(w) * average(albedo);
  if (mean_reflectance) {
    const Rgb absorption = compensate_energy(lobe, bsdf.wo, *mean_reflectance);
    w *= absorption;
    sample_weight *= average(absorption);
  }
  if (bsdf.gloss == GlossLimits{})
    add_lobe(bsdf, lobe, w, sample_weight);
  else
    add_lobe(bsdf, limited(lobe, bsdf.gloss), w, sample_weight);  // with its own weight, as in Cycles
  return w * albedo;
}

Rgb add_sheen(Bsdf& bsdf, Vec3 n, float roughness, Rgb weight) {
  if (is_negligible(non_negative(weight))) return Rgb(0.0f);
  const Sheen sheen = make_sheen(n, bsdf.wo, roughness);
  const Rgb w = non_negative(weight) * sheen.albedo;
  add_lobe(bsdf, sheen.lobe, w, average(w));
  return w;
}

}  // namespace cistern
