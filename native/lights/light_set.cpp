#include "lights/light_set.h"

#include "base/parallel.h"
#include "base/warp.h"
#include "lights/emissive_triangles.h"
#include "lights/environment_sampling.h"
#include "lights/lamp_bvh.h"
#include "lights/lamp_shapes.h"
#include "lights/linked_choice.h"
#include "lights/portals.h"
#include "lights/spherical_triangle.h"
#include "shading/displaced_normal.h"
#include "shading/material.h"

namespace cistern {

namespace {

/// A lamp of the scene that emits.
struct SceneLamp {
  Lamp shape;
  uint32_t light = 0;        // index into Scene::lights
  bool has_program = false;  // its material depends on more than the lamp
  Instance object;           // which that sees
};

void scale_emission(Lamp& lamp, Rgb factor) {
  if (auto* ball = std::get_if<BallLamp>(&lamp)) ball->emission *= factor;
  if (auto* area = std::get_if<AreaLamp>(&lamp)) area->radiance *= factor;
  if (auto* sun = std::get_if<SunLamp>(&lamp)) {
    sun->emission *= factor;
    sun->irradiance *= magnitude(factor);
  }
}

std::vector<SceneLamp> emitting_lamps(const Scene& scene) {
  std::vector<SceneLamp> lamps;
  for (uint32_t i = 0; i < scene.lights.size(); ++i) {
    const Light& light = scene.lights[i];
    if (light.removed || is_portal(light)) continue;
    SceneLamp lamp{make_lamp(light), i, false, {}};
    lamp.object.object_to_world = light.object_to_world;
    if (light.material >= 0) {
      const auto& program = scene.materials[static_cast<size_t>(light.material)];
      if (!program || !program->may_emit) continue;
      lamp.has_program = !program->emission_is_constant;
      if (!lamp.has_program) scale_emission(lamp.shape, to_rgb(program->constant_emission));
    }
    if (lamp_power(lamp.shape, 1.0f) > 0.0f) lamps.push_back(lamp);
  }
  return lamps;
}

/// Radius of a sphere that holds all instances and finite lamps; 1 for an empty scene.
float scene_radius(const Scene& scene, const std::vector<SceneLamp>& lamps) {
  Bounds3 bounds;
  for (const Instance& instance : scene.instances) {
    if (instance.mesh < 0 || !scene.meshes[static_cast<size_t>(instance.mesh)]) continue;
    const Bounds3& box = scene.meshes[static_cast<size_t>(instance.mesh)]->bounds;
    if (box.is_empty()) continue;
    for (int corner = 0; corner < 8; ++corner) {
      bounds.extend(instance.object_to_world.point({corner & 1 ? box.upper.x : box.lower.x,
                                                    corner & 2 ? box.upper.y : box.lower.y,
                                                    corner & 4 ? box.upper.z : box.lower.z}));
    }
  }
  for (const SceneLamp& lamp : lamps) {
    if (!is_sun(lamp.shape)) bounds.extend(lamp_bounds(lamp.shape).box);
  }
  const float radius = bounds.is_empty() ? 0.0f : 0.5f * length(bounds.diagonal());
  return radius > 0.0f ? radius : 1.0f;
}

std::shared_ptr<const EnvironmentSampler> build_environment(const Scene& scene, EnvironmentDensity density) {
  auto sampler = EnvironmentSampler::build(scene, density);
  return sampler ? std::make_shared<const EnvironmentSampler>(std::move(*sampler)) : nullptr;
}

EmitterEstimate estimate_lamp(const Lamp& lamp, float radius) {
  EmitterEstimate estimate;
  estimate.power = lamp_power(lamp, radius);
  if (const auto* sun = std::get_if<SunLamp>(&lamp)) {
    estimate.is_distant = true;
    estimate.direction = sun->direction;
    estimate.cos_half_angle = 1.0f - sun->one_minus_cos;
    estimate.irradiance = sun->irradiance;
  } else {
    estimate.bounds = lamp_bounds(lamp);
  }
  return estimate;
}

/// A point of a lamp as its material sees it. Distant lamps have no place: their position is the direction that their
/// light takes, as in Cycles.
SurfacePoint lamp_point(const SceneLamp& lamp, int material, Vec3 receiver, const LampSample& sample) {
  SurfacePoint point;
  point.position = std::isinf(sample.distance) ? -sample.wi : receiver + sample.wi * sample.distance;
  point.wo = -sample.wi;
  point.ng = point.ns = lamp_normal(lamp.shape, sample.wi);
  point.barycentric = lamp_uv(lamp.shape, point.position);
  point.material = material;
  return point;
}

}  // namespace

struct LightSet::Impl {
  std::shared_ptr<const Scene> scene;
  std::vector<SceneLamp> lamps;
  std::shared_ptr<const EmissiveTriangles> triangles;
  std::shared_ptr<const EnvironmentSampler> environment;  // null where it is not sampled
  Portals portals;                                        // none where samples may be the only ones of a direction
  bool is_for_portals_alone = false;                      // are samples of the environment
  LightSampling sampling{};
  LinkedChoice choice;
  LampBvh bvh;                      // of the lamps that scattered rays can meet
  std::vector<uint32_t> wide_suns;  // suns that scattered rays can meet
  bool any_without_shadow = false;  // of both

  size_t first_triangle() const { return lamps.size(); }
  size_t environment_index() const { return lamps.size() + triangles->size(); }
  size_t emitter_count() const { return environment_index() + (environment ? 1 : 0); }
  const Light& light_of(const SceneLamp& lamp) const { return scene->lights[lamp.light]; }
  /// LightLinks::lit of all emitters.
  std::vector<uint64_t> lit_sets() const;

  /// After all else, but for the intersection.
  void prepare_choice();
  void look_through(Portals openings);
  void prepare_intersection();
  Rgb program_factor(const SceneLamp& lamp, Vec3 receiver, const LampSample& sample, const PathState& path) const;
  std::optional<IncidentLight> evaluate_lamp(uint32_t emitter, Vec2 uv, Vec3 receiver, const PathState& path) const;
  /// By a square's point, or in a direction.
  using TrianglePoint = std::variant<Vec2, Vec3>;
  std::optional<IncidentLight> evaluate_triangle(uint32_t emitter, const TrianglePoint& sample, Vec3 receiver,
                                                 const PathState& path, const RayCone& cone, const Accel* accel) const;
  const EmissiveTriangle& triangle_of(uint32_t emitter) const { return (*triangles)[emitter - first_triangle()]; }
  /// Share of the environment's samples that go through portals.
  float portal_share(Vec3 receiver) const;
  float environment_pdf(Vec3 direction, Vec3 receiver) const;
  std::optional<IncidentLight> evaluate_environment_sample(Vec2 uv, Vec3 receiver, const PathState& path,
                                                           SkyRadiance sky) const;
  std::optional<LampHit> find_hit(uint32_t emitter, const Ray& ray, const PathState& path) const;
};

void LightSet::Impl::prepare_choice() {
  constexpr size_t kBlockSize = 4096;
  const float radius = scene_radius(*scene, lamps);
  std::vector<EmitterEstimate> estimates(emitter_count());
  for (size_t i = 0; i < lamps.size(); ++i) estimates[i] = estimate_lamp(lamps[i].shape, radius);
  parallel_blocks(triangles->size(), kBlockSize, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      EmitterEstimate& estimate = estimates[first_triangle() + i];
      estimate.bounds = triangles->bounds(i);
      estimate.power = (estimate.bounds.is_two_sided ? 2.0f : 1.0f) * kPi * estimate.bounds.intensity;
    }
  });
  if (environment) {
    EmitterEstimate& estimate = estimates.back();
    estimate.is_distant = true;
    estimate.irradiance = kPi * environment->mean_radiance();
    estimate.power = 4.0f * kPi * environment->mean_radiance() * kPi * sqr(radius);
    if (is_for_portals_alone) estimate.portals = &portals;
  }
  choice = LinkedChoice(estimates, lit_sets(), sampling);
}

std::vector<uint64_t> LightSet::Impl::lit_sets() const {
  std::vector<uint64_t> sets(emitter_count(), kAllSets);
  for (size_t i = 0; i < lamps.size(); ++i) sets[i] = light_of(lamps[i]).links.lit;
  for (size_t i = 0; i < triangles->size(); ++i)
    sets[first_triangle() + i] = scene->instances[(*triangles)[i].instance].links.lit;
  return sets;
}

void LightSet::Impl::prepare_intersection() {
  std::vector<Bounds3> bounds;
  std::vector<uint32_t> items;
  for (uint32_t i = 0; i < lamps.size(); ++i) {
    const Light& light = light_of(lamps[i]);
    if (!light.use_mis || light.visibility == 0 || !has_extent(lamps[i].shape)) continue;
    any_without_shadow |= !light.casts_shadow;
    if (is_sun(lamps[i].shape)) {
      wide_suns.push_back(i);
    } else {
      bounds.push_back(lamp_bounds(lamps[i].shape).box);
      items.push_back(i);
    }
  }
  bvh = LampBvh(bounds, items);
}

Rgb LightSet::Impl::program_factor(const SceneLamp& lamp, Vec3 receiver, const LampSample& sample,
                                   const PathState& path) const {
  if (!lamp.has_program) return Rgb(1.0f);
  const SurfacePoint point = lamp_point(lamp, light_of(lamp).material, receiver, sample);
  return evaluate_lamp_emission(*scene, lamp.object, point, path);
}

std::optional<IncidentLight> LightSet::Impl::evaluate_lamp(uint32_t emitter, Vec2 uv, Vec3 receiver,
                                                           const PathState& path) const {
  const SceneLamp& lamp = lamps[emitter];
  const Light& light = light_of(lamp);
  if (!has_set(light.links.lit, path.light_set)) return std::nullopt;
  if (path.depth - 1 > light.max_bounces) return std::nullopt;  // bounces up to the receiver
  const std::optional<LampSample> sample = sample_lamp(lamp.shape, uv, receiver);
  if (!sample) return std::nullopt;
  PathState arriving = path;
  arriving.ray_length = sample->distance;
  const Rgb radiance = sample->radiance * program_factor(lamp, receiver, *sample, arriving);
  if (is_black(radiance)) return std::nullopt;
  std::optional<IncidentLight> result;
  IncidentLight& incident = result.emplace();  // in place: a copy would wait for the stores it reads
  incident.wi = sample->wi;
  incident.distance = sample->distance;
  incident.radiance = radiance;
  incident.pdf = sample->pdf;
  incident.is_delta = sample->is_delta;
  incident.casts_shadow = light.casts_shadow;
  incident.use_mis = light.use_mis && !sample->is_delta;
  incident.visibility = light.visibility;
  incident.blockers = light.links.blockers;
  incident.emitter = emitter;
  return result;
}

std::optional<IncidentLight> LightSet::Impl::evaluate_triangle(uint32_t emitter, const TrianglePoint& sample,
                                                               Vec3 receiver, const PathState& path,
                                                               const RayCone& cone, const Accel* accel) const {
  std::optional<IncidentLight> result;
  const EmissiveTriangle& t = triangle_of(emitter);
  const Instance& instance = scene->instances[t.instance];
  if (!has_set(instance.links.lit, path.light_set)) return result;
  const std::optional<SphericalTriangle> seen = SphericalTriangle::of(t, receiver);
  Vec2 barycentric;
  if (const Vec3* direction = std::get_if<Vec3>(&sample)) {
    const std::optional<Vec2> met = find_barycentric(t, receiver, *direction);
    if (!met) return result;
    barycentric = *met;
  } else {
    const Vec2 uv = std::get<Vec2>(sample);
    barycentric = seen ? barycentric_along(t, receiver, seen->direction(uv)) : square_to_triangle(uv);
  }
  const Vec3 offset = t.point(barycentric) - receiver;
  const float d2 = length_squared(offset);
  const Vec3 normal = t.scaled_normal();
  const float projected = std::abs(dot(normal, offset));  // 2 area |cos| d
  if (!(d2 > 0.0f) || !(projected > 0.0f)) return result;
  const float distance = std::sqrt(d2);
  IncidentLight& light = result.emplace();  // in place: a copy would wait for the stores it reads
  light.wi = offset * (1.0f / distance);
  light.distance = distance;
  light.normal = normalize(normal);
  light.clearance = t.clearance;
  light.pdf = seen ? seen->pdf() : 2.0f * d2 * distance / projected;
  light.visibility = instance.visibility;
  light.blockers = instance.links.blockers;
  light.emitter = emitter;
  if (const SideEmission* sides = triangles->uniform_emission(t)) {
    light.radiance = dot(normal, offset) < 0.0f ? sides->along_normal : sides->against_normal;
  } else {
    PathState arriving = path;
    arriving.ray_length = distance;
    // A hit's normal is on the object's outside, which mirroring leaves where it was.
    const bool is_mirrored = instance.object_to_world.determinant() < 0.0f;
    const Vec3 outside = is_mirrored ? -normal : normal;
    const Hit hit{distance, barycentric.x, barycentric.y, outside, t.instance, t.triangle};
    SurfacePoint point = make_surface_point(*scene, Ray{receiver, light.wi}, hit);
    set_footprint(point, cone.at(distance), *scene, arriving);
    light.radiance = evaluate_emission(*scene, point, arriving, accel);
  }
  if (is_black(light.radiance) || !std::isfinite(light.pdf)) result.reset();
  return result;
}

float LightSet::Impl::portal_share(Vec3 receiver) const {
  constexpr float kShare = 0.5f;  // what a map knows that is not even, a portal does not
  if (is_for_portals_alone) return 1.0f;
  return portals.is_empty() || !portals.can_light(receiver) ? 0.0f : kShare;
}

float LightSet::Impl::environment_pdf(Vec3 direction, Vec3 receiver) const {
  const float share = portal_share(receiver);
  const float of_portals = share > 0.0f ? share * portals.pdf(direction, receiver) : 0.0f;
  return of_portals + (share < 1.0f ? (1.0f - share) * environment->pdf(direction) : 0.0f);
}

std::optional<IncidentLight> LightSet::Impl::evaluate_environment_sample(Vec2 uv, Vec3 receiver, const PathState& path,
                                                                         SkyRadiance sky) const {
  IncidentLight light;
  const float share = portal_share(receiver);
  if (uv.x < share) {
    const std::optional<Vec3> direction = portals.sample({std::min(uv.x / share, kOneMinusEpsilon), uv.y}, receiver);
    if (!direction) return std::nullopt;
    light.wi = *direction;
    const float pdf = portals.pdf(light.wi, receiver);
    if (!(pdf > 0.0f)) return std::nullopt;  // by rounding beside the portal's edge
    light.pdf = share * pdf + (share < 1.0f ? (1.0f - share) * environment->pdf(light.wi) : 0.0f);
  } else {
    const float rest = share > 0.0f ? std::min((uv.x - share) / (1.0f - share), kOneMinusEpsilon) : uv.x;
    const EnvironmentSampler::Sample sample = environment->sample({rest, uv.y});
    light.wi = sample.direction;
    // The sampler's own density: by rounding, a direction that it found in a sun may lie beside it.
    light.pdf = (1.0f - share) * sample.pdf + (share > 0.0f ? share * portals.pdf(light.wi, receiver) : 0.0f);
  }
  light.distance = INFINITY;
  light.is_environment = true;
  light.awaits_radiance = sky == SkyRadiance::LATER;
  light.radiance = light.awaits_radiance ? Rgb(1.0f) : evaluate_environment(*scene, light.wi, path);
  light.visibility = scene->environment.visibility;
  if (is_black(light.radiance)) return std::nullopt;
  return light;
}

std::optional<LampHit> LightSet::Impl::find_hit(uint32_t emitter, const Ray& ray, const PathState& path) const {
  const SceneLamp& lamp = lamps[emitter];
  const Light& light = light_of(lamp);
  if ((light.visibility & path.ray_kind) == 0 || !has_set(light.links.lit, path.light_set)) return std::nullopt;
  const std::optional<LampSample> sample = cistern::intersect_lamp(lamp.shape, ray);
  if (!sample) return std::nullopt;
  PathState arriving = path;
  arriving.ray_length = sample->distance;
  const Rgb radiance = sample->radiance * program_factor(lamp, ray.origin, *sample, arriving);
  return LampHit{
      emitter, sample->distance, radiance, sample->pdf, light.max_bounces, light.casts_shadow, light.links.blockers};
}

void LightSet::Impl::look_through(Portals openings) {
  portals = std::move(openings);
  if (environment || portals.is_empty()) return;
  // Even light is looked for by portals, and elsewhere left to the BSDF.
  environment = build_environment(*scene, EnvironmentDensity::COMPLETE);
  is_for_portals_alone = true;
}

LightSet::LightSet(std::shared_ptr<const Scene> scene, LightSampling sampling, EnvironmentDensity density,
                   const LightSet* same_sky) {
  auto impl = std::make_unique<Impl>();
  impl->scene = std::move(scene);
  impl->lamps = emitting_lamps(*impl->scene);
  impl->triangles = std::make_shared<const EmissiveTriangles>(*impl->scene);
  const bool is_known = same_sky && !same_sky->impl_->is_for_portals_alone;
  impl->environment = is_known ? same_sky->impl_->environment : build_environment(*impl->scene, density);
  if (density == EnvironmentDensity::COMPENSATED) impl->look_through(Portals(impl->scene->lights));
  impl->sampling = sampling;
  impl->prepare_choice();
  impl->prepare_intersection();
  impl_ = std::move(impl);
}

LightSet::LightSet(const LightSet& lights, std::span<const AreaLight> openings) {
  auto impl = std::make_unique<Impl>(*lights.impl_);
  impl->look_through(Portals({}, openings));
  if (impl->is_for_portals_alone) impl->prepare_choice();  // it looks at these portals
  impl_ = std::move(impl);
}

LightSet::~LightSet() = default;

size_t LightSet::emitter_count() const { return impl_->emitter_count(); }

size_t LightSet::memory_bytes() const {
  return sizeof(Impl) + impl_->lamps.capacity() * sizeof(SceneLamp) + impl_->triangles->memory_bytes() +
         impl_->portals.memory_bytes() + impl_->choice.memory_bytes() + impl_->bvh.memory_bytes() +
         impl_->wide_suns.capacity() * sizeof(uint32_t) + (impl_->environment ? impl_->environment->memory_bytes() : 0);
}

std::optional<LightSet::Choice> LightSet::choose(Vec3 position, Vec3 n, double u_choice, Vec2 u_emitter,
                                                 uint8_t light_set) const {
  const std::optional<LightChoice::Result> result = impl_->choice.choose(light_set, position, n, u_choice);
  if (!result) return std::nullopt;
  return Choice{{result->emitter, u_emitter}, result->pmf};
}

float LightSet::pmf(uint32_t emitter, Vec3 position, Vec3 n, uint8_t light_set) const {
  return impl_->choice.pmf(light_set, emitter, position, n);
}

float LightSet::receiver_free_pmf(uint32_t emitter) const {
  return impl_->choice.among_all().receiver_free_pmf(emitter);
}

EmitterPlace LightSet::place(uint32_t emitter) const {
  if (emitter < impl_->first_triangle()) {
    const Lamp& lamp = impl_->lamps[emitter].shape;
    return is_sun(lamp) ? EmitterPlace{{}, emitter, true}
                        : EmitterPlace{lamp_bounds(lamp).box.center(), emitter, false};
  }
  const auto first_instance = static_cast<uint32_t>(impl_->first_triangle());
  if (emitter >= impl_->environment_index())
    return {{}, first_instance + static_cast<uint32_t>(impl_->scene->instances.size()), true};
  const EmissiveTriangle& t = (*impl_->triangles)[emitter - impl_->first_triangle()];
  return {t.point({1.0f / 3.0f, 1.0f / 3.0f}), first_instance + t.instance, false};
}

std::optional<LitPart> LightSet::lit_part_of(uint32_t emitter, const Vec3& origin, const Vec3& direction,
                                             float length) const {
  if (emitter >= impl_->first_triangle()) return LitPart{0.0f, length};
  return lit_part(impl_->lamps[emitter].shape, origin, direction, length);
}

std::optional<IncidentLight> LightSet::evaluate(const LightSample& sample, Vec3 position, const PathState& path,
                                                const RayCone& cone, const Accel* accel, SkyRadiance sky) const {
  if (sample.emitter < impl_->first_triangle()) return impl_->evaluate_lamp(sample.emitter, sample.uv, position, path);
  if (sample.emitter < impl_->environment_index())
    return impl_->evaluate_triangle(sample.emitter, sample.uv, position, path, cone, accel);
  return impl_->evaluate_environment_sample(sample.uv, position, path, sky);
}

std::optional<IncidentLight> LightSet::evaluate_along(uint32_t emitter, Vec3 direction, Vec3 position,
                                                      const PathState& path, const RayCone& cone,
                                                      const Accel* accel) const {
  return impl_->evaluate_triangle(emitter, direction, position, path, cone, accel);
}

std::optional<uint32_t> LightSet::emitter_of(uint32_t instance, uint32_t triangle) const {
  const std::optional<uint32_t> index = impl_->triangles->find(instance, triangle);
  if (!index) return std::nullopt;
  return static_cast<uint32_t>(impl_->first_triangle()) + *index;
}

std::optional<uint32_t> LightSet::lamp_of(uint32_t emitter) const {
  if (emitter >= impl_->first_triangle()) return std::nullopt;
  return impl_->lamps[emitter].light;
}

std::optional<LightSet::Triangle> LightSet::triangle_of(uint32_t emitter) const {
  if (emitter < impl_->first_triangle() || emitter >= impl_->environment_index()) return std::nullopt;
  const EmissiveTriangle& t = (*impl_->triangles)[emitter - impl_->first_triangle()];
  return Triangle{t.instance, t.triangle};
}

float LightSet::surface_pdf(const SurfacePoint& emitter_point, Vec3 receiver) const {
  const std::optional<uint32_t> index = impl_->triangles->find(emitter_point.instance, emitter_point.triangle);
  if (!index) return 0.0f;
  const EmissiveTriangle& triangle = (*impl_->triangles)[*index];
  if (const std::optional<SphericalTriangle> seen = SphericalTriangle::of(triangle, receiver)) return seen->pdf();
  const Vec3 offset = emitter_point.position - receiver;
  const float d2 = length_squared(offset);
  const float projected = std::abs(dot(triangle.scaled_normal(), offset));
  return projected > 0.0f ? 2.0f * d2 * std::sqrt(d2) / projected : 0.0f;
}

std::optional<uint32_t> LightSet::environment_emitter() const {
  if (!impl_->environment) return std::nullopt;
  return static_cast<uint32_t>(impl_->environment_index());
}

float LightSet::environment_pdf(Vec3 direction, Vec3 receiver) const {
  return impl_->environment ? impl_->environment_pdf(direction, receiver) : 0.0f;
}

void LightSet::intersect_lamps(const Ray& ray, const PathState& path, std::vector<LampHit>& hits) const {
  const auto first = static_cast<std::ptrdiff_t>(hits.size());
  const auto add = [&](uint32_t emitter) {
    if (const auto hit = impl_->find_hit(emitter, ray, path)) hits.push_back(*hit);
  };
  impl_->bvh.for_each(ray, add);
  std::ranges::for_each(impl_->wide_suns, add);
  std::sort(hits.begin() + first, hits.end(), [](const LampHit& a, const LampHit& b) { return a.emitter < b.emitter; });
}

std::optional<LampHit> LightSet::intersect_lamp(uint32_t emitter, const Ray& ray, const PathState& path) const {
  return impl_->find_hit(emitter, ray, path);
}

bool LightSet::has_visible_lamps() const { return !impl_->bvh.is_empty() || !impl_->wide_suns.empty(); }

bool LightSet::has_visible_lamps_without_shadow() const { return impl_->any_without_shadow; }

}  // namespace cistern
