#include "subdivision/longest_edge.h"

#include <algorithm>
#include <array>
#include <span>

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

/// What lengths are multiplied by, more the further all points, in camera space, are beyond the same side of the
/// picture.
float beyond_view(const DicingView& view, std::span<const Vec3> points) {
  const Camera& c = view.camera;
  if (c.type != CameraType::PERSPECTIVE && c.type != CameraType::ORTHOGRAPHIC) return 1.0f;
  const auto beyond = [&](Vec3 outwards, float side) {
    float least = INFINITY;
    for (const Vec3& p : points) {
      if (c.type == CameraType::ORTHOGRAPHIC) {
        const float extent = outwards.x != 0.0f ? c.right - c.left : c.top - c.bottom;
        least = std::min(least, (dot(p, outwards) - side) / extent);
      } else {
        const Vec3 plane = normalize(outwards + Vec3{0.0f, 0.0f, side});  // through the eye and that side
        least = std::min(least, dot(normalize_or(p, {}), plane));
      }
    }
    return least;
  };
  const float most = std::max({beyond({1.0f, 0.0f, 0.0f}, c.right), beyond({-1.0f, 0.0f, 0.0f}, -c.left),
                               beyond({0.0f, 1.0f, 0.0f}, c.top), beyond({0.0f, -1.0f, 0.0f}, -c.bottom)});
  return lerp(1.0f, view.offscreen_scale, std::clamp(most / kFarBeyond, 0.0f, 1.0f));
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
  const std::array<Vec3, 2> seen{world_to_camera_.point(from), world_to_camera_.point(to)};
  return length(to - from) > pixels_ * pixel_size(seen[0], seen[1]) * beyond_view(view_, seen);
}

/// Where the edge is nearest, in camera space.
float LongestEdge::pixel_size(Vec3 a, Vec3 b) const {
  return pixel_.size + pixel_.angle * std::max(least_distance(a, b), view_.camera.clip_start);
}

float seen_size(const DicingView& view, const Bounds3& bounds, const Transform& object_to_world) {
  Bounds3 placed;
  std::array<Vec3, 8> corners;
  const Transform world_to_camera = inverse(view.camera.camera_to_world);
  for (size_t i = 0; i < corners.size(); ++i) {
    const Vec3 corner = object_to_world.point({(i & 1) != 0 ? bounds.upper.x : bounds.lower.x,
                                               (i & 2) != 0 ? bounds.upper.y : bounds.lower.y,
                                               (i & 4) != 0 ? bounds.upper.z : bounds.lower.z});
    placed.extend(corner);
    corners[i] = world_to_camera.point(corner);
  }
  const Vec3 eye = view.camera.camera_to_world.translation;
  const Vec3 nearest{std::clamp(eye.x, placed.lower.x, placed.upper.x),
                     std::clamp(eye.y, placed.lower.y, placed.upper.y),
                     std::clamp(eye.z, placed.lower.z, placed.upper.z)};
  const PixelFootprint pixel = pixel_footprint(view.camera, view.width, view.height);
  const float distance = std::max(length(nearest - eye), std::max(view.camera.clip_start, 1e-6f));
  const float scale = std::max(
      {length(object_to_world.column(0)), length(object_to_world.column(1)), length(object_to_world.column(2))});
  return scale / ((pixel.size + pixel.angle * distance) * beyond_view(view, corners));
}

}  // namespace cistern
