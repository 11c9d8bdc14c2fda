#pragma once

#include "accel/accel.h"
#include "lights/light_set.h"
#include "transport/camera_ray.h"

namespace cistern {

/// Limits of a path as Blender users know them: a limit of n allows n scatterings after the first one of its kind is
/// lit, so 0 is direct light only. Transparent surfaces: a path passes n, and of
/// what it meets after the last only sees the emission; its shadow rays pass as many as the path has left.
struct PathLimits {
  int max_bounces = 12;
  int max_diffuse_bounces = 12;
  int max_glossy_bounces = 12;
  int max_transmission_bounces = 12;
  int max_volume_bounces = 12;
  int max_transparent_bounces = 8;
  int min_bounces = 1;        // Russian roulette starts after these
  float clamp_direct = 0.0f;  // largest mean radiance of one contribution, 0: off
  float clamp_indirect = 0.0f;
  /// Of light that has turned so often, at whatever surfaces: as in Cycles, indirect is what has turned twice. Light
  /// that is seen straight has no limit.
  float clamp_after(int bounces) const { return bounces == 0 ? 0.0f : bounces == 1 ? clamp_direct : clamp_indirect; }
  /// Softens lobes met after a scattering of a density (per solid angle) below this, more the lower it is; 0: none.
  float filter_glossy = 0.0f;
  /// Without: what diffuse scattering sends their way is not reflected by gloss, not refracted.
  bool caustics_reflective = true, caustics_refractive = true;
  bool film_transparent = false;  // the camera sees through to nothing instead of the environment
  bool film_transparent_glass = false;
  friend bool operator==(const PathLimits&, const PathLimits&) = default;

  bool limits_gloss() const { return filter_glossy > 0.0f || !caustics_reflective || !caustics_refractive; }
};
/// Of a path whose last scattering made a ray of this kind, and the least likely one so far had a density of
/// `least_pdf` (per solid angle, without guides; those of delta lobes do not count). As in Cycles.
GlossLimits gloss_limits(const PathLimits& limits, uint8_t ray_kind, float least_pdf);

class LearnedLights;
class Media;

/// Where light samples of a path are chosen by what was learned, instead of by the light set.
struct LearnedLightUse {
  const LearnedLights* lights;
  bool at_visible_point = false;  // and at smooth vertices before it
  bool at_later_vertices = false;
};

class PathGuide;
class CausticGuide;

/// Where the directions of paths come from.
struct GuideUse {
  const PathGuide* guide;
  bool is_on = false;  // or paths only leave records
};

/// What a path needs besides its own random numbers; all of it immutable while rendering.
struct PathContext {
  const Scene& scene;
  const Accel& accel;
  const LightSet& lights;
  PathLimits limits;
  PixelFootprint pixel;
  /// Whether PathRecord's members about the first surfaces are wanted.
  bool record_surfaces = true;
  /// Whether reuse has to tell diffuse, glossy and transmitted rays apart: scatter_kinds_matter.
  bool tells_kinds = false;
  /// Whether rays of a kind carry what lobes of that kind scatter, and not their share of all: emitters_tell_kinds.
  bool divides_kinds = false;
  /// Light samples of the first vertex by next-event estimation, where the light set chooses. [Veach 1997, 9.2.1: the
  /// multi-sample model]
  int light_samples = 1;
  /// Null: the light set chooses everywhere.
  const LearnedLightUse* learned = nullptr;
  /// Null: nothing is learned about directions.
  const GuideUse* guiding = nullptr;
  /// Null: bounces are not guided towards caustics.
  const CausticGuide* caustics = nullptr;
  /// Whether PathScratch::seen_surfaces is wanted; only with record_surfaces.
  bool record_seen = false;
  /// Null: there are none.
  const Media* media = nullptr;
  /// Whether materials may bend light by its wavelength. Paths are not captured then.
  bool disperses = false;
  /// Scene::has_shadow_links.
  bool has_shadow_links = false;
  /// Whether light is also wanted by kinds of scattering: LightByKind, and what PathCapture has of that.
  bool splits_kinds = false;
  /// How many light groups it is wanted by: PathScratch::light_by_group, and what PathCapture has of that.
  size_t light_groups = 0;
  /// Whether the environment behind a transparent film, which Combined leaves out, is in its group.
  bool groups_behind_film = false;

  /// Whether light samples pass panes, where may_pass_panes.
  bool passes_panes = false;

  /// Whether light is wanted in parts at all.
  bool splits() const { return splits_kinds || light_groups > 0; }
};

/// Group of an emitter of the context's lights.
LightGroup light_group_of(const PathContext& context, uint32_t emitter);

/// Whether what has these RayVisibility bits is there for rays of some kinds of scattering at surfaces, not of all.
bool tells_kinds(uint8_t visibility);

/// Whether what a scattered ray meets, or how far its path goes on, depends on the kind of its scattering: by ray
/// visibility, bounce limits or materials that read the path.
bool scatter_kinds_matter(const Scene& scene, const PathLimits& limits);

/// Whether shadow rays find the same surfaces as scattered rays do, and the same transparency.
bool shadow_rays_see_alike(const Scene& scene);

/// Whether some emitter that scattered rays may meet is hidden from some kinds of them. Light samples of it reflect by
/// lobes of the other kinds, f_V; rays that carry their share p_k / p of what all lobes scatter would find another
/// integral, and multiple importance sampling of the two depends on its weights. So they carry f_k / p_k, whose sum
/// over the kinds is f_V. Weights, which are those of all kinds together, stay as they are.
bool emitters_tell_kinds(const Scene& scene);

}  // namespace cistern
