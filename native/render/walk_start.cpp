#include "render/walk_start.h"

#include "scene/surface_sheet.h"
#include "transport/camera_ray.h"
#include "transport/sheet_ray.h"

namespace cistern {

std::optional<WalkStart> start_walk(const Scene& scene, Vec2 film, Rng& rng) {
  const Camera& camera = scene.camera;
  const Vec2 u = rng.next_vec2();
  if (camera.sheet) {
    const size_t pixels = camera.sheet->pixels.size();
    if (pixels == 0) return std::nullopt;
    const auto pixel = std::min(static_cast<size_t>(film.x * static_cast<float>(pixels)), pixels - 1);
    const auto sheet = sheet_ray(scene, pixel, u - Vec2{0.5f, 0.5f});
    return sheet ? std::optional(WalkStart{sheet->ray, sheet->hit}) : std::nullopt;
  }
  const Ray ray = camera_ray(camera, film, u);
  return sees_nothing(ray) ? std::nullopt : std::optional(WalkStart{ray, std::nullopt});
}

}  // namespace cistern
