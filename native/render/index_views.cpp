#include "render/index_views.h"

#include "shading/displaced_normal.h"
#include "shading/material.h"
#include "transport/camera_ray.h"
#include "transport/ray_portal.h"

namespace cistern {
namespace {

constexpr float kMostTransparency = 0.5f;

Ray centre_ray(const FrameContext& context, int x, int y) {
  const Settings& s = context.settings;
  const Camera& camera = context.paths.scene.camera;
  const Vec2 centre{(static_cast<float>(s.region.x + x) + 0.5f) / static_cast<float>(s.width),
                    (static_cast<float>(s.region.y + y) + 0.5f) / static_cast<float>(s.height)};
  PathSampler sampler(s.seed, full_frame_pixel(s, x, y), 0, s.sequence);
  return camera_ray(camera, centre, camera.aperture_radius > 0.0f ? sampler.lens() : Vec2{});
}

std::optional<SurfacePoint> first_opaque(const PathContext& paths, Ray ray) {
  PathState state;
  for (; state.transparent_depth <= paths.limits.max_transparent_bounces; ++state.transparent_depth) {
    const std::optional<Hit> hit = paths.accel.intersect_surface(ray, state.ray_kind);
    if (!hit) return std::nullopt;
    state.ray_length += hit->t;
    SurfacePoint point = make_surface_point(paths.scene, ray, *hit);
    set_footprint(point, paths.pixel.size + paths.pixel.angle * state.ray_length, paths.scene, state);
    const Bsdf bsdf = evaluate_material(paths.scene, point, state, &paths.accel);
    const bool is_held_out = paths.scene.instances[hit->instance].is_holdout;
    if (bsdf.holdout >= 1.0f || (is_held_out && is_black(bsdf.transparency))) return std::nullopt;
    if (!is_held_out && average(bsdf.transparency) <= kMostTransparency) return point;
    ray = ray_behind(ray, hit->t, point, bsdf, state);
  }
  return std::nullopt;
}

}  // namespace

bool show_indices(const FrameContext& context, Film& film, const StopCondition& stop) {
  if (!film.has(Pass::OBJECT_INDEX) && !film.has(Pass::MATERIAL_INDEX)) return true;
  const Scene& scene = context.paths.scene;
  const auto show = [&](int x, int y, int) {
    const std::optional<SurfacePoint> seen = first_opaque(context.paths, centre_ray(context, x, y));
    if (!seen) return;
    const auto pixel = static_cast<uint32_t>(y * film.width() + x);
    const auto object = static_cast<size_t>(scene.instances[seen->instance].object);
    film.show(Pass::OBJECT_INDEX, pixel, Rgb(scene.object_labels[object].pass_index));
    if (seen->material < 0) return;
    film.show(Pass::MATERIAL_INDEX, pixel, Rgb(scene.materials[static_cast<size_t>(seen->material)]->pass_index));
  };
  return for_each_pixel<int>(film.width(), film.height(), stop, show, [](int) {});
}

}  // namespace cistern
