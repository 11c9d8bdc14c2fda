#include "render/caustic_photons.h"

#include <algorithm>
#include <span>

#include "base/parallel.h"
#include "render/walk_start.h"
#include "shading/lobe_choice.h"
#include "shading/material.h"
#include "transport/path_walk_state.h"
#include "transport/transmittance.h"

namespace cistern {
namespace {

constexpr uint32_t kStream = 0x63617573;
constexpr size_t kBlockSize = 64;
constexpr int kMostVertices = 4;  // of a walk
constexpr int kMostBounces = 4;   // of a photon by smooth surfaces
constexpr int kMostPassed = 8;    // transparent surfaces

/// Lights, and lobes, of more steradians than these are wide.
constexpr float kMostOfLight = 0.02f, kMostOfLobe = 0.05f;
/// Photons are left out below this much noise, as CausticPhoton::noise has it, over the square of the mean light that
/// smooth surfaces receive. (Path tracing of 16 samples, eight seeds, 0 and 10: the same in the glossy hall and
/// outdoors within 0.02 of the variance; there 3 % less time, as half as many cells have lobes.)
constexpr double kLeastNoise = 10.0;
/// Directions of a smaller angle, by its cosine: the light came straight through panes, where light samples look.
constexpr float kStraight = 0.99999f;

/// Samples of the picture for a walk, and how many walks: fewer are not worth their time, more know no better.
constexpr double kSamplesForWalk = 64.0, kLeastWalks = 1024.0, kMostWalks = 131'072.0;

std::span<const Lobe> lobes_of(const Bsdf& bsdf) { return {bsdf.lobes.data(), static_cast<size_t>(bsdf.count)}; }

Ray ray_from(const SurfacePoint& point, Vec3 direction) {
  return {offset_origin(point.position, point.clearance, point.ng, direction), direction, 0.0f, INFINITY,
          point.triangle_id()};
}

/// A point of a surface as it is seen from the other end of a direction.
SurfacePoint seen_along(const Scene& scene, const SurfacePoint& point, Hit hit, Vec3 towards) {
  hit.t = 1.0f;
  return make_surface_point(scene, {point.position + towards, -towards}, hit);
}

/// The square of what reflecting it by chance brings, in the mean over cosine-distributed directions, over that of a
/// surface's albedo times a light of 1.
double noise_of(const CausticPhoton& photon) {
  constexpr double kLeastSquareRadius = 1e-8;
  const double light = photon.light;
  return light * light / std::max<double>(photon.square_radius, kLeastSquareRadius);
}

}  // namespace

/// Of some walks.
struct CausticPhotons::Found {
  std::vector<CausticPhoton> photons;
  double light = 0.0;  // that smooth surfaces receive, luminance in W/m^2, summed over light samples
  uint32_t light_samples = 0;
};

/// On its way.
struct CausticPhotons::Photon {
  SurfacePoint at;  // seen from where it came
  Rgb light;        // W/m^2
  float solid_angle = 0.0f;
  Vec3 from;  // where its light is, unit
};

CausticPhotons::CausticPhotons(const Scene& scene, const Accel& accel, const LightSet& lights, const Settings& settings)
    : context_{scene, accel, lights, settings.limits, pixel_footprint(scene.camera, settings.width, settings.height)},
      seed_(settings.seed) {
  context_.passes_panes = accel.has_panes() && settings.passes_panes(scene);
}

std::vector<CausticPhoton> CausticPhotons::trace(uint32_t walks, const NestedCells& cells,
                                                 const std::function<bool()>& is_stopped) const {
  std::vector<Found> blocks(block_count(walks, kBlockSize));
  parallel_blocks(walks, kBlockSize, [&](size_t block, size_t begin, size_t end) {
    const FlushDenormals flush;
    for (size_t i = begin; i < end && !is_stopped(); ++i) {
      Rng rng(seed_, static_cast<uint32_t>(i), 0, kStream);
      walk(rng, cells, blocks[block]);
    }
  });
  if (is_stopped()) return {};
  Found all;
  for (const Found& block : blocks) {
    all.photons.insert(all.photons.end(), block.photons.begin(), block.photons.end());
    all.light += block.light;
    all.light_samples += block.light_samples;
  }
  const double mean = all.light / std::max(all.light_samples, 1u), least = kLeastNoise * mean * mean;
  std::erase_if(all.photons, [&](const CausticPhoton& photon) { return noise_of(photon) < least; });
  return std::move(all.photons);
}

void CausticPhotons::walk(Rng& rng, const NestedCells& cells, Found& found) const {
  const std::optional<WalkStart> start = start_walk(context_.scene, rng);
  if (!start) return;
  Ray ray = start->ray;
  PathState state;
  std::optional<Hit> hit = start->hit ? start->hit : context_.accel.intersect(ray, state.ray_kind);
  for (int vertices = 0, passed = 0; hit && vertices < kMostVertices && passed < kMostPassed;) {
    state.ray_length = hit->t;
    const SurfacePoint point = make_surface_point(context_.scene, ray, *hit);
    if (!is_finite(point.position)) return;
    const Bsdf bsdf = evaluate_material(context_.scene, point, state, &context_.accel);
    if (rng.next_float() >= scatter_probability(bsdf)) {
      ++passed;
      ray = ray_from(point, ray.direction);
    } else {
      if (!bsdf.scatters()) return;
      if (std::ranges::any_of(lobes_of(bsdf), is_sharp)) {
        if (const std::optional<Photon> photon = shoot(point, *hit, rng, found)) follow(*photon, rng, cells, found);
      }
      const float u_lobe = rng.next_float();
      const std::optional<BsdfSample> sample = sample_bsdf(bsdf, u_lobe, rng.next_vec2());
      if (!sample || sample->subsurface) return;
      ++vertices;
      count_scattering(state, sample->kind);
      ray = ray_from(point, sample->wi);
    }
    hit = context_.accel.intersect(ray, state.ray_kind);
  }
}

/// A photon that has arrived at a smooth surface; none of a wide light.
std::optional<CausticPhotons::Photon> CausticPhotons::shoot(const SurfacePoint& point, const Hit& hit, Rng& rng,
                                                            Found& found) const {
  PathState to_light;
  count_scattering(to_light, ScatterKind::DIFFUSE);
  count_scattering(to_light, ScatterKind::GLOSSY);
  const double u_choice = rng.next_double();
  const auto choice = context_.lights.choose(point.position, {}, u_choice, rng.next_vec2());
  ++found.light_samples;
  if (!choice) return std::nullopt;
  const auto light = context_.lights.evaluate(choice->sample, point.position, to_light, {}, &context_.accel);
  if (!light) return std::nullopt;
  Photon photon{seen_along(context_.scene, point, hit, light->wi), {}, 0.0f, light->wi};
  photon.light = light->radiance * (std::abs(dot(photon.at.ns, light->wi)) / (choice->pmf * light->pdf));
  if (light->casts_shadow && !is_black(photon.light))
    photon.light *= transmittance(context_, photon.at, *light, to_light);
  const float luminance_there = luminance(photon.light);
  if (!(luminance_there > 0.0f) || !std::isfinite(luminance_there)) return std::nullopt;
  found.light += luminance_there;
  photon.solid_angle = light->is_delta ? 0.0f : 1.0f / light->pdf;
  return photon.solid_angle <= kMostOfLight ? std::optional(photon) : std::nullopt;
}

void CausticPhotons::follow(Photon photon, Rng& rng, const NestedCells& cells, Found& found) const {
  PathState state;  // as if a diffuse surface had sent the path that will come the other way
  count_scattering(state, ScatterKind::DIFFUSE);
  state.gloss = gloss_limits(context_.limits, state.ray_kind, kInvPi);
  SurfacePoint& at = photon.at;
  bool is_refracted = true;
  for (int bounces = 0, passed = 0; bounces <= kMostBounces && passed < kMostPassed;) {
    const Bsdf bsdf = evaluate_material(context_.scene, at, state, &context_.accel);
    Ray ray;
    uint8_t kind = kVisibleToDiffuse;
    if (bounces > 0 && rng.next_float() >= scatter_probability(bsdf)) {
      ++passed;
      ray = ray_from(at, -at.wo);
    } else {
      const bool is_straight = is_refracted && dot(at.wo, photon.from) > kStraight;
      const bool is_rough = !std::ranges::all_of(lobes_of(bsdf), is_narrow);
      if (bounces > 0 && is_rough && !is_straight)
        found.photons.push_back(
            {cells.key(at.position, at.ns), at.wo, luminance(photon.light), photon.solid_angle * kInvPi});
      const float u_lobe = rng.next_float();
      const std::optional<BsdfSample> sample = sample_bsdf(bsdf, u_lobe, rng.next_vec2());
      if (!sample || sample->subsurface) return;
      const float of_lobe = sample->is_delta ? 0.0f : 1.0f / sample->pdf;
      photon.light *= sample->total_weight();
      if (of_lobe > kMostOfLobe || !(luminance(photon.light) > 0.0f)) return;
      ++bounces;
      photon.solid_angle += of_lobe;
      is_refracted &= sample->kind == ScatterKind::TRANSMISSION;
      ray = ray_from(at, sample->wi);
      kind = ray_kind(sample->kind);
    }
    const std::optional<Hit> hit = context_.accel.intersect(ray, kind);
    if (!hit) return;
    at = make_surface_point(context_.scene, ray, *hit);
    if (!is_finite(at.position)) return;
  }
}

std::shared_ptr<const CausticGuide> make_caustic_guide(const Settings& s, const Scene& scene, const Accel& accel,
                                                       const LightSet& lights,
                                                       const std::function<bool()>& is_stopped) {
  const double samples = static_cast<double>(s.samples) * s.region.width * s.region.height;
  const double walks = std::min(samples / kSamplesForWalk, kMostWalks);
  const bool has_caustics = s.limits.caustics_reflective || s.limits.caustics_refractive;
  const bool can_find_them = has_caustics && s.limits.max_bounces > 0 && !lights.is_empty();
  if (!s.caustic_guide || !can_find_them || walks < kLeastWalks) return nullptr;
  const PixelFootprint pixel = pixel_footprint(scene.camera, s.width, s.height);
  const NestedCells cells({}, accel.bounds(), scene.camera.camera_to_world.translation, pixel.angle, pixel.size);
  const CausticPhotons photons(scene, accel, lights, s);
  auto guide =
      std::make_shared<const CausticGuide>(cells, photons.trace(static_cast<uint32_t>(walks), cells, is_stopped));
  return guide->is_empty() ? nullptr : guide;
}

}  // namespace cistern
