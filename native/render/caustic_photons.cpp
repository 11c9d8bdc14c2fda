#include "render/caustic_photons.h"

#include <algorithm>
#include <span>

#include "base/parallel.h"
#include "render/walk_start.h"
#include "shading/lobe_choice.h"
#include "shading/material.h"
#include "shading/pane_face.h"
#include "transport/path_guide.h"
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
/// Photons are left out below this much noise (noise_of) over the square of the light that smooth surfaces receive, the
/// median of what there is. (Path tracing of 16 samples, eight seeds: outdoors 0 to 10 are the same; the glossy hall
/// gains as much of its variance by less than that, 1 to 7 %, as samples then take longer.)
constexpr double kLeastNoise = 10.0;
/// What is stronger decides as much.
constexpr double kMostStrength = 1e6;
/// Directions of a smaller angle, by its cosine, are the same.
constexpr float kStraight = 0.99999f;

/// Samples of the picture for a walk, and how many walks: fewer are not worth their time, more take too much of it.
constexpr double kSamplesForWalk = 64.0;
constexpr uint32_t kLeastWalks = 1024, kMostWalks = 1 << 17;
/// A part of them goes first. If it leaves few photons the others stay away: guides would cost all paths more than they
/// bring to few. (Outdoors it leaves one for 11, in the glossy hall for 350.)
constexpr uint32_t kFirstPart = 8;
constexpr size_t kMostWalksForPhoton = 100;
/// Edge of a cell. (Outdoors, 32 samples, eight seeds: with cells of 32 pixels or up to 16 times as wide half of the
/// picture was guided, where the share of bounces that is lost so cost 11 % of variance.)
constexpr float kCellPixels = 16.0f;

std::span<const Lobe> lobes_of(const Bsdf& bsdf) { return {bsdf.lobes.data(), static_cast<size_t>(bsdf.count)}; }

/// Share of the directions of sharp lobes.
float sharp_share(const Bsdf& bsdf) {
  float sharp = 0.0f;
  for (const Lobe& lobe : lobes_of(bsdf)) sharp += is_sharp(lobe) ? lobe.sample_weight : 0.0f;
  return sharp / bsdf.total_sample_weight;
}

Ray ray_from(const SurfacePoint& point, Vec3 direction) {
  return {offset_origin(point.position, point.clearance, point.ng, direction), direction, 0.0f, INFINITY,
          point.triangle_id()};
}

/// A point of a surface as it is seen from the other end of a direction.
SurfacePoint seen_along(const Scene& scene, const SurfacePoint& point, Hit hit, Vec3 towards) {
  hit.t = 1.0f;
  return make_surface_point(scene, {point.position + towards, -towards}, hit);
}

/// The mean square of what reflecting it by chance brings, over directions distributed by the cosine, in units of
/// albedo over pi: of `light`, W/m^2, from a cone of that solid angle.
double noise_of(double light, double solid_angle) {
  constexpr double kLeastSolidAngle = 3e-8;
  return light * light * std::numbers::pi / std::max(solid_angle, kLeastSolidAngle);
}

/// The first number of [low, high) for which `is_past` holds, as it does for all behind it; or `high`.
template <class IsPast>
uint32_t first_past(uint32_t low, uint32_t high, const IsPast& is_past) {
  while (low < high) {
    const uint32_t middle = low + (high - low) / 2;
    if (is_past(middle)) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

/// Of the emitter's object: they have consecutive numbers.
uint32_t emitters_of_object(const LightSet& lights, uint32_t emitter) {
  const uint32_t object = lights.place(emitter).object, count = static_cast<uint32_t>(lights.emitter_count());
  const auto belongs = [&](uint32_t e) { return lights.place(e).object == object; };
  return first_past(emitter, count, [&](uint32_t e) { return !belongs(e); }) - first_past(0, emitter, belongs);
}

}  // namespace

/// Of some walks.
struct CausticPhotons::Found {
  struct Arrival {
    CausticPhoton photon;
    double irradiance;  // of the beam, luminance
    double noise;       // see noise_of
  };
  std::vector<Arrival> arrivals;
  std::vector<float> received;  // luminance in W/m^2, of light samples at smooth surfaces that arrive

  void add(const Found& other) {
    arrivals.insert(arrivals.end(), other.arrivals.begin(), other.arrivals.end());
    received.insert(received.end(), other.received.begin(), other.received.end());
  }
  std::vector<CausticPhoton> noisy_photons() const;
};

std::vector<CausticPhoton> CausticPhotons::Found::noisy_photons() const {
  if (arrivals.empty()) return {};
  std::vector<float> sorted = received;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  const double median = *middle, least = kLeastNoise * median * median;
  std::vector<CausticPhoton> photons;
  for (const Arrival& arrival : arrivals) {
    if (!(arrival.noise >= least)) continue;
    photons.push_back(arrival.photon);
    photons.back().strength = static_cast<float>(std::min(arrival.irradiance / median, kMostStrength));
  }
  return photons;
}

/// On its way.
struct CausticPhotons::Photon {
  SurfacePoint at;      // seen from where it came
  Vec3 from;            // where its light is, unit
  Rgb light;            // W/m^2, over the probabilities of its choices
  float length = 0.0f;  // of its way, m
  float solid_angle = 0.0f;
  float whole = 1.0f;   // of light and solid angle of its lamp over its own: of a mesh it is one triangle
  float chance = 1.0f;  // of its choices
  uint8_t visibility = kVisibleToAll;  // RayVisibility of its lamp
  bool is_met = true;                  // by scattered rays
};

CausticPhotons::CausticPhotons(const Scene& scene, const Accel& accel, const LightSet& lights, const Settings& settings)
    : context_{scene, accel, lights, settings.limits, pixel_footprint(scene.camera, settings.width, settings.height)},
      seed_(settings.seed) {
  context_.passes_panes = accel.has_panes() && settings.passes_panes(scene);
  context_.tells_kinds = scatter_kinds_matter(scene, settings.limits);
  const Region& region = settings.region;
  const auto of = [](int pixels, int all) { return static_cast<float>(pixels) / static_cast<float>(all); };
  film_begin_ = {of(region.x, settings.width), of(region.y, settings.height)};
  film_size_ = {of(region.width, settings.width), of(region.height, settings.height)};
}

CausticPhotons::Found CausticPhotons::trace_part(uint32_t first, uint32_t last, const NestedCells& cells,
                                                 const std::function<bool()>& is_stopped) const {
  std::vector<Found> blocks(block_count(last - first, kBlockSize));
  parallel_blocks(last - first, kBlockSize, [&](size_t block, size_t begin, size_t end) {
    const FlushDenormals flush;
    for (size_t i = begin; i < end && !is_stopped(); ++i) {
      Rng rng(seed_, first + static_cast<uint32_t>(i), 0, kStream);
      walk(rng, cells, blocks[block]);
    }
  });
  Found all;
  for (const Found& block : blocks) all.add(block);
  return all;
}

std::vector<CausticPhoton> CausticPhotons::trace(uint32_t walks, const NestedCells& cells,
                                                 const std::function<bool()>& is_stopped) const {
  const uint32_t first_part = walks / kFirstPart;
  Found found = trace_part(0, first_part, cells, is_stopped);
  if (found.noisy_photons().size() * kMostWalksForPhoton < first_part) return {};
  found.add(trace_part(first_part, walks, cells, is_stopped));
  return is_stopped() ? std::vector<CausticPhoton>() : found.noisy_photons();
}

void CausticPhotons::walk(Rng& rng, const NestedCells& cells, Found& found) const {
  const std::optional<WalkStart> start = start_walk(context_.scene, place_in_picture(rng.next_vec2()), rng);
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
      if (bsdf.portal_count > 0) return;
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
  const uint8_t light_set = context_.scene.instances[point.instance].light_set;
  to_light.set_receiver(light_set);
  const double u_choice = rng.next_double();
  const auto choice = context_.lights.choose(point.position, {}, u_choice, rng.next_vec2(), light_set);
  if (!choice) return std::nullopt;
  const auto light = context_.lights.evaluate(choice->sample, point.position, to_light, {}, &context_.accel);
  if (!light) return std::nullopt;
  Photon photon;
  photon.at = seen_along(context_.scene, point, hit, light->wi);
  photon.from = light->wi;
  photon.light = light->radiance * (std::abs(dot(photon.at.ns, light->wi)) / (choice->pmf * light->pdf));
  if (light->casts_shadow && !is_black(photon.light))
    photon.light *= transmittance(context_, photon.at, *light, to_light);
  const float received = luminance(photon.light);
  if (!(received > 0.0f) || !std::isfinite(received)) return std::nullopt;
  found.received.push_back(received);
  photon.length = light->distance;
  photon.solid_angle = light->is_delta ? 0.0f : 1.0f / light->pdf;
  photon.whole = light->emitter && !light->is_delta
                     ? static_cast<float>(emitters_of_object(context_.lights, choice->sample.emitter))
                     : 1.0f;
  photon.chance = choice->pmf;
  photon.visibility = light->visibility;
  photon.is_met = !light->is_delta && light->use_mis;
  return photon.whole * photon.solid_angle <= kMostOfLight ? std::optional(photon) : std::nullopt;
}

/// Whether paths that are scattered so at a photon's first surface can find its lamp.
bool CausticPhotons::is_reached(const Photon& photon, const BsdfSample& sample) {
  return (photon.visibility & ray_kind(sample.kind)) != 0 && (photon.is_met || !sample.is_delta);
}

/// Whether light samples look through that surface, as far as can be told from one of its points.
bool CausticPhotons::is_pane(const SurfacePoint& point, const Bsdf& bsdf) const {
  return context_.passes_panes && context_.accel.may_be_pane(point.instance) && find_pane_face(point, bsdf);
}

void CausticPhotons::follow(Photon photon, Rng& rng, const NestedCells& cells, Found& found) const {
  PathState state;  // as if a diffuse surface had sent the path that will come the other way
  count_scattering(state, ScatterKind::DIFFUSE);
  state.gloss = gloss_limits(context_.limits, state.ray_kind, kInvPi);
  const int most_bounces = std::min(kMostBounces, context_.limits.max_bounces);
  SurfacePoint& at = photon.at;
  bool is_by_panes = true;
  for (int bounces = 0, passed = 0; bounces <= most_bounces && passed < kMostPassed;) {
    const Bsdf bsdf = evaluate_material(context_.scene, at, state, &context_.accel);
    const float p_scatter = scatter_probability(bsdf);
    Ray ray;
    uint8_t kind = kVisibleToDiffuse;
    if (bounces > 0 && rng.next_float() >= p_scatter) {
      if (bsdf.portal_count > 0) return;
      ++passed;
      photon.light *= bsdf.transparency / (1.0f - p_scatter);
      photon.chance *= 1.0f - p_scatter;
      ray = ray_from(at, -at.wo);
    } else {
      const float light = luminance(photon.light);
      if (!(light > 0.0f) || !std::isfinite(light)) return;
      const bool is_sought = is_by_panes && dot(at.wo, photon.from) > kStraight;
      if (bounces > 0 && !is_sought && takes_guide(context_, bsdf)) {
        const double whole = photon.whole, irradiance = whole * light * photon.chance;
        const CausticPhoton here{cells.key(at.position, at.ns), at.position, at.wo, light, 0.0f, 1.0f / photon.length,
                                 photon.solid_angle * kInvPi};
        found.arrivals.push_back({here, irradiance, noise_of(irradiance, whole * photon.solid_angle)});
      }
      const float u_lobe = rng.next_float();
      const std::optional<BsdfSample> sample = sample_bsdf(bsdf, u_lobe, rng.next_vec2());
      if (!sample || sample->subsurface) return;
      const float of_lobe = sample->is_delta ? 0.0f : 1.0f / sample->pdf;
      if (of_lobe > kMostOfLobe || (bounces == 0 && !is_reached(photon, *sample))) return;
      is_by_panes = is_by_panes && sample->kind == ScatterKind::TRANSMISSION && is_pane(at, bsdf);
      photon.light *= sample->total_weight() / p_scatter;
      photon.chance *= p_scatter * sharp_share(bsdf);
      photon.solid_angle += of_lobe / photon.whole;
      ++bounces;
      ray = ray_from(at, sample->wi);
      kind = ray_kind(sample->kind);
    }
    const std::optional<Hit> hit = context_.accel.intersect(ray, kind);
    if (!hit) return;
    photon.length += hit->t;
    at = make_surface_point(context_.scene, ray, *hit);
    if (!is_finite(at.position)) return;
  }
}

std::shared_ptr<const CausticGuide> make_caustic_guide(const Settings& s, const Scene& scene, const Accel& accel,
                                                       const LightSet& lights,
                                                       const std::function<bool()>& is_stopped) {
  const double samples = static_cast<double>(s.samples) * s.region.width * s.region.height;
  const auto walks = static_cast<uint32_t>(std::min<double>(samples / kSamplesForWalk, kMostWalks));
  const bool has_caustics = s.limits.caustics_reflective || s.limits.caustics_refractive;
  const bool can_find_them = has_caustics && s.limits.max_bounces > 0 && !lights.is_empty();
  if (!s.caustic_guide || !can_find_them || walks < kLeastWalks) return nullptr;
  const PixelFootprint pixel = pixel_footprint(scene.camera, s.width, s.height);
  const NestedCells cells({.cell_pixels = kCellPixels}, accel.bounds(), scene.camera.camera_to_world.translation,
                          pixel.angle, pixel.size);
  const CausticPhotons photons(scene, accel, lights, s);
  auto guide = std::make_shared<const CausticGuide>(cells, photons.trace(walks, cells, is_stopped));
  return guide->is_empty() ? nullptr : guide;
}

}  // namespace cistern
