#include "restir/pixel_reuse.h"

#include <array>

#include "transport/camera_ray.h"

namespace cistern {

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

std::optional<uint32_t> reproject(const ImageRegion& region, const Camera& camera, const VisiblePoint& visible,
                                  uint32_t pixel) {
  if (visible.state.depth > 0) return pixel;
  const std::optional<Vec2> film = project(camera, visible.receiver.position);
  if (!film) return std::nullopt;
  const float column = film->x * static_cast<float>(region.full_width) - static_cast<float>(region.x);
  const float row = film->y * static_cast<float>(region.full_height) - static_cast<float>(region.y);
  const bool is_inside = column >= 0.0f && row >= 0.0f && column < static_cast<float>(region.width) &&
                         row < static_cast<float>(region.height);
  if (!is_inside) return std::nullopt;
  return static_cast<uint32_t>(row) * static_cast<uint32_t>(region.width) + static_cast<uint32_t>(column);
}

bool has_same_bounces(const VisiblePoint& a, const VisiblePoint& b) {
  const auto bounces = [](const PathState& s) {
    return std::array{s.depth, s.diffuse_depth, s.glossy_depth, s.transmission_depth, s.transparent_depth};
  };
  return bounces(a.state) == bounces(b.state);
}

bool is_reusable(const VisiblePoint& a, const VisiblePoint& b, const Similarity& limits) {
  return a.exists && b.exists && has_same_bounces(a, b) && is_similar(a, b, limits);
}

bool is_similar(const VisiblePoint& a, const VisiblePoint& b, const Similarity& limits) {
  if (dot(a.receiver.n, b.receiver.n) < limits.normal_cosine) return false;
  return std::max(a.distance, b.distance) <= limits.distance_ratio * std::min(a.distance, b.distance);
}

}  // namespace cistern
