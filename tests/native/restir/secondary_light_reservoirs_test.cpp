#include "restir/secondary_light_reservoirs.h"

#include <gtest/gtest.h>

#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

constexpr uint32_t kSide = 32;
constexpr float kSpacing = 0.05f;

GridLayout layout_from(Vec3 camera, uint32_t frame) {
  return make_grid_layout({.min_cell_size = 0.01f, .cell_pixels = 10.0f}, {camera, 0.02f, 0.0f}, 1, frame);
}

/// Points of a floor, side by side, that face up and down in turn, or all up; none has found a light.
VertexCells floor_cells(const GridLayout& layout, bool in_turn) {
  VertexCells cells;
  cells.layout = layout;
  cells.points.resize(kSide * kSide);
  cells.reservoirs.resize(kSide * kSide);
  std::vector<CellKey> keys;
  for (uint32_t i = 0; i < kSide * kSide; ++i) {
    const Vec3 n{0.0f, 0.0f, in_turn && i % 2 == 1 ? -1.0f : 1.0f};
    const Vec3 at{kSpacing * static_cast<float>(i % kSide), kSpacing * static_cast<float>(i / kSide), 0.0f};
    VisiblePoint point;
    point.receiver = {at, n, n, n, Rgb(0.5f), Rgb(), 1.0f, 0.0f};
    point.ng = point.ns = n;
    point.exists = true;
    cells.points[i] = point;
    cells.reservoirs[i] = {{}, 0.0f, 1.0f};
    Rng rng(4, i, 0, 0);
    keys.push_back(SecondaryLightReservoirs::jittered_key(layout, point, rng));
  }
  cells.grid.build(keys);
  return cells;
}

/// What a point took over from the cells it looked up, means over all points.
struct TakenOver {
  float confidence = 0.0f, reservoirs = 0.0f;
};

TakenOver taken_over(const SecondaryReuse& reuse, const VertexCells& cells, bool are_own) {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.diffuse(0.5f));
  const Tracer tracer(scene);
  const SecondaryLightReservoirs system(tracer.context(), reuse);
  TakenOver sum;
  uint64_t non_finite = 0;
  uint32_t others = 0;
  for (uint32_t i = 0; i < kSide * kSide; ++i) {
    Rng rng(5, i, 0, 0);
    const std::optional<uint32_t> self = are_own ? std::optional(i) : std::nullopt;
    sum.confidence += system.reuse(cells.points[i], {{}, 0.0f, 1.0f}, cells, self, rng, non_finite, others).c - 1.0f;
  }
  sum.reservoirs = static_cast<float>(others) / (kSide * kSide);
  sum.confidence /= kSide * kSide;
  return sum;
}

const Vec3 kBefore{0.8f, 0.8f, 1.0f};

TEST(SecondaryLightReservoirs, PreviousCellsAreLookedUpWithTheirOwnCamera) {
  VertexCells previous = floor_cells(layout_from(kBefore, 6), false);
  const float found = taken_over({}, previous, false).reservoirs;
  EXPECT_GT(found, 2.0f) << "most cells hold three entries or more";
  previous.layout = layout_from({0.8f, 0.8f, 2.5f}, 6);
  EXPECT_LT(taken_over({}, previous, false).reservoirs, 0.2f * found) << "planted: the present camera";
  previous.layout = layout_from(kBefore, 7);
  EXPECT_LT(taken_over({}, previous, false).reservoirs, 0.2f * found) << "planted: the present offset and rotation";
}

TEST(SecondaryLightReservoirs, HistoryCountsForNoMoreThanItsCap) {
  VertexCells previous = floor_cells(layout_from(kBefore, 6), false);
  for (uint32_t i = 0; i < kSide * kSide; ++i) previous.reservoirs[i].c = 1000.0f;
  SecondaryReuse reuse;
  const TakenOver capped = taken_over(reuse, previous, false);
  EXPECT_GT(capped.confidence, 0.5f * reuse.confidence_cap);
  EXPECT_LE(capped.confidence, 1.0001f * reuse.confidence_cap) << "of all that are merged, not of each";
  reuse.confidence_cap = 1e6f;
  EXPECT_GT(taken_over(reuse, previous, false).confidence, 1000.0f) << "planted: no cap";
}

TEST(SecondaryLightReservoirs, PointsTakeNeitherTheirOwnNorThoseThatFaceElsewhere) {
  const GridLayout layout = layout_from(kBefore, 6);
  SecondaryReuse reuse;
  reuse.max_count = kMaxCellCount;
  const float all = taken_over(reuse, floor_cells(layout, false), false).reservoirs;
  const float without_own = taken_over(reuse, floor_cells(layout, false), true).reservoirs;
  EXPECT_LT(without_own, all - 0.2f) << "a point meets its own where both its displacements lead to the same cell";
  EXPECT_GT(without_own, all - 1.0f);
  GridLayout blind = layout;  // so that the test of normals has to do it
  blind.use_normals = false;
  EXPECT_LT(taken_over(reuse, floor_cells(blind, true), false).reservoirs, 0.6f * all);
}

}  // namespace
}  // namespace cistern::test
