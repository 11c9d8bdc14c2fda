#include "subdivision/longest_edge.h"

#include <algorithm>

namespace cistern {
namespace {

constexpr float kFarBeyond = 0.25f;  // sine of an angle; of an orthographic picture, widths of it

/// Of the segment, to the origin.
float least_distance(Vec3 a, Vec3 b) {
  const Vec3 along = b - a;
  const float squared = length_squared(along);
  const float t = squared > 0.0f ? std::clamp(-dot(a, along) / squared, 0.0f, 1.0f) : 0.0f;
  return length(a + t * along);
}

}  // namespace

LongestEdge::LongestEdge(const DicingView& view, const SubdivisionCage& cage, const Transform& object_to_world,
                         float coarsening)
    : view_(view),
      object_to_world_(object_to_world),
      world_to_camera_(inverse(view.camera.camera_to_world)),
      pixel_(pixel_footprint(view.camera, view.width, view.height)),
      pixels_(coarsening * view.rate * cage.pixels),
      length_(coarsening * view.rate * cage.length) {}

bool LongestEdge::is_exceeded(Vec3 a, Vec3 b) const {
  if (length_ > 0.0f) return length(b - a) > length_;
  const Vec3 from = object_to_world_.point(a), to = object_to_world_.point(b);
  const Vec3 seen_from = world_to_camera_.point(from), seen_to = world_to_camera_.point(to);
  return length(to - from) > pixels_ * pixel_size(seen_from, seen_to) * beyond_view(seen_from, seen_to);
}

/// Where the edge is nearest, in camera space.
float LongestEdge::pixel_size(Vec3 a, Vec3 b) const {
  return pixel_.size + pixel_.angle * std::max(least_distance(a, b), view_.camera.clip_start);
}

/// What lengths are multiplied by, more the further both ends are beyond the same side of the picture.
float LongestEdge::beyond_view(Vec3 a, Vec3 b) const {
  const Camera& c = view_.camera;
  if (c.type != CameraType::PERSPECTIVE && c.type != CameraType::ORTHOGRAPHIC) return 1.0f;
  const auto beyond = [&](Vec3 outwards, float side) {
    if (c.type == CameraType::ORTHOGRAPHIC) {
      const float extent = outwards.x != 0.0f ? c.right - c.left : c.top - c.bottom;
      return (std::min(dot(a, outwards), dot(b, outwards)) - side) / extent;
    }
    const Vec3 plane = normalize(outwards + Vec3{0.0f, 0.0f, side});  // through the eye and that side
    return std::min(dot(normalize_or(a, {}), plane), dot(normalize_or(b, {}), plane));
  };
  const float most = std::max({beyond({1.0f, 0.0f, 0.0f}, c.right), beyond({-1.0f, 0.0f, 0.0f}, -c.left),
                               beyond({0.0f, 1.0f, 0.0f}, c.top), beyond({0.0f, -1.0f, 0.0f}, -c.bottom)});
  return lerp(1.0f, view_.offscreen_scale, std::clamp(most / kFarBeyond, 0.0f, 1.0f));
}

float seen_size(const DicingView& view, const Bounds3& bounds, const Transform& object_to_world) {
  Bounds3 placed;
  for (int corner = 0; corner < 8; ++corner)
    placed.extend(object_to_world.point({(corner & 1) != 0 ? bounds.upper.x : bounds.lower.x,
                                         (corner & 2) != 0 ? bounds.upper.y : bounds.lower.y,
                                         (corner & 4) != 0 ? bounds.upper.z : bounds.lower.z}));
  const Vec3 eye = view.camera.camera_to_world.translation;
  const Vec3 nearest{std::clamp(eye.x, placed.lower.x, placed.upper.x),
                     std::clamp(eye.y, placed.lower.y, placed.upper.y),
                     std::clamp(eye.z, placed.lower.z, placed.upper.z)};
  const PixelFootprint pixel = pixel_footprint(view.camera, view.width, view.height);
  const float distance = std::max(length(nearest - eye), std::max(view.camera.clip_start, 1e-6f));
  const float scale = std::max(
      {length(object_to_world.column(0)), length(object_to_world.column(1)), length(object_to_world.column(2))});
  return scale / (pixel.size + pixel.angle * distance);
}

}  // namespace cistern
