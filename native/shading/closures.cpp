#include "shading/closures.h"

#include "shading/closure_parts.h"
#include "shading/fresnel.h"
#include "shading/lobe_hair.h"
#include "shading/lobe_microfacet_hair.h"
#include "shading/lobe_simple_hair.h"
#include "shading/lobe_toon.h"
#include "shading/lobe_velvet.h"

namespace cistern {
namespace {

enum class Distribution { GGX, MULTI_GGX, BECKMANN, ASHIKHMIN_SHIRLEY };

Distribution distribution(const int32_t* parameters) { return static_cast<Distribution>(parameters[0]); }
bool compensates(const int32_t* parameters) { return distribution(parameters) == Distribution::MULTI_GGX; }
/// Ashikhmin and Shirley's only reflect.
Microfacets microfacets(const int32_t* parameters, bool may_transmit) {
  const Distribution wanted = distribution(parameters);
  if (wanted == Distribution::BECKMANN) return Microfacets::BECKMANN;
  return wanted == Distribution::ASHIKHMIN_SHIRLEY && !may_transmit ? Microfacets::ASHIKHMIN_SHIRLEY : Microfacets::GGX;
}

void add_diffuse_closure(Bsdf& bsdf, std::span<const Vec3> in, const int32_t* parameters, const SurfacePoint& point) {
  constexpr float kSmooth = 1e-5f;
  const Vec3 n = closure_normal(in[3], point);
  const Rgb weight = in[0].x * to_rgb(in[1]);
  const float roughness = in[2].x;
  if (roughness < kSmooth)
    add_diffuse(bsdf, LambertLobe{n}, weight);
  else
    add_diffuse(bsdf, make_oren_nayar(n, bsdf.wo, roughness, to_rgb(in[1]), parameters[0] != 0), weight);
}

void add_glossy(Bsdf& bsdf, std::span<const Vec3> in, const int32_t* parameters, const SurfacePoint& point) {
  const Rgb color = non_negative(to_rgb(in[1]));
  MicrofacetLobe lobe = make_microfacet(specular_normal(closure_normal(in[5], point), point), 0.0f);
  set_anisotropy(lobe, node_anisotropy(in[2].x, in[3].x, in[6], in[4].x, lobe.n));
  lobe.microfacets = microfacets(parameters, false);
  std::optional<Rgb> mean;
  if (compensates(parameters)) mean = color;
  add_microfacet(bsdf, lobe, in[0].x * color, mean);
}

void add_glass(Bsdf& bsdf, std::span<const Vec3> in, const int32_t* parameters, const SurfacePoint& point) {
  const Rgb color = non_negative(to_rgb(in[1]));
  const Vec3 n = specular_normal(closure_normal(in[4], point), point);
  const Anisotropy facets = node_anisotropy(in[2].x, in[7].x, in[9], in[8].x, n);
  MicrofacetLobe lobe = make_refraction(n, facets, in[3].x, point, true);
  lobe.microfacets = microfacets(parameters, true);
  lobe.fresnel = FresnelModel::GENERALIZED_SCHLICK;
  lobe.f0 = Rgb(f0_from_ior(lobe.ior));
  lobe.f90_or_b = Rgb(1.0f);
  lobe.reflection_tint = lobe.transmission_tint = color;
  put_film_around(lobe, {in[5].x, in[6].x}, in[3].x, point);
  std::optional<Rgb> mean;
  if (compensates(parameters)) mean = mean_schlick_reflectance(lobe);
  add_microfacet(bsdf, lobe, Rgb(in[0].x), mean);
}

void add_refraction(Bsdf& bsdf, std::span<const Vec3> in, const int32_t* parameters, const SurfacePoint& point) {
  const Vec3 n = specular_normal(closure_normal(in[4], point), point);
  const float alpha = clamp01(sqr(in[2].x));
  MicrofacetLobe lobe = make_refraction(n, {alpha, alpha, {}}, in[3].x, point, false);
  lobe.microfacets = microfacets(parameters, true);
  add_microfacet(bsdf, lobe, in[0].x * to_rgb(in[1]), {});
}

/// Both return the mean reflectance of one bounce.
Rgb set_f82(MicrofacetLobe& lobe, std::span<const Vec3> in) {
  lobe.fresnel = FresnelModel::F82_TINT;
  lobe.f0 = saturate(to_rgb(in[1]));
  lobe.f90_or_b = f82_coefficient(lobe.f0, saturate(to_rgb(in[2])));
  return fresnel_f82_average(lobe.f0, lobe.f90_or_b);
}
Rgb set_conductor(MicrofacetLobe& lobe, std::span<const Vec3> in) {
  lobe.fresnel = FresnelModel::CONDUCTOR;
  const Rgb n = lobe.f0 = non_negative(to_rgb(in[1])), k = lobe.f90_or_b = non_negative(to_rgb(in[2]));
  const Rgb f0 = fresnel_conductor(1.0f, n, k), f82 = fresnel_conductor(kF82Cosine, n, k);  // a curve through both
  return saturate(fresnel_f82_average(f0, f82_coefficient_through(f0, f82)));
}

void add_metallic(Bsdf& bsdf, std::span<const Vec3> in, const int32_t* parameters, const SurfacePoint& point) {
  const Vec3 n = closure_normal(in[6], point);
  MicrofacetLobe lobe = make_microfacet(specular_normal(n, point), 0.0f);
  set_anisotropy(lobe, disney_anisotropy(clamp01(in[3].x), clamp01(in[4].x), in[7], in[5].x, n));
  lobe.microfacets = microfacets(parameters, false);
  const Rgb average_reflectance = parameters[1] != 0 ? set_conductor(lobe, in) : set_f82(lobe, in);
  put_film_on(lobe, {in[8].x, in[9].x});
  std::optional<Rgb> mean;
  if (compensates(parameters)) mean = average_reflectance;
  add_microfacet(bsdf, lobe, Rgb(in[0].x), mean);
}

void add_subsurface_closure(Bsdf& bsdf, std::span<const Vec3> in, const int32_t* parameters,
                            const SurfacePoint& point) {
  const Vec3 n = specular_normal(closure_normal(in[7], point), point);
  const Rgb radius = non_negative(to_rgb(in[2]) * in[3].x);
  Subsurface subsurface{n, Rgb(in[0].x), saturate(to_rgb(in[1])), radius};
  subsurface.method = subsurface_method(parameters[0]);
  set_boundary(subsurface, in[4].x, in[5].x, in[6].x);  // the width itself, as in Cycles: elsewhere it is squared
  add_subsurface(bsdf, subsurface, least_radius(point, subsurface.method));
}

void add_toon(Bsdf& bsdf, std::span<const Vec3> in, const int32_t* parameters, const SurfacePoint& point) {
  const Vec3 n = closure_normal(in[4], point);
  const Rgb weight = non_negative(in[0].x * to_rgb(in[1]));
  if (is_negligible(weight)) return;
  const ToonCone cone = make_toon_cone(in[2].x, in[3].x);
  if (parameters[0] == 0)
    add_lobe(bsdf, ToonDiffuseLobe{n, cone}, weight, average(weight));
  else if (bsdf.gloss.has_reflection)
    add_lobe(bsdf, ToonGlossyLobe{n, cone}, weight, average(weight));
}

void add_velvet(Bsdf& bsdf, std::span<const Vec3> in, const SurfacePoint& point) {
  const Rgb weight = non_negative(in[0].x * to_rgb(in[1]));
  if (is_negligible(weight)) return;
  constexpr float kLeastAlbedo = 0.01f;  // for what the estimate leaves out
  const VelvetLobe lobe = make_velvet(closure_normal(in[3], point), clamp01(in[2].x));
  add_lobe(bsdf, lobe, weight, average(weight) * std::max(velvet_albedo(lobe, bsdf.wo), kLeastAlbedo));
}

enum class HairParametrization { ABSORPTION, MELANIN, COLOR };

/// `in`: colour, melanin, its redness, tint, absorption.
Rgb absorption_of(std::span<const Vec3> in, HairParametrization parametrization, float radial_roughness) {
  switch (parametrization) {
    case HairParametrization::ABSORPTION:
      return to_rgb(in[4]);
    case HairParametrization::MELANIN:
      return melanin_absorption(in[1].x, in[2].x) + hair_absorption(to_rgb(in[3]), radial_roughness);
    case HairParametrization::COLOR:
      break;
  }
  return hair_absorption(to_rgb(in[0]), radial_roughness);
}

void add_hair(Bsdf& bsdf, std::span<const Vec3> in, const int32_t* parameters, const SurfacePoint& point) {
  if (in[1] == Vec3{}) return;
  HairAppearance hair;
  hair.roughness = in[7].x;
  hair.radial_roughness = in[8].x;
  hair.coat = in[9].x;
  hair.ior = in[10].x;
  hair.tilt = in[11].x;
  hair.absorption = absorption_of(in.subspan(2), static_cast<HairParametrization>(parameters[0]), in[8].x);
  HairLobe lobe = make_hair(hair, in[1], point.ng, point.wo);
  const Rgb weight(in[0].x);
  if (is_negligible(weight)) return;
  const float sample_weight = average(weight * hair_albedo(lobe, point.wo));
  if (bsdf.gloss.least_alpha > 0.0f) soften(lobe, bsdf.gloss.least_alpha);
  add_lobe(bsdf, lobe, weight, sample_weight);
}

/// What tells where light passes beside the hair, and how much of it each way has.
MicrofacetHair microfacet_hair(std::span<const Vec3> in, const SurfacePoint& point) {
  MicrofacetHair hair;
  hair.major_axis =
      point.is_strand ? in[2] : cross(in[1], point.wo);  // on what is no strand across the view, as in Cycles
  hair.aspect_ratio = in[9].x;
  hair.reflection = std::max(in[12].x, 0.0f);
  hair.transmission = std::max(in[13].x, 0.0f);
  hair.twice = std::max(in[14].x, 0.0f);
  return hair;
}

/// Of the closure's weight, that of light which goes straight on, beside the strand.
Rgb passed_beside(const MicrofacetHair& hair, std::span<const Vec3> in, const SurfacePoint& point) {
  const Rgb weight(in[0].x);
  const bool scatters = hair.reflection > 0.0f || hair.transmission > 0.0f || hair.twice > 0.0f;
  if (!point.is_strand || in[1] == Vec3{} || is_negligible(weight) || !scatters) return Rgb(0.0f);
  return passes_beside(hair, in[1], point.ng, point.wo) ? weight : Rgb(0.0f);
}

void add_microfacet_hair(Bsdf& bsdf, std::span<const Vec3> in, const int32_t* parameters, const SurfacePoint& point) {
  const Rgb weight(in[0].x);
  if (in[1] == Vec3{} || is_negligible(weight)) return;
  MicrofacetHair hair = microfacet_hair(in, point);
  if (const Rgb passed = passed_beside(hair, in, point); !is_black(passed)) {
    bsdf.transparency += passed;
    return;
  }
  hair.absorption =
      max(absorption_of(in.subspan(3), static_cast<HairParametrization>(parameters[0]), in[8].x), Rgb(0.0f));
  hair.alpha = std::max(in[8].x, bsdf.gloss.least_alpha);
  hair.ior = std::max(in[10].x, 1.0f + 1e-5f);
  hair.tilt = in[11].x;
  hair.is_seen_from_afar = !point.is_strand;
  const int walks = bsdf.count == 0 ? MicrofacetHairWays::kWalks : 1;  // mixes of many shall fit
  const MicrofacetHairWays ways = make_microfacet_hair(hair, in[1], point.ng, point.wo, place_hash(point), walks);
  for (const MicrofacetHairWays::Way& way : std::span(ways.ways).first(ways.count)) {
    const Rgb part = weight * way.weight;
    if (!is_negligible(part))
      add_lobe(bsdf, way.lobe, part, average(part) * microfacet_hair_albedo(way.lobe, point.wo));
  }
}

void add_simple_hair(Bsdf& bsdf, std::span<const Vec3> in, const int32_t* parameters, const SurfacePoint& point) {
  const Rgb weight = non_negative(in[0].x * to_rgb(in[2]));
  if (in[1] == Vec3{} || is_negligible(weight)) return;
  SimpleHairLobe lobe = make_simple_hair(normalize_or(in[1], point.ng), in[3].x, in[4].x, parameters[0] != 0);
  lobe.n = specular_normal(bump_reference(bsdf), point);
  lobe.shift = std::clamp(-in[5].x, -0.5f * kPi, 0.5f * kPi);  // what the socket takes; widths leave nothing far beyond
  add_lobe(bsdf, lobe, weight, average(weight));
}

}  // namespace

void add_closure(Bsdf& bsdf, Op op, std::span<const Vec3> inputs, const int32_t* parameters,
                 const SurfacePoint& point) {
  bsdf.ns = point.ns;
  if (inputs[0].x == 0.0f) return;
  switch (op) {
    case Op::CLOSURE_PRINCIPLED:
      return add_principled(bsdf, inputs, parameters, point);
    case Op::CLOSURE_DIFFUSE:
      return add_diffuse_closure(bsdf, inputs, parameters, point);
    case Op::CLOSURE_GLOSSY:
      return add_glossy(bsdf, inputs, parameters, point);
    case Op::CLOSURE_GLASS:
      return add_glass(bsdf, inputs, parameters, point);
    case Op::CLOSURE_REFRACTION:
      return add_refraction(bsdf, inputs, parameters, point);
    case Op::CLOSURE_TRANSLUCENT: {
      const Vec3 straight = closure_normal(inputs[2], point), n = specular_normal(straight, point);
      const Rgb weight = inputs[0].x * to_rgb(inputs[1]);
      const bool may_bend = straight != point.ng;  // towards some, who would find another lobe
      return add_diffuse(bsdf, TranslucentLobe{n}, weight, may_bend ? Rgb() : weight);
    }
    case Op::CLOSURE_SHEEN:
      if (parameters[0] != 0) return add_velvet(bsdf, inputs, point);
      add_sheen(bsdf, closure_normal(inputs[3], point), clamp01(inputs[2].x), inputs[0].x * to_rgb(inputs[1]));
      return;
    case Op::CLOSURE_SUBSURFACE:
      return add_subsurface_closure(bsdf, inputs, parameters, point);
    case Op::CLOSURE_TOON:
      return add_toon(bsdf, inputs, parameters, point);
    case Op::CLOSURE_HAIR:
      return add_hair(bsdf, inputs, parameters, point);
    case Op::CLOSURE_MICROFACET_HAIR:
      return add_microfacet_hair(bsdf, inputs, parameters, point);
    case Op::CLOSURE_SIMPLE_HAIR:
      return add_simple_hair(bsdf, inputs, parameters, point);
    case Op::CLOSURE_METALLIC:
      return add_metallic(bsdf, inputs, parameters, point);
    case Op::CLOSURE_TRANSPARENT:
      bsdf.transparency += closure_transparency(op, inputs, parameters, point, bsdf.ray_kind);
      return;
    case Op::CLOSURE_EMISSION:
      bsdf.emission += closure_emission(op, inputs, parameters, point);
      return;
    case Op::CLOSURE_HOLDOUT:
      bsdf.holdout = clamp01(bsdf.holdout + inputs[0].x);
      return;
    case Op::CLOSURE_RAY_PORTAL:
      if (is_ray_portal(op, inputs))
        add_portal(bsdf, {inputs[0].x * to_rgb(inputs[1]), inputs[2], normalize_or(inputs[3], -bsdf.wo)});
      return;
    case Op::CLOSURE_NORMAL:
      bsdf.bump_ns = closure_normal(inputs[1], point);
      return;
    default:
      return;  // not a closure
  }
}

Rgb closure_emission(Op op, std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point) {
  if (inputs[0].x == 0.0f) return Rgb(0.0f);
  if (op == Op::CLOSURE_PRINCIPLED) return principled_emission(inputs, parameters, point);
  if (op == Op::CLOSURE_EMISSION) return to_rgb(inputs[1]) * (inputs[0].x * inputs[2].x);
  return Rgb(0.0f);
}

bool is_ray_portal(Op op, std::span<const Vec3> inputs) {
  return op == Op::CLOSURE_RAY_PORTAL && !is_negligible(inputs[0].x * to_rgb(inputs[1]));
}

Rgb closure_transparency(Op op, std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point,
                         uint8_t ray_kind) {
  if (inputs[0].x == 0.0f) return Rgb(0.0f);
  if (op == Op::CLOSURE_PRINCIPLED) return principled_transparency(inputs, parameters, point, ray_kind);
  if (op == Op::CLOSURE_MICROFACET_HAIR) return passed_beside(microfacet_hair(inputs, point), inputs, point);
  if (op != Op::CLOSURE_TRANSPARENT) return Rgb(0.0f);
  const Rgb weight = inputs[0].x * to_rgb(inputs[1]);
  return is_negligible(weight) ? Rgb(0.0f) : weight;
}

}  // namespace cistern
