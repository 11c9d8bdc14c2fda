#include "restir/pixel_reuse.h"

#include <array>

#include "transport/camera_ray.h"

namespace cistern {
namespace {

bool is_similar(Vec3 n, float distance, const VisiblePoint& other, const Similarity& limits) {
  if (dot(n, other.receiver.n) < limits.normal_cosine) return false;
  return std::max(distance, other.distance) <= limits.distance_ratio * std::min(distance, other.distance);
}

/// Of the full frame, in [0, 1]^2: the middle of a pixel.
Vec2 film_position(const ImageRegion& region, uint32_t pixel) {
  const auto width = static_cast<uint32_t>(region.width);
  const uint32_t column = pixel % width, row = pixel / width;
  return {(static_cast<float>(region.x) + static_cast<float>(column) + 0.5f) / static_cast<float>(region.full_width),
          (static_cast<float>(region.y) + static_cast<float>(row) + 0.5f) / static_cast<float>(region.full_height)};
}

std::optional<uint32_t> pixel_at(const ImageRegion& region, Vec2 film) {
  const float column = film.x * static_cast<float>(region.full_width) - static_cast<float>(region.x);
  const float row = film.y * static_cast<float>(region.full_height) - static_cast<float>(region.y);
  const bool is_inside = column >= 0.0f && row >= 0.0f && column < static_cast<float>(region.width) &&
                         row < static_cast<float>(region.height);
  if (!is_inside) return std::nullopt;
  return static_cast<uint32_t>(row) * static_cast<uint32_t>(region.width) + static_cast<uint32_t>(column);
}

float eye_distance(const Camera& camera, Vec3 position) {
  if (camera.type == CameraType::ORTHOGRAPHIC) return camera_depth(camera, position);
  return length(position - camera.camera_to_world.translation);
}

struct SurfacePlace {
  uint32_t instance;
  Vec3 position, n;
};

/// Where the surface point was; empty where its instance was not there.
std::optional<SurfacePlace> earlier_surface(const EarlierView& view, const VisiblePoint& visible) {
  const SurfacePlace now{visible.instance, visible.receiver.position, visible.receiver.n};
  if (!view.change || view.change->earlier_instances.empty()) return now;
  const uint32_t instance = view.change->earlier_instances[visible.instance];
  if (instance == SceneChange::kNone) return std::nullopt;
  const Transform& to_earlier = view.change->to_earlier[visible.instance];
  if (to_earlier == Transform{}) return SurfacePlace{instance, now.position, now.n};
  return SurfacePlace{instance, to_earlier.point(now.position),
                      normalize_or(inverse(to_earlier).transposed_vector(now.n), now.n)};
}

}  // namespace

Rng pixel_random_numbers(const ImageRegion& region, uint64_t seed, uint32_t pixel, uint32_t frame, uint32_t stream) {
  const auto width = static_cast<uint32_t>(region.width);
  const uint32_t x = static_cast<uint32_t>(region.x) + pixel % width;
  const uint32_t y = static_cast<uint32_t>(region.y) + pixel / width;
  return Rng(seed, y * static_cast<uint32_t>(region.full_width) + x, frame, stream);
}

std::optional<uint32_t> displaced_pixel(const ImageRegion& region, uint32_t pixel, Vec2 offset) {
  const auto width = static_cast<uint32_t>(region.width);
  const int x = static_cast<int>(pixel % width) + static_cast<int>(std::lround(offset.x));
  const int y = static_cast<int>(pixel / width) + static_cast<int>(std::lround(offset.y));
  if (x < 0 || y < 0 || x >= region.width || y >= region.height) return std::nullopt;
  const uint32_t other = static_cast<uint32_t>(y) * width + static_cast<uint32_t>(x);
  return other == pixel ? std::nullopt : std::optional(other);
}

std::optional<EarlierPlace> reproject(const EarlierView& view, const ImageRegion& region, const Camera& camera,
                                      const VisiblePoint& visible, uint32_t pixel) {
  std::optional<SurfacePlace> place = earlier_surface(view, visible);
  if (!place) return std::nullopt;
  std::optional<Vec2> film;
  float distance = visible.distance;
  if (visible.state.depth > 0) {
    film = film_position(region, pixel);
  } else {
    film = project(view.camera, place->position);
    // Of what lies between, nothing but the straight way to the eye has changed.
    distance += eye_distance(view.camera, place->position) - eye_distance(camera, visible.receiver.position);
  }
  const std::optional<uint32_t> before = film ? pixel_at(view.image, *film) : std::nullopt;
  if (!before) return std::nullopt;
  return EarlierPlace{*before, place->instance, place->n, distance};
}

bool is_at(const EarlierView& view, const EarlierPlace& place, const VisiblePoint& earlier, const Similarity& limits) {
  if (!earlier.exists || (view.change && earlier.instance != place.instance)) return false;
  return is_similar(place.n, place.distance, earlier, limits);
}

bool has_same_bounces(const VisiblePoint& a, const VisiblePoint& b) {
  const auto bounces = [](const PathState& s) {
    return std::array{s.depth,       s.diffuse_depth, s.glossy_depth, s.transmission_depth, s.transparent_depth,
                      s.portal_depth};
  };
  return bounces(a.state) == bounces(b.state);
}

bool is_reusable(const VisiblePoint& a, const VisiblePoint& b, const Similarity& limits) {
  return a.exists && b.exists && has_same_bounces(a, b) && is_similar(a, b, limits);
}

bool is_similar(const VisiblePoint& a, const VisiblePoint& b, const Similarity& limits) {
  return is_similar(a.receiver.n, a.distance, b, limits);
}

}  // namespace cistern
