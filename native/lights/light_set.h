#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "accel/accel.h"
#include "base/rgb.h"
#include "lights/environment_sampling.h"
#include "lights/lit_part.h"
#include "shading/surface_point.h"

namespace cistern {

enum class LightSampling : uint8_t { UNIFORM, POWER, TREE };

/// A light sample that can be evaluated again at any receiver: which emitter, and where on it.
struct LightSample {
  uint32_t emitter = 0;  // index into the LightSet: lamps, then emissive triangles, then the environment
  Vec2 uv;               // position on the emitter, in [0, 1)^2
};

/// What a light sample sends to a receiver.
struct IncidentLight {
  Vec3 wi;                 // unit, from the receiver towards the light
  float distance = 0.0f;   // INFINITY for sun and environment
  Vec3 normal;             // of the surface that emits, unit; zero for lamps and distant light, which nothing can touch
  float clearance = 0.0f;  // of that surface, see surface_clearance
  Rgb radiance;            // for `is_delta`: irradiance on a plane facing wi
  float pdf = 0.0f;        // of the direction, per solid angle, given the emitter; 1 for `is_delta`
  bool is_delta = false;
  bool casts_shadow = true;
  bool use_mis = true;                 // false: a scattered ray never finds this light, so it needs no MIS
  uint8_t visibility = kVisibleToAll;  // RayVisibility bits: not lit where the receiver's scattering kind is not in it
  uint64_t blockers = kAllSets;        // LightLinks::blockers of the emitter
  bool is_environment = false;
  bool awaits_radiance = false;     // see SkyRadiance::LATER
  std::optional<uint32_t> emitter;  // of lamps and emissive triangles
};

/// When the environment's program is asked what a light sample of it sends.
enum class SkyRadiance : uint8_t {
  NOW,
  LATER,  // once it is known to arrive, by evaluate_environment with the same path: until then the radiance is 1
};

/// A lamp shape passed through by a scattered ray before it hits a surface.
struct LampHit {
  uint32_t emitter = 0;
  float distance = 0.0f;
  Rgb radiance;
  float pdf = 0.0f;     // per solid angle given the emitter, as IncidentLight::pdf
  int max_bounces = 0;  // of the lamp: skip the hit when the receiver's PathState::depth was larger
  bool casts_shadow = true;
  uint64_t blockers = kAllSets;  // LightLinks::blockers
};

/// Where an emitter is, and what it belongs to.
struct EmitterPlace {
  Vec3 center;          // m; of a distant emitter zero
  uint32_t object = 0;  // a lamp is one by itself, emissive triangles of an instance are one together
  bool is_distant = false;
};

/// All emitters of a scene, ready for sampling. Immutable.
class LightSet {
 public:
  /// `same_sky`: lights of the same density of a scene with the same environment, whose map these share.
  LightSet(std::shared_ptr<const Scene> scene, LightSampling sampling,
           EnvironmentDensity density = EnvironmentDensity::COMPLETE, const LightSet* same_sky = nullptr);
  /// The same with openings for portals, in place of what portals it has; shares most of what the other holds. Of an
  /// even sky they are all that is sampled, so for lights of COMPENSATED density alone.
  LightSet(const LightSet& lights, std::span<const AreaLight> openings);
  ~LightSet();

  size_t emitter_count() const;
  bool is_empty() const { return emitter_count() == 0; }
  size_t memory_bytes() const;

  /// Chooses an emitter for a receiver at `position` with normal `n` (unit; zero for a point that scatters to both
  /// sides), proportionally to an estimate of what it contributes. Uses one dimension for the choice and two on the
  /// emitter. `pmf` > 0 wherever the emitter can light the point, which with light linking is one of `light_set`; empty
  /// only when no emitter can.
  struct Choice {
    LightSample sample;
    float pmf;
  };
  std::optional<Choice> choose(Vec3 position, Vec3 n, double u_choice, Vec2 u_emitter,
                               uint8_t light_set = kEveryLight) const;
  /// Probability that `choose` returns this emitter for the same receiver.
  float pmf(uint32_t emitter, Vec3 position, Vec3 n, uint8_t light_set = kEveryLight) const;

  /// A fixed probability of each emitter, near enough to what `choose` does for multiple importance sampling weights
  /// that every receiver can evaluate at no cost: 1/count with UNIFORM, else the share of all power.
  float receiver_free_pmf(uint32_t emitter) const;

  /// Emitters of an object have consecutive numbers.
  EmitterPlace place(uint32_t emitter) const;

  /// The part of a ray that the emitter may light; see lit_part.
  std::optional<LitPart> lit_part_of(uint32_t emitter, const Vec3& origin, const Vec3& direction, float length) const;

  /// Empty where the sample sends nothing to `position` (behind a one-sided light, outside a spot cone, black, or not
  /// to receivers of `path.light_set`). `path` and `cone` are those of the ray which leaves the receiver for the light,
  /// as if it had been scattered there: what the light sends may depend on them, and on `accel` (evaluate_material),
  /// and must not depend on which technique found the light.
  std::optional<IncidentLight> evaluate(const LightSample& sample, Vec3 position, const PathState& path,
                                        const RayCone& cone = {}, const Accel* accel = nullptr,
                                        SkyRadiance sky = SkyRadiance::NOW) const;

  /// The same of an emissive triangle, as it is seen in a direction; empty where it is not.
  std::optional<IncidentLight> evaluate_along(uint32_t emitter, Vec3 direction, Vec3 position, const PathState& path,
                                              const RayCone& cone, const Accel* accel) const;

  /// Emitter of a surface hit, or none when its material does not emit (or is not worth sampling).
  std::optional<uint32_t> emitter_of(uint32_t instance, uint32_t triangle) const;
  /// Density per solid angle with which `evaluate` would find this point of an emissive triangle from `receiver`.
  float surface_pdf(const SurfacePoint& emitter_point, Vec3 receiver) const;
  /// The other way round, for what emits light: the lamp (index into Scene::lights), or the triangle; neither for the
  /// environment.
  std::optional<uint32_t> lamp_of(uint32_t emitter) const;
  struct Triangle {
    uint32_t instance, triangle;
    friend bool operator==(const Triangle&, const Triangle&) = default;
  };
  std::optional<Triangle> triangle_of(uint32_t emitter) const;
  /// The environment as an emitter, none where it is not sampled (see EnvironmentDensity); and the density per solid
  /// angle of a direction from `receiver`, which may be in front of portals.
  std::optional<uint32_t> environment_emitter() const;
  float environment_pdf(Vec3 direction, Vec3 receiver) const;

  /// All lamps with an extent that the ray crosses before `ray.t_max`, that light `path.light_set`, that rays of
  /// `path.ray_kind` may see and
  /// `use_mis`, in emitter order. Suns count with distance INFINITY, only when ray.t_max is infinite. Appends to
  /// `hits`.
  void intersect_lamps(const Ray& ray, const PathState& path, std::vector<LampHit>& hits) const;
  /// The same of one of these lamps.
  std::optional<LampHit> intersect_lamp(uint32_t emitter, const Ray& ray, const PathState& path) const;
  bool has_visible_lamps() const;
  /// Whether surfaces hide some of those from no light sample.
  bool has_visible_lamps_without_shadow() const;

  struct Impl;

 private:
  std::unique_ptr<const Impl> impl_;
};

}  // namespace cistern
