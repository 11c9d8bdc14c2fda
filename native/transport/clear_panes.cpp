#include "transport/clear_panes.h"

#include <algorithm>
#include <utility>

#include "lights/lamp_shapes.h"
#include "scene/shadow_catchers.h"
#include "shading/displaced_normal.h"
#include "shading/material.h"
#include "transport/media.h"

namespace cistern {
namespace {

bool has_panes(const Scene& scene) {
  return std::ranges::any_of(scene.materials, [](const auto& program) { return program && program->may_be_pane; });
}

/// Whether surfaces that emit are told how paths came to see them.
bool emission_tells_paths(const Scene& scene) {
  return std::ranges::any_of(scene.materials, [](const auto& program) {
    return program && program->may_emit && program->tells_scattered_rays;
  });
}

/// Lamps that scattered rays do not meet are not sought either. Those without shadow are met past surfaces, see
/// Walk::add_lamps.
bool is_even(const PathLimits& limits, const Light& light) {
  if (light.removed || !light.use_mis || is_portal(light) || !has_extent(make_lamp(light))) return true;
  return light.casts_shadow && !tells_kinds(light.visibility) && light.max_bounces >= limits.max_bounces;
}

bool is_linked(const LightLinks& links) { return links.lit != kAllSets || links.blockers != kAllSets; }

bool has_links(const Scene& scene) {
  const auto is_linked_lamp = [](const Light& light) { return !light.removed && is_linked(light.links); };
  return std::ranges::any_of(scene.lights, is_linked_lamp) ||
         std::ranges::any_of(scene.instances, is_linked, &Instance::links);
}

}  // namespace

bool may_pass_panes(const Scene& scene, const PathLimits& limits) {
  if (!has_panes(scene) || limits.limits_gloss()) return false;
  const Environment& sky = scene.environment;
  if (sky.material >= 0 && tells_kinds(sky.visibility)) return false;
  if (!std::ranges::all_of(scene.lights, [&](const Light& light) { return is_even(limits, light); })) return false;
  return !emission_tells_paths(scene) && !has_links(scene) && !has_shadow_catchers(scene) &&
         shadow_rays_see_alike(scene) && Media::find_name(scene).empty();
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

PaneRay::PaneRay(const PathContext& context, float footprint, const Ray& ray, const PathState& vertex, PathState shadow)
    : context_(context),
      ray_(ray),
      vertex_(vertex),
      shadow_(shadow),
      cone_{footprint, context.pixel.angle},
      begin_(ray.direction),
      last_face_(ray.origin) {
  shadow_.ray_length = 0.0f;
}

std::optional<Hit> PaneRay::meet() const {
  return faces_ == 0 && !context_.accel.has_splats() ? context_.accel.intersect_transparent_or_pane(ray_)
                                                     : context_.accel.intersect(ray_, kVisibleToShadow);
}

Ray PaneRay::segment(const std::optional<Hit>& next) const {
  return {last_face_, ray_.direction, shadow_.ray_length, next ? shadow_.ray_length + next->t : INFINITY};
}

SurfacePoint PaneRay::point(const Hit& next) const {
  SurfacePoint point = make_surface_point(context_.scene, ray_, next);
  PathState arriving = shadow_;
  arriving.ray_length += next.t;
  set_footprint(point, cone_.at(before_ + arriving.ray_length), context_.scene, arriving);
  return point;
}

bool PaneRay::pass(const Hit& hit) {
  const SurfacePoint point = this->point(hit);
  const auto* const program =
      point.material < 0 ? nullptr : context_.scene.materials[static_cast<size_t>(point.material)].get();
  if (!program || !(program->may_be_transparent || program->may_be_pane)) return false;
  shadow_.ray_length += hit.t;
  std::optional<PaneFace> face;
  if (program->may_be_pane && context_.accel.may_be_pane(point.instance))
    face = find_pane_face(point, evaluate_material(context_.scene, point, shadow_, &context_.accel));
  if (!face) return pass_transparent(point);
  // Paths have no vertices behind the last transparent surface they pass.
  const int transparent = shadow_.transparent_depth;
  if (transparent > 0 && transparent >= context_.limits.max_transparent_bounces) return false;
  if (!may_pass_faces(vertex_, ++faces_, context_.limits)) return false;
  share_ *= face->weight;
  before_ += std::exchange(shadow_.ray_length, 0.0f);
  last_face_ = offset_origin(point.position, point.clearance, point.ng, face->wi);
  ray_ = {last_face_, face->wi};
  return !is_black(share_);
}

bool PaneRay::pass_transparent(const SurfacePoint& point) {
  if (shadow_.transparent_depth >= context_.limits.max_transparent_bounces) return false;
  share_ *= evaluate_transparency(context_.scene, point, shadow_, &context_.accel);
  ++shadow_.transparent_depth;
  ray_.origin = offset_origin(point.position, point.clearance, point.ng, ray_.direction);
  ray_.passes = point.triangle_id();
  return !is_black(share_);
}

PanePassage pass_panes(PaneRay ray, bool may_turn) {
  while (const std::optional<Hit> hit = ray.meet())
    if (!ray.pass(*hit)) return {};
  if (!may_turn && !ray.is_parallel_again()) return {};
  return {ray.share(), ray.faces(), ray.direction()};
}

PassedLight find_lamp_past_panes(const PathContext& context, PaneRay ray, uint32_t emitter) {
  PathState seen;
  seen.ray_kind = kVisibleToTransmission;
  PassedLight passed;
  for (;;) {
    const std::optional<Hit> hit = ray.meet();
    if (ray.faces() > 0 && ray.is_parallel_again()) {
      const std::optional<LampHit> lamp = context.lights.intersect_lamp(emitter, ray.segment(hit), seen);
      if (lamp) passed = {passed.radiance + lamp->radiance * ray.share(), ray.faces()};
    }
    if (!hit || !ray.pass(*hit)) return passed;
  }
}

PassedLight find_triangle_past_panes(const PathContext& context, PaneRay ray, uint32_t emitter) {
  PathState seen;
  seen.ray_kind = kVisibleToTransmission;
  while (const std::optional<Hit> hit = ray.meet()) {
    const bool is_met = context.lights.emitter_of(hit->instance, hit->triangle) == emitter;  // or one in its place
    if (is_met && ray.faces() > 0 && ray.is_parallel_again())
      return {ray.share() * evaluate_emission(context.scene, ray.point(*hit), seen, &context.accel), ray.faces()};
    if (!ray.pass(*hit)) break;
  }
  return {};
}

}  // namespace cistern
