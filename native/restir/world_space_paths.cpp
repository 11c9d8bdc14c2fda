#include "restir/world_space_paths.h"

#include "grid/stride_selection.h"

namespace cistern {
namespace {

/// The history of a pixel: 25 degrees, 5 % of the depth, as in [Ouyang 2021].
constexpr Similarity kHistorySimilarity{0.9063f, 1.05f};
/// [Zhang and Wang 2023] §4.3: 15 degrees.
constexpr float kSmallestNormalCosine = 0.9659f;

enum Stream : uint32_t { TEMPORAL = 0x200, CELLS, INSERTION, DIRECTION = INSERTION + 2 };

}  // namespace

PathReservoir WorldSpacePaths::keep_one_direction(const VisiblePoint& point, const PathReservoir& found, uint32_t pixel,
                                                  uint32_t frame, bool is_deep) const {
  Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, is_deep ? DIRECTION + 1 : DIRECTION);
  return cistern::keep_one_direction(point, found, reuse_.rules, rng);
}

PathReservoir WorldSpacePaths::reuse_in_time(const VisiblePoint& visible, const PathReservoir& initial,
                                             const PathCells& previous, uint32_t pixel, uint32_t frame,
                                             uint64_t& non_finite, uint32_t& others) const {
  if (!reuse_.temporal_reuse || previous.visible_points.empty()) return initial;
  const auto before = reproject(previous.view, image_, context_.scene.camera, visible, pixel);
  if (!before) return initial;
  const VisiblePoint& there = previous.visible_points[before->pixel];
  if (!is_at(previous.view, *before, there, kHistorySimilarity) || !has_same_bounces(visible, there)) return initial;
  PathCandidates candidates;
  candidates.add(visible, initial, 1.0f);
  candidates.add(there, previous.reservoirs[2 * size_t{before->pixel}], reuse_.temporal_cap);
  ++others;
  Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, TEMPORAL);
  return copy_of(candidates.merge(context_, reuse_.rules, rng, non_finite));
}

CellKey WorldSpacePaths::key(const GridLayout& layout, const VisiblePoint& point, uint32_t pixel, uint32_t frame,
                             bool is_deep) const {
  if (!point.exists) return kNoCell;
  Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, is_deep ? INSERTION + 1 : INSERTION);
  const Vec3 n = point.receiver.n;
  return cell_key(layout, jitter_in_tangent_plane(layout, point.receiver.position, n, rng.next_vec2()), n);
}

PathReference WorldSpacePaths::reuse_in_cells(const VisiblePoint& visible, const PathReservoir& temporal,
                                              const PathCells& previous, uint32_t pixel, uint32_t frame,
                                              uint64_t& non_finite, uint32_t& others) const {
  const PathReference own{&temporal.sample, temporal.W, temporal.c};
  if (!reuse_.spatial_reuse || previous.visible_points.empty()) return own;
  Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, CELLS);
  const Vec3 n = visible.receiver.n;
  // Alg. 2 l.3-12
  const Vec3 place = jitter_in_tangent_plane(previous.layout, visible.receiver.position, n, rng.next_vec2());
  const std::span<const uint32_t> cell = previous.cells.find(cell_key(previous.layout, place, n));
  const auto drawn =
      select_by_stride(static_cast<uint32_t>(cell.size()), static_cast<uint32_t>(reuse_.max_count), rng.next_double());
  PathCandidates candidates;
  candidates.add(visible, temporal, INFINITY);  // Alg. 2 l.2
  for (uint32_t i = 0; i < drawn.count && !candidates.is_full(); ++i) {
    const size_t entry = cell[drawn[i]];
    const VisiblePoint& other = previous.point(entry);
    // Deep entries found as much as their visible point would have.
    if (!has_same_bounces(visible, previous.visible_points[entry / 2])) continue;
    if (dot(other.receiver.n, n) < kSmallestNormalCosine) continue;  // Alg. 2 l.14-16
    candidates.add(other, previous.reservoirs[entry], reuse_.temporal_cap);
  }
  if (candidates.count() == 1) return own;
  others += static_cast<uint32_t>(candidates.count()) - 1;
  return candidates.merge(context_, reuse_.rules, rng, non_finite);  // Alg. 2 l.17-23
}

Rgb WorldSpacePaths::shade(const VisiblePoint& visible, const PathReference& reservoir) const {
  if (!(reservoir.W > 0.0f)) return {};
  return reflected_path(context_, visible, *reservoir.sample, reuse_.rules.reflection) * reservoir.W;
}

}  // namespace cistern
