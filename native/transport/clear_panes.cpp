#include "transport/clear_panes.h"

#include <algorithm>

#include "scene/shadow_catchers.h"
#include "shading/displaced_normal.h"
#include "shading/material.h"
#include "transport/media.h"
#include "transport/path_walk_state.h"

namespace cistern {
namespace {

bool has_panes(const Scene& scene) {
  return std::ranges::any_of(scene.materials, [](const auto& program) { return program && program->may_be_pane; });
}

/// Whether light that a material makes depends on how a path came to see it.
bool tells_paths(const Scene& scene, int material) {
  const auto* const program = material < 0 ? nullptr : scene.materials[static_cast<size_t>(material)].get();
  return program && program->tells_scattered_rays;
}

bool is_seen_alike(uint8_t visibility) { return (visibility & kVisibleToScattered) == kVisibleToScattered; }

/// Other lamps are not looked for through panes. Those without shadow are met past surfaces, see Walk::add_lamps.
bool is_even(const Scene& scene, const PathLimits& limits, const Light& light) {
  if (light.removed || is_portal(light)) return true;
  if (!light.casts_shadow) return false;
  if (!std::holds_alternative<SunLight>(light.shape)) return true;
  return is_seen_alike(light.visibility) && light.max_bounces >= limits.max_bounces &&
         !tells_paths(scene, light.material);
}

bool is_linked(const LightLinks& links) { return links.lit != kAllSets || links.blockers != kAllSets; }

bool has_links(const Scene& scene) {
  return std::ranges::any_of(scene.lights, is_linked, &Light::links) ||
         std::ranges::any_of(scene.instances, is_linked, &Instance::links);
}

}  // namespace

bool may_pass_panes(const Scene& scene, const PathLimits& limits) {
  if (!has_panes(scene) || limits.limits_gloss()) return false;
  const Environment& sky = scene.environment;
  if (sky.material >= 0 && (!is_seen_alike(sky.visibility) || tells_paths(scene, sky.material))) return false;
  if (!std::ranges::all_of(scene.lights, [&](const Light& light) { return is_even(scene, limits, light); }))
    return false;
  return !has_links(scene) && !has_shadow_catchers(scene) && shadow_rays_see_alike(scene) &&
         Media::find_name(scene).empty();
}

bool may_pass_faces(const PathState& vertex, int faces, const PathLimits& limits) {
  return vertex.depth + faces <= limits.max_bounces && vertex.diffuse_depth < limits.max_diffuse_bounces &&
         vertex.glossy_depth < limits.max_glossy_bounces &&
         vertex.transmission_depth + faces <= limits.max_transmission_bounces;
}

bool is_parallel(Vec3 begin, Vec3 end) {
  constexpr float kMostSine = 1e-4f;
  return length_squared(cross(begin, end)) < kMostSine * kMostSine && dot(begin, end) > 0.0f;
}

PanePassage pass_panes(const PathContext& context, float footprint, Ray ray, bool may_turn, const PathState& vertex,
                       PathState shadow) {
  const PanePassage nothing{Rgb(0.0f), 0, ray.direction};
  const Vec3 sought = ray.direction;
  const int most_transparent = context.limits.max_transparent_bounces;
  const RayCone cone{footprint, context.pixel.angle};
  PanePassage passed;
  float before = 0.0f;  // of its way
  shadow.ray_length = 0.0f;
  const auto meet = [&] {
    return passed.faces == 0 ? context.accel.intersect_transparent_or_pane(ray)
                             : context.accel.intersect(ray, kVisibleToShadow);
  };
  // Paths have no vertices behind the last transparent surface they pass.
  const auto ends_at_next_surface = [&](const PathState& state) {
    return state.transparent_depth > 0 && state.transparent_depth >= most_transparent;
  };
  while (const std::optional<Hit> hit = meet()) {
    SurfacePoint point = make_surface_point(context.scene, ray, *hit);
    shadow.ray_length += hit->t;
    const auto* const program = point.material < 0 ? nullptr : context.scene.materials[point.material].get();
    if (!program || !(program->may_be_transparent || program->may_be_pane)) return nothing;
    set_footprint(point, cone.at(before + shadow.ray_length), context.scene, shadow);
    std::optional<PaneFace> face;
    if (program->may_be_pane)
      face = find_pane_face(point, evaluate_material(context.scene, point, shadow, &context.accel));
    if (face) {
      if (!may_pass_faces(vertex, ++passed.faces, context.limits) || ends_at_next_surface(shadow)) return nothing;
      passed.share *= face->weight;
      count_scattering(shadow, ScatterKind::TRANSMISSION);
      shadow.ray_kind = kVisibleToShadow;
      before += shadow.ray_length;
      shadow.ray_length = 0.0f;
      ray.direction = face->wi;
    } else {
      if (shadow.transparent_depth >= most_transparent) return nothing;
      passed.share *= evaluate_transparency(context.scene, point, shadow, &context.accel);
      ++shadow.transparent_depth;
    }
    if (is_black(passed.share)) return nothing;
    ray.origin = offset_origin(point.position, point.clearance, point.ng, ray.direction);
  }
  passed.direction = ray.direction;
  return may_turn || is_parallel(sought, ray.direction) ? passed : nothing;
}

}  // namespace cistern
