#include "shading/bsdf.h"

#include <memory>
#include <span>
#include <type_traits>

#include "shading/lobe_albedo.h"
#include "shading/lobe_hair.h"
#include "shading/lobe_microfacet.h"
#include "shading/lobe_microfacet_hair.h"
#include "shading/lobe_sheen.h"
#include "shading/lobe_simple_hair.h"
#include "shading/lobe_toon.h"
#include "shading/lobe_velvet.h"

namespace cistern {
namespace {

const MicrofacetLobe* as_microfacet(const Lobe& lobe) { return std::get_if<MicrofacetLobe>(&lobe.model); }

const SimpleHairLobe* as_simple_hair(const Lobe& lobe) { return std::get_if<SimpleHairLobe>(&lobe.model); }

template <class Model, class... All>
consteval uint32_t bit_of(std::type_identity<std::variant<All...>>) {
  uint32_t bit = 1;
  static_cast<void>(((std::is_same_v<Model, All> ? false : (bit <<= 1, true)) && ...));
  return bit;
}

/// Whether the model is one of these; a look at one number, where lobes are evaluated by the million.
template <class... Models>
bool is_any_of(const Lobe& lobe) {
  constexpr uint32_t kBits = (bit_of<Models>(std::type_identity<decltype(Lobe::model)>()) | ...);
  return ((kBits >> lobe.model.index()) & 1u) != 0;
}

/// Of strands that light passes through.
bool leaves_on_all_sides(const Lobe& lobe) { return is_any_of<HairLobe, MicrofacetHairLobe>(lobe); }

/// The cone of toon lobes, or null.
const ToonCone* as_cone(const Lobe& lobe) {
  if (const auto* diffuse = std::get_if<ToonDiffuseLobe>(&lobe.model)) return &diffuse->cone;
  const auto* glossy = std::get_if<ToonGlossyLobe>(&lobe.model);
  return glossy ? &glossy->cone : nullptr;
}

/// GGX width that scatters about as far.
float width_of(const ToonCone& cone) { return 0.5f * half_angle(cone); }

ScatterKind kind_of(const Lobe& lobe, bool is_transmission) {
  if (is_transmission)
    return is_any_of<TranslucentLobe, RoughTranslucentLobe>(lobe) ? ScatterKind::TRANSLUCENT
                                                                  : ScatterKind::TRANSMISSION;
  const bool is_glossy = is_any_of<MicrofacetLobe, HairLobe, SimpleHairLobe, MicrofacetHairLobe, ToonGlossyLobe>(lobe);
  return is_glossy ? ScatterKind::GLOSSY : ScatterKind::DIFFUSE;
}

PassKind pass_kind(const Lobe& lobe, bool is_below) {
  const MicrofacetLobe* microfacet = as_microfacet(lobe);
  if (const SimpleHairLobe* hair = as_simple_hair(lobe))
    return hair->passes ? PassKind::TRANSMISSION : PassKind::GLOSSY;
  if (!microfacet)
    return is_any_of<HairLobe, MicrofacetHairLobe, ToonGlossyLobe, VelvetLobe>(lobe) ? PassKind::GLOSSY
                                                                                     : PassKind::DIFFUSE;
  return is_below ? PassKind::TRANSMISSION : PassKind::GLOSSY;
}

bool is_clear(const Lobe& lobe, ScatterKind kind) {
  constexpr float kAlphaProduct = kClearRoughness * kClearRoughness * kClearRoughness * kClearRoughness;
  const MicrofacetLobe* microfacet = as_microfacet(lobe);
  return kind == ScatterKind::TRANSMISSION && microfacet && microfacet->alpha_x * microfacet->alpha_y <= kAlphaProduct;
}

/// Factor of a diffuse lobe whose normal `n` was bent away from ns: 0 where n and ns disagree about the side of wi, and
/// the masking of a GGX surface just rough enough to contain the bend elsewhere, or 1 where that is not wanted.
/// [Conty Estevez et al. 2019, eqs. 1 and 2; constants as in Cycles 5.0]
float bump_shadowing(Vec3 ns, Vec3 n, Vec3 wi, bool corrects) {
  constexpr float kGrazing = 1e-6f;
  if (n == ns || ns == Vec3{}) return 1.0f;
  const float cos_i = dot(ns, wi), cos_bend = dot(ns, n);
  if (cos_i * cos_bend * dot(n, wi) < 0.0f) return 0.0f;
  const float a = std::abs(cos_i), b = std::abs(cos_bend);
  if (a >= 1.0f || b >= 1.0f || !corrects) return 1.0f;
  if (a < kGrazing) return 0.0f;
  const float alpha_squared = clamp01(0.125f * (1.0f / (b * b) - 1.0f));
  const float tan_squared = alpha_squared * (1.0f / (a * a) - 1.0f);
  return 2.0f / (1.0f + std::sqrt(1.0f + tan_squared));
}

Vec3 hemisphere_normal(const Bsdf& bsdf) { return bsdf.ns == Vec3{} ? bsdf.ng : bsdf.ns; }
Vec3 hemisphere_normal(const Bsdf& bsdf, const Lobe& lobe) {
  return bsdf.is_strand ? normal_of(lobe) : hemisphere_normal(bsdf);
}

/// Whether the lobe is lit from above ns where ng does not agree that it is above; see evaluate_bsdf.
template <class Model>
bool is_lit_from_behind(const Lobe& lobe, bool is_above) {
  if constexpr (std::is_same_v<Model, MicrofacetLobe>) return is_above && !is_smooth(lobe);
  if constexpr (std::is_same_v<Model, VelvetLobe>) return is_above;
  return kIsDiffuse<Model>;
}

/// The side of a surface that a direction is on.
struct Side {
  bool is_above;   // by ns
  bool can_leave;  // ng agrees
};

Side side_of(const Bsdf& bsdf, const Vec3& wi) {
  const bool is_above = dot(hemisphere_normal(bsdf), wi) > 0.0f;
  return {is_above, (dot(bsdf.ng, wi) > 0.0f) == is_above};
}

/// What it is for a lobe: on strands that of its own normal.
Side side_for(const Bsdf& bsdf, const Lobe& lobe, const Side& side, const Vec3& wi) {
  return bsdf.is_strand ? Side{dot(normal_of(lobe), wi) > 0.0f, true} : side;
}

LobeEvaluation evaluate_one(const Bsdf& bsdf, const Lobe& lobe, const Vec3& wi, const Side& side) {
  return std::visit(
      [&](const auto& model) -> LobeEvaluation {
        using Model = std::decay_t<decltype(model)>;
        if ((dot(model.n, wi) > 0.0f) != side.is_above) return {};
        if (!side.can_leave && !is_lit_from_behind<Model>(lobe, side.is_above)) return {};
        LobeEvaluation evaluation = evaluate_lobe(model, bsdf.wo, wi);
        if constexpr (kIsDiffuse<Model>) {
          const float shadowing =
              bsdf.is_strand ? 1.0f : bump_shadowing(bump_reference(bsdf), model.n, wi, bsdf.corrects_bumps);
          if (shadowing == 0.0f) return {};
          evaluation.f_cos *= shadowing;
          evaluation.even_cos = evaluation.pdf * shadowing;
        }
        return evaluation;
      },
      lobe.model);
}

bool samples_evenly(const Bsdf& bsdf, const Lobe& lobe) {
  return bsdf.rough_sampling != RoughSampling::BSDF && !is_smooth(lobe);
}

/// Probability that COSINE and UNIFORM take the side of ns for this lobe.
float upper_probability(const Lobe& lobe) {
  if (!transmits(lobe)) return 1.0f;
  const MicrofacetLobe* microfacet = as_microfacet(lobe);
  return leaves_on_all_sides(lobe) || (microfacet && microfacet->reflects) ? 0.5f : 0.0f;
}

float hemisphere_pdf(const Bsdf& bsdf, const Lobe& lobe, Vec3 wi, bool is_above) {
  const float upper = upper_probability(lobe), side = is_above ? upper : 1.0f - upper;
  const bool is_uniform = bsdf.rough_sampling == RoughSampling::UNIFORM;
  return side * kInvPi * (is_uniform ? 0.5f : std::abs(dot(hemisphere_normal(bsdf, lobe), wi)));
}

Vec3 sample_hemisphere(const Bsdf& bsdf, const Lobe& lobe, float u_side, Vec2 u) {
  const bool is_uniform = bsdf.rough_sampling == RoughSampling::UNIFORM;
  const Vec3 local = is_uniform ? square_to_cone(u, 1.0f) : square_to_cosine_hemisphere(u);
  const Vec3 n = hemisphere_normal(bsdf, lobe);
  return Frame(u_side < upper_probability(lobe) ? n : -n).to_world(local);
}

constexpr int kNoLobe = -1;

/// Parts of the density of a direction; one that is 0 cannot have produced it.
struct LobeDensities {
  float of_chosen = 0.0f;                        // one lobe's alone
  std::array<float, kScatterKinds> of_guided{};  // lobes that are not narrow, times sample weights; without a guide
};

/// By what a guide multiplies the density of lobes that are not narrow, `own` without it, where their sample weights
/// sum up to `weight`: (1 - share) own + share guide, over own.
float guide_factor(const DirectionGuide& guide, const Vec3& wi, float weight, float own) {
  return 1.0f - guide.share() + guide.share() * weight * guide.pdf(wi) / own;
}

/// evaluate_bsdf; `chosen` is a lobe.
BsdfEvaluation evaluate_lobes(const Bsdf& bsdf, const Vec3& wi, uint8_t visibility, int chosen,
                              LobeDensities& densities) {
  BsdfEvaluation result;
  float guided_weight = 0.0f, guided_pdf = 0.0f;
  const Side side_of_surface = side_of(bsdf, wi);
  for (int i = 0; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    const auto [is_above, can_leave] = side_for(bsdf, lobe, side_of_surface, wi);
    const LobeEvaluation evaluation = evaluate_one(bsdf, lobe, wi, {is_above, can_leave});
    const float pdf = samples_evenly(bsdf, lobe) ? hemisphere_pdf(bsdf, lobe, wi, is_above) : evaluation.pdf;
    if (i == chosen && can_leave) densities.of_chosen = pdf;
    const ScatterKind kind = kind_of(lobe, !is_above);
    const bool is_guided = !is_narrow(lobe);
    auto& pdf_by_kind = is_guided ? densities.of_guided : result.pdf_by_kind;
    if (can_leave) {
      pdf_by_kind[static_cast<size_t>(kind)] += lobe.sample_weight * pdf;
      result.albedo_pdf += lobe.albedo * pdf;
    }
    if (is_guided) guided_weight += lobe.sample_weight;
    if (!(evaluation.pdf > 0.0f) || (visibility & ray_kind(kind)) == 0) continue;
    (is_smooth(lobe) ? result.smooth_cos : result.rough_cos) += lobe.weight * evaluation.f_cos;
    if (can_leave) result.even_cos += lobe.even * evaluation.even_cos;
  }
  for (const float pdf : densities.of_guided) guided_pdf += pdf;
  const float factor = bsdf.guide && guided_pdf > 0.0f ? guide_factor(bsdf.guide, wi, guided_weight, guided_pdf) : 1.0f;
  if (!(bsdf.total_sample_weight > 0.0f)) return result;
  for (size_t i = 0; i < kScatterKinds; ++i) {
    float& pdf = result.pdf_by_kind[i];
    result.unguided_pdf += pdf + densities.of_guided[i];
    result.pdf += pdf = (pdf + factor * densities.of_guided[i]) / bsdf.total_sample_weight;
  }
  result.unguided_pdf /= bsdf.total_sample_weight;
  result.albedo_pdf /= bsdf.total_sample_weight;
  return result;
}

std::optional<BsdfSample> sample_delta(const Bsdf& bsdf, const Lobe& lobe, const MicrofacetLobe& model, float u) {
  const std::optional<DeltaSample> delta = sample_delta_lobe(model, bsdf.wo, u);
  if (!delta) return {};
  const bool is_above = dot(bsdf.is_strand ? model.n : bsdf.ng, delta->wi) > 0.0f;
  if (is_above != (dot(model.n, delta->wi) > 0.0f)) return {};
  BsdfSample sample;
  sample.wi = delta->wi;
  sample.pdf = sample.kind_pdf = delta->probability * lobe.sample_weight / bsdf.total_sample_weight;
  sample.smooth_weight = lobe.weight * delta->f / sample.pdf;
  sample.kind = kind_of(lobe, !is_above);
  sample.is_delta = true;
  sample.is_clear = is_clear(lobe, sample.kind);
  return sample;
}

/// The commonest surface by far: one Lambert lobe without bump shadowing. Its weight over its density is its colour.
std::optional<BsdfSample> sample_lambert(const Bsdf& bsdf, Vec3 n, Vec2 u) {
  const Vec3 local = square_to_cosine_hemisphere(u);
  std::optional<BsdfSample> result;
  BsdfSample& sample = result.emplace();  // in place: a copy would wait for the stores it reads
  sample.wi = Frame(n).to_world(local);
  sample.pdf = sample.kind_pdf = sample.albedo_pdf = local.z * kInvPi;
  sample.rough_weight = bsdf.lobes[0].weight;
  sample.even_cos = bsdf.lobes[0].even * sample.pdf;
  sample.kind = ScatterKind::DIFFUSE;
  if (!(sample.pdf > 0.0f) || dot(bsdf.ng, sample.wi) <= 0.0f) result.reset();
  return result;
}

std::span<const Subsurface> subsurfaces_of(const Bsdf& bsdf) {
  return {bsdf.subsurfaces.data(), static_cast<size_t>(bsdf.subsurface_count)};
}

/// The subsurface at `u` in their sample weights.
BsdfSample sample_subsurface(const Bsdf& bsdf, float u) {
  const std::span<const Subsurface> all = subsurfaces_of(bsdf);
  size_t chosen = 0;
  while (chosen + 1 < all.size() && u >= all[chosen].sample_weight) u -= all[chosen++].sample_weight;
  BsdfSample sample;
  sample.subsurface = &all[chosen];
  sample.pdf = sample.kind_pdf = all[chosen].sample_weight / bsdf.total_sample_weight;
  sample.smooth_weight = all[chosen].weight / sample.pdf;
  return sample;
}

BsdfSample sample_of(const Vec3& wi, const BsdfEvaluation& evaluation, ScatterKind kind) {
  BsdfSample sample;
  sample.wi = wi;
  sample.pdf = evaluation.pdf;
  sample.rough_weight = evaluation.rough_cos / evaluation.pdf;
  sample.smooth_weight = evaluation.smooth_cos / evaluation.pdf;
  sample.even_cos = evaluation.even_cos;
  sample.kind = kind;
  sample.kind_pdf = evaluation.pdf_by_kind[static_cast<size_t>(kind)];
  sample.albedo_pdf = evaluation.albedo_pdf;
  sample.guide_gain = evaluation.pdf / evaluation.unguided_pdf;
  return sample;
}

/// A direction of the guide, and with `u_kind` which of the lobes it stands in for.
std::optional<BsdfSample> sample_guide(const Bsdf& bsdf, float u_kind, Vec2 u_direction) {
  const Vec3 wi = bsdf.guide.sample(u_direction);
  LobeDensities densities;
  const BsdfEvaluation evaluation = evaluate_lobes(bsdf, wi, kVisibleToAll, kNoLobe, densities);
  float left = 0.0f;
  for (const float pdf : densities.of_guided) left += pdf;
  if (!(left > 0.0f) || is_black(evaluation.total_cos())) return {};
  left *= u_kind;
  size_t kind = 0;
  while (kind + 1 < kScatterKinds && left >= densities.of_guided[kind]) left -= densities.of_guided[kind++];
  while (!(densities.of_guided[kind] > 0.0f)) --kind;  // by rounding
  return sample_of(wi, evaluation, static_cast<ScatterKind>(kind));
}

}  // namespace

Bsdf& Bsdf::operator=(const Bsdf& other) {
  if (this == &other) return *this;
  count = other.count;
  for (size_t i = 0; i < static_cast<size_t>(count); ++i) std::construct_at(&lobes[i], other.lobes[i]);
  transparency = other.transparency;
  emission = other.emission;
  holdout = other.holdout;
  ng = other.ng;
  wo = other.wo;
  ns = other.ns;
  bump_ns = other.bump_ns;
  corrects_bumps = other.corrects_bumps;
  is_strand = other.is_strand;
  total_sample_weight = other.total_sample_weight;
  subsurface_count = other.subsurface_count;
  std::copy_n(other.subsurfaces.begin(), subsurface_count, subsurfaces.begin());
  portal_count = other.portal_count;
  std::copy_n(other.portals.begin(), portal_count, portals.begin());
  even_shade = other.even_shade;
  even_normal = other.even_normal;
  rough_sampling = other.rough_sampling;
  guide = other.guide;
  return *this;
}

void add_subsurface(Bsdf& bsdf, Subsurface subsurface, float least_radius) {
  const auto is_deep = [&](float radius) { return radius >= least_radius ? 1.0f : 0.0f; };
  Rgb deep{is_deep(subsurface.radius.r), is_deep(subsurface.radius.g), is_deep(subsurface.radius.b)};
  if (bsdf.subsurface_count == Bsdf::kMaxSubsurfaces) deep = {};
  const Rgb flat = (Rgb(1.0f) - deep) * subsurface.weight * subsurface.albedo;
  if (!is_black(flat)) add_lobe(bsdf, LambertLobe{subsurface.n}, flat, average(flat), flat);
  subsurface.weight *= deep;
  const float sample_weight = subsurface.sample_weight = average(subsurface.weight * subsurface.albedo);
  if (!(sample_weight > 0.0f) || !std::isfinite(sample_weight)) return;
  bsdf.subsurfaces[static_cast<size_t>(bsdf.subsurface_count++)] = subsurface;
  bsdf.total_sample_weight += sample_weight;
}

void add_portal(Bsdf& bsdf, const RayPortal& portal) {
  if (bsdf.portal_count == Bsdf::kMaxPortals) return;
  bsdf.transparency += portal.weight;
  bsdf.portals[static_cast<size_t>(bsdf.portal_count++)] = portal;
}

BsdfEvaluation evaluate_bsdf(const Bsdf& bsdf, const Vec3& wi, uint8_t visibility) {
  LobeDensities densities;
  return evaluate_lobes(bsdf, wi, visibility, kNoLobe, densities);
}

std::optional<BsdfSample> sample_bsdf(const Bsdf& bsdf, float u_lobe, Vec2 u_direction) {
  if (bsdf.subsurface_count > 0) {
    float of_lobes = bsdf.total_sample_weight;
    for (const Subsurface& subsurface : subsurfaces_of(bsdf)) of_lobes -= subsurface.sample_weight;
    const float u = u_lobe * bsdf.total_sample_weight;
    if (bsdf.count == 0 || u >= of_lobes) return sample_subsurface(bsdf, u - of_lobes);
  }
  if (bsdf.count == 0) return {};
  if (bsdf.subsurface_count == 0 && bsdf.count == 1 && bsdf.rough_sampling == RoughSampling::BSDF && !bsdf.guide) {
    const auto* lambert = std::get_if<LambertLobe>(&bsdf.lobes[0].model);
    const bool is_unbent = lambert && lambert->n == bsdf.ns && bump_reference(bsdf) == bsdf.ns;
    if (is_unbent) return sample_lambert(bsdf, lambert->n, u_direction);
  }
  // Choose a lobe and reuse what is left of u_lobe for its branch.
  float u = u_lobe * bsdf.total_sample_weight;
  int chosen = 0;
  while (chosen + 1 < bsdf.count && u >= bsdf.lobes[static_cast<size_t>(chosen)].sample_weight)
    u -= bsdf.lobes[static_cast<size_t>(chosen++)].sample_weight;
  const Lobe& lobe = bsdf.lobes[static_cast<size_t>(chosen)];
  const float u_branch = std::min(u / lobe.sample_weight, kOneMinusEpsilon);
  if (bsdf.guide && !is_narrow(lobe)) {
    // By a coordinate of the direction: so both parts are stratified.
    const float x = u_direction.x, share = bsdf.guide.share();
    if (x < share) return sample_guide(bsdf, u_branch, {std::min(x / share, kOneMinusEpsilon), u_direction.y});
    u_direction.x = std::min((x - share) / (1.0f - share), kOneMinusEpsilon);
  }

  if (const MicrofacetLobe* model = as_microfacet(lobe); model && is_delta(*model))
    return sample_delta(bsdf, lobe, *model, u_branch);
  const std::optional<Vec3> wi =
      samples_evenly(bsdf, lobe)
          ? sample_hemisphere(bsdf, lobe, u_branch, u_direction)
          : std::visit([&](const auto& model) { return sample_lobe(model, bsdf.wo, u_branch, u_direction); },
                       lobe.model);
  if (!wi) return {};
  LobeDensities densities;
  const BsdfEvaluation evaluation = evaluate_lobes(bsdf, *wi, kVisibleToAll, chosen, densities);
  if (!(densities.of_chosen > 0.0f) || is_black(evaluation.total_cos())) return {};
  const bool is_below = dot(bsdf.is_strand ? normal_of(lobe) : bsdf.ng, *wi) < 0.0f;
  BsdfSample sample = sample_of(*wi, evaluation, kind_of(lobe, is_below));
  sample.is_clear = is_clear(lobe, sample.kind);
  return sample;
}

float mean_roughness(const Bsdf& bsdf) {
  float sum = 0.0f, weights = 0.0f;
  for (int i = 0; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    const MicrofacetLobe* microfacet = as_microfacet(lobe);
    if (!microfacet) continue;
    const float weight = std::abs(average(lobe.weight));
    sum += weight * std::sqrt(std::sqrt(microfacet->alpha_x * microfacet->alpha_y));
    weights += weight;
  }
  return weights > 0.0f ? sum / weights : 1.0f;
}

bool is_smooth(const Lobe& lobe) {
  // roughness^4 = alpha_x alpha_y
  constexpr float kAlphaProduct = kReconnectRoughness * kReconnectRoughness * kReconnectRoughness * kReconnectRoughness;
  if (const MicrofacetLobe* microfacet = as_microfacet(lobe))
    return microfacet->alpha_x * microfacet->alpha_y < kAlphaProduct;
  if (!is_any_of<HairLobe, SimpleHairLobe, MicrofacetHairLobe, ToonDiffuseLobe, ToonGlossyLobe>(lobe)) return false;
  if (const auto* hair = std::get_if<HairLobe>(&lobe.model)) return hair->is_smooth;
  if (const auto* hair = std::get_if<MicrofacetHairLobe>(&lobe.model)) return sqr(hair->alpha) < kAlphaProduct;
  if (const SimpleHairLobe* hair = as_simple_hair(lobe)) return is_smooth(*hair);
  return sqr(width_of(*as_cone(lobe))) < kAlphaProduct;
}

bool is_narrow(const Lobe& lobe) {
  if (const MicrofacetLobe* microfacet = as_microfacet(lobe))
    return std::min(microfacet->alpha_x, microfacet->alpha_y) < kNarrowAlpha;
  if (is_any_of<HairLobe, SimpleHairLobe, MicrofacetHairLobe>(lobe)) return true;
  return is_any_of<ToonDiffuseLobe, ToonGlossyLobe>(lobe) && width_of(*as_cone(lobe)) < kNarrowAlpha;
}

bool transmits(const Lobe& lobe) {
  if (const MicrofacetLobe* microfacet = as_microfacet(lobe)) return microfacet->transmits;
  if (const SimpleHairLobe* hair = as_simple_hair(lobe)) return hair->passes;
  return is_any_of<TranslucentLobe, RoughTranslucentLobe, HairLobe, MicrofacetHairLobe>(lobe);
}

bool turns_away(const Bsdf& bsdf) {
  if (!bsdf.is_strand) return false;
  const std::span lobes(bsdf.lobes.data(), static_cast<size_t>(bsdf.count));
  return std::ranges::any_of(lobes, [&](const Lobe& lobe) { return normal_of(lobe) != bsdf.ns; });
}

BsdfKinds evaluate_kinds(const Bsdf& bsdf, const Vec3& wi, uint8_t visibility) {
  BsdfKinds kinds;
  const Side side_of_surface = side_of(bsdf, wi);
  for (int i = 0; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    const Side side = side_for(bsdf, lobe, side_of_surface, wi);
    const LobeEvaluation evaluation = evaluate_one(bsdf, lobe, wi, side);
    if (!(evaluation.pdf > 0.0f) || (visibility & ray_kind(kind_of(lobe, !side.is_above))) == 0) continue;
    KindColors& part = is_smooth(lobe) ? kinds.smooth : kinds.rough;
    part[static_cast<size_t>(pass_kind(lobe, !side.is_above))] += lobe.weight * evaluation.f_cos;
  }
  return kinds;
}

KindColors albedo_by_kind(const Bsdf& bsdf) {
  KindColors colors;
  const auto of = [&](PassKind kind) -> Rgb& { return colors[static_cast<size_t>(kind)]; };
  for (int i = 0; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    if (const MicrofacetLobe* microfacet = as_microfacet(lobe)) {
      const SidedAlbedo albedo = microfacet_albedo_by_side(*microfacet, bsdf.wo);
      of(PassKind::GLOSSY) += lobe.weight * albedo.reflected;
      of(PassKind::TRANSMISSION) += lobe.weight * albedo.transmitted;
    } else {
      of(pass_kind(lobe, false)) += lobe.weight * lobe_color(lobe, bsdf.wo);
    }
  }
  for (const Subsurface& subsurface : subsurfaces_of(bsdf))
    of(PassKind::DIFFUSE) += subsurface.weight * subsurface.albedo;
  return colors;
}

KindColors shares_of(const KindColors& colors) {
  Rgb sum;
  for (const Rgb& color : colors) sum += color;
  const auto share = [](float part, float whole) { return whole != 0.0f ? part / whole : 0.0f; };
  KindColors shares;
  for (size_t i = 0; i < colors.size(); ++i)
    shares[i] = {share(colors[i].r, sum.r), share(colors[i].g, sum.g), share(colors[i].b, sum.b)};
  return shares;
}

KindColors all_of(PassKind kind) {
  KindColors shares;
  shares[static_cast<size_t>(kind)] = Rgb(1.0f);
  return shares;
}

uint8_t scattered_kinds(const Bsdf& bsdf) {
  uint8_t kinds = 0;
  for (int i = 0; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    const MicrofacetLobe* microfacet = as_microfacet(lobe);
    if (microfacet && is_delta(*microfacet)) continue;
    if (transmits(lobe)) kinds |= ray_kind(kind_of(lobe, true));
    if (microfacet ? microfacet->reflects : leaves_on_all_sides(lobe) || !transmits(lobe))
      kinds |= ray_kind(kind_of(lobe, false));
  }
  return kinds;
}

ScatterKind strongest_kind(const Bsdf& bsdf) {
  const Lobe* strongest = &bsdf.lobes[0];
  for (int i = 1; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    if (lobe.albedo > strongest->albedo) strongest = &lobe;
  }
  return kind_of(*strongest, transmits(*strongest));
}

}  // namespace cistern
