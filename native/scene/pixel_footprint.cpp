#include "scene/pixel_footprint.h"

#include "scene/panorama.h"
#include "scene/surface_sheet.h"

namespace cistern {

PixelFootprint pixel_footprint(const Camera& camera, int width, int height) {
  if (camera.type == CameraType::SHEET) return {camera.sheet->pixel_size, 0.0f};
  const Vec2 sides{(camera.right - camera.left) / static_cast<float>(width),
                   (camera.top - camera.bottom) / static_cast<float>(height)};
  if (camera.type == CameraType::PANORAMIC) return {0.0f, panorama_pixel_angle(camera.panorama, sides)};
  const float pixel = 0.5f * (sides.x + sides.y);
  if (camera.type == CameraType::ORTHOGRAPHIC) return {pixel, 0.0f};
  return {0.0f, pixel};
}

}  // namespace cistern
