#include "restir/screen_space_paths.h"

#include "base/warp.h"

namespace cistern {
namespace {

/// [Ouyang 2021] §4.2: 25 degrees, 5 % of the depth.
constexpr Similarity kSimilarity{0.9063f, 1.05f};

enum Stream : uint32_t { TEMPORAL = 0x100, SPATIAL, DIRECTION, TILE };

constexpr uint32_t kTileWidth = 64, kTileHeight = 32;

/// How far a point may have moved, of the length of the ray that found it; and how much its light may have changed.
constexpr float kMovement = 1e-3f, kChange = 0.01f;

/// Of a direction that the sample kept.
bool has_same_light(const IncidentRadiance& kept, const IncidentRadiance& again) {
  if (is_black(kept.radiance)) return true;
  const Rgb before = kept.f_cos * kept.radiance, now = again.f_cos * again.radiance;
  return magnitude(now - before) <= kChange * std::max(magnitude(before), magnitude(now));
}

}  // namespace

bool still_holds(const PathSample& sample, const PathLink& again) {
  if (!(again.W > 0.0f)) return false;
  const float moved = length(again.to.point.receiver.position - sample.point.receiver.position);
  if (!(moved <= kMovement * sample.point.state.ray_length)) return false;
  return has_same_light(sample.light, again.to.light) && has_same_light(sample.continuation, again.to.continuation);
}

bool ScreenSpacePaths::goes_on(uint32_t full_frame_pixel, uint32_t frame) const {
  const auto width = static_cast<uint32_t>(image_.full_width), tiles_in_row = (width + kTileWidth - 1) / kTileWidth;
  const uint32_t column = full_frame_pixel % width / kTileWidth, row = full_frame_pixel / width / kTileHeight;
  return Rng(seed_, row * tiles_in_row + column, frame, TILE).next_float() < reuse_.multi_bounce_share;
}

std::optional<uint32_t> ScreenSpacePaths::previous_pixel(const VisiblePoint& visible, const PathFrame& previous,
                                                         uint32_t pixel) const {
  if (previous.visible_points.empty()) return std::nullopt;
  const auto before = reproject(previous.view, image_, context_.scene.camera, visible, pixel);
  if (!before) return std::nullopt;
  const VisiblePoint& there = previous.visible_points[before->pixel];
  if (!is_at(previous.view, *before, there, kSimilarity) || !has_same_bounces(visible, there)) return std::nullopt;
  return before->pixel;
}

PathReservoir ScreenSpacePaths::keep_one_direction(const VisiblePoint& visible, const PathReservoir& found,
                                                   uint32_t pixel, uint32_t frame) const {
  Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, DIRECTION);
  return cistern::keep_one_direction(visible, found, reuse_.rules, rng);
}

PathReservoir ScreenSpacePaths::reuse_in_time(const VisiblePoint& visible, const PathReservoir& initial,
                                              const PathFrame& previous, uint32_t pixel, uint32_t frame,
                                              uint64_t& non_finite, uint32_t& others) const {
  if (!reuse_.temporal_reuse) return initial;
  const std::optional<uint32_t> before = previous_pixel(visible, previous, pixel);
  if (!before) return initial;
  // Unbiased weights owe a fresh sample all its light where the earlier point does not see it: in coarse pixels, whose
  // points differ, beside gaps that light comes through, its one path then rules the pixel for as long as history
  // lasts.
  PathCandidates candidates;
  candidates.add(visible, initial, 1.0f);
  candidates.add(previous.visible_points[*before], previous.temporal[*before], reuse_.temporal_cap);
  ++others;
  Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, TEMPORAL);
  return copy_of(candidates.merge(context_, reuse_.rules, rng, non_finite));
}

PathReservoir ScreenSpacePaths::reuse_in_space(const PathFrame& current, const PathFrame& previous, uint32_t pixel,
                                               uint32_t frame, uint64_t& non_finite, uint32_t& others) const {
  const VisiblePoint& visible = current.visible_points[pixel];
  if (!reuse_.spatial_reuse) return current.temporal[pixel];
  Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, SPATIAL);
  PathCandidates candidates;
  candidates.add(visible, current.temporal[pixel], INFINITY);  // the receiver, able to make all that it needs
  float history = 0.0f;
  if (reuse_.temporal_reuse) {
    const std::optional<uint32_t> before = previous_pixel(visible, previous, pixel);
    if (before) {
      const PathReservoir& spatial = previous.spatial[*before];  // Alg. 4 l.2
      candidates.add(previous.visible_points[*before], spatial, reuse_.spatial_cap);
      history = spatial.c;
    }
  }
  const bool is_starved = history < 0.5f * reuse_.spatial_cap;
  const int neighbours = is_starved ? reuse_.starved_neighbours : reuse_.neighbours;
  float radius = reuse_.largest_radius * static_cast<float>(std::max(image_.full_width, image_.full_height));
  for (int i = 0; i < neighbours && !candidates.is_full(); ++i) {
    const auto other = displaced_pixel(image_, pixel, square_to_disk(rng.next_vec2()) * radius);  // Alg. 4 l.5-9
    if (other && is_reusable(visible, current.visible_points[*other], kSimilarity)) {
      candidates.add(current.visible_points[*other], current.temporal[*other], INFINITY);
    } else {
      radius = std::max(0.5f * radius, reuse_.smallest_radius);  // §4.4: nearer after a miss
    }
  }
  if (candidates.count() == 1) return current.temporal[pixel];
  others += static_cast<uint32_t>(candidates.count()) - 1;
  return copy_of(candidates.merge(context_, reuse_.rules, rng, non_finite));  // Alg. 4 l.10-20
}

Rgb ScreenSpacePaths::shade(const VisiblePoint& visible, const PathReservoir& reservoir) const {
  if (!(reservoir.W > 0.0f)) return {};
  return reflected_path(context_, visible, reservoir.sample, reuse_.rules.reflection) * reservoir.W;
}

}  // namespace cistern
