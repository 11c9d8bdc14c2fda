#include "transport/visible_points.h"

#include "shading/lobe_albedo.h"
#include "shading/material.h"

namespace cistern {
namespace {

constexpr float kLeastTransmission = 0.1f;  // albedo of what lets light through at all

void add_normal(Receiver& receiver, const Lobe& lobe, Rgb albedo) {
  receiver.n += std::visit([](const auto& model) { return model.n; }, lobe.model) * luminance(albedo);
}

/// Adds a microfacet lobe; returns its albedo.
float add_microfacet(Receiver& receiver, const Lobe& lobe, const MicrofacetLobe& model) {
  // Facets that lean let light through where the mean one reflects all of it.
  const Rgb of_facets = lobe_albedo(lobe, receiver.wo);
  const Rgb albedo = lobe.weight * (model.transmits ? max(of_facets, Rgb(kLeastTransmission)) : of_facets);
  // How glass divides light between its sides depends on the direction; half is near enough for a guess.
  const float reflected = !model.reflects ? 0.0f : (model.transmits ? 0.5f : 1.0f);
  receiver.glossy += albedo * reflected;
  receiver.transmission += luminance(albedo) * (1.0f - reflected);
  add_normal(receiver, lobe, albedo);
  return luminance(albedo);
}

/// Light leaves strands on all sides.
void add_hair(Receiver& receiver, const Lobe& lobe) {
  const Rgb albedo = lobe.weight * lobe_albedo(lobe, receiver.wo);
  receiver.glossy += 0.5f * albedo;
  receiver.transmission += 0.5f * luminance(albedo);
  add_normal(receiver, lobe, albedo);
}

bool is_reflecting_hair(const Lobe& lobe) {
  const auto* hair = std::get_if<SimpleHairLobe>(&lobe.model);
  return hair && !hair->passes;
}

void add_even_lobe(Receiver& receiver, const Lobe& lobe) {
  if (transmits(lobe)) {
    receiver.transmission += luminance(lobe.weight);
  } else {
    receiver.diffuse += lobe.weight;
  }
  add_normal(receiver, lobe, lobe.weight);
}

/// The Lambert lobe that all scattering is by, if a VisiblePoint alone can say how: one that is as it is without bump
/// shadowing, or whose normal shows that there is some. Or null.
const LambertLobe* only_lambert_lobe(const Bsdf& bsdf) {
  if (bsdf.count != 1 || turns_away(bsdf) || bsdf.even_shade != 0.0f || bsdf.lobes[0].even != bsdf.lobes[0].weight)
    return nullptr;
  const auto* lambert = std::get_if<LambertLobe>(&bsdf.lobes[0].model);
  return lambert && (lambert->n != bsdf.ns || bump_reference(bsdf) == bsdf.ns) ? lambert : nullptr;
}

/// Sums over the rough lobes.
Receiver describe_receiver(const SurfacePoint& point, const Bsdf& bsdf) {
  Receiver receiver{point.position, light_side(point, bsdf), {}, point.wo, {}, {}, 1.0f, 0.0f};
  float microfacets = 0.0f, alpha = 0.0f;
  for (int i = 0; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    if (is_smooth(lobe)) continue;
    if (const auto* model = std::get_if<MicrofacetLobe>(&lobe.model)) {
      const float albedo = add_microfacet(receiver, lobe, *model);
      microfacets += albedo;
      alpha += albedo * std::sqrt(model->alpha_x * model->alpha_y);
    } else if (std::holds_alternative<HairLobe>(lobe.model) || std::holds_alternative<MicrofacetHairLobe>(lobe.model)) {
      add_hair(receiver, lobe);
    } else if (std::holds_alternative<VelvetLobe>(lobe.model)) {
      const Rgb albedo = lobe.weight * lobe_albedo(lobe, bsdf.wo);
      receiver.glossy += albedo;
      add_normal(receiver, lobe, albedo);
    } else if (std::holds_alternative<ToonGlossyLobe>(lobe.model) || is_reflecting_hair(lobe)) {
      receiver.glossy += lobe.weight;
      add_normal(receiver, lobe, lobe.weight);
    } else {
      add_even_lobe(receiver, lobe);
    }
  }
  if (microfacets > 0.0f) receiver.alpha = alpha / microfacets;
  receiver.n = normalize_or(receiver.n, point.ns);
  return receiver;
}

/// By lobes and not by their albedos, which depend on the view.
float mean_alpha(const Bsdf& bsdf) {
  float sum = 0.0f, count = 0.0f;
  for (int i = 0; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    const auto* model = std::get_if<MicrofacetLobe>(&lobe.model);
    if (!model || is_smooth(lobe)) continue;
    sum += std::sqrt(model->alpha_x * model->alpha_y);
    count += 1.0f;
  }
  return count > 0.0f ? sum / count : 1.0f;
}

}  // namespace

Vec3 light_side(const SurfacePoint& point, const Bsdf& bsdf) {
  if (turns_away(bsdf)) return {};
  for (int i = 0; i < bsdf.count; ++i)
    if (transmits(bsdf.lobes[static_cast<size_t>(i)])) return {};
  return point.ns;
}

VisiblePoint make_visible_point(const Scene& scene, const SurfacePoint& point, const Bsdf& bsdf) {
  VisiblePoint visible;
  visible.receiver = describe_receiver(point, bsdf);
  visible.ng = point.ng;
  visible.ns = point.ns;
  visible.barycentric = point.barycentric;
  visible.instance = point.instance;
  visible.triangle = point.triangle;
  visible.material = point.material;
  visible.clearance = point.clearance;
  visible.footprint = point.footprint;
  visible.is_backface = point.is_backface;
  visible.is_strand = point.is_strand;
  visible.exists = true;
  const LambertLobe* lambert = only_lambert_lobe(bsdf);
  visible.is_lambertian = lambert && !scene.materials[static_cast<size_t>(point.material)]->depends_on_view;
  if (visible.is_lambertian) visible.receiver.n = lambert->n;  // without roundings
  visible.mean_alpha = mean_alpha(bsdf);
  visible.even_shade = bsdf.even_shade;
  visible.even_normal = bsdf.even_normal;
  visible.rough_sampling = bsdf.rough_sampling;
  visible.scattered_kinds = scattered_kinds(bsdf);
  visible.turns_away = turns_away(bsdf);
  return visible;
}

SurfacePoint surface_point(const VisiblePoint& visible) {
  SurfacePoint point;
  point.position = visible.receiver.position;
  point.ng = visible.ng;
  point.ns = visible.ns;
  point.wo = visible.receiver.wo;
  point.barycentric = visible.barycentric;
  point.instance = visible.instance;
  point.triangle = visible.triangle;
  point.material = visible.material;
  point.is_backface = visible.is_backface;
  point.is_strand = visible.is_strand;
  point.clearance = visible.clearance;
  point.footprint = visible.footprint;
  return point;
}

Bsdf evaluate_material(const Scene& scene, const VisiblePoint& visible, const Accel* accel) {
  Bsdf bsdf = evaluate_material(scene, surface_point(visible), visible.state, accel);
  bsdf.rough_sampling = visible.rough_sampling;
  return bsdf;
}

KindColors rough_shares(const Scene& scene, const VisiblePoint& visible, Vec3 wi, uint8_t visibility,
                        const Accel* accel) {
  return shares_of(evaluate_kinds(evaluate_material(scene, visible, accel), wi, visibility).rough);
}

}  // namespace cistern
