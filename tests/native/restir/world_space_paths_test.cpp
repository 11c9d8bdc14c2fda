#include "restir/world_space_paths.h"

#include <gtest/gtest.h>

#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

constexpr int kSide = 32;
constexpr float kSpacing = 0.05f;
constexpr ImageRegion kImage{0, 0, kSide, kSide, kSide, kSide};

/// A point of a floor for each pixel.
std::vector<VisiblePoint> floor_points() {
  std::vector<VisiblePoint> points(kSide * kSide);
  for (uint32_t pixel = 0; pixel < kSide * kSide; ++pixel) {
    VisiblePoint& point = points[pixel];
    const Vec3 up{0.0f, 0.0f, 1.0f};
    const Vec3 at{kSpacing * static_cast<float>(pixel % kSide), kSpacing * static_cast<float>(pixel / kSide), 0.0f};
    point.receiver = {at, up, up, up, Rgb(0.5f), Rgb(), 1.0f, 0.0f};
    point.ng = point.ns = up;
    point.exists = true;
  }
  return points;
}

/// Their cells; all found nothing.
PathCells cells_of(std::span<const VisiblePoint> points, const WorldSpacePaths& paths, const GridLayout& layout,
                   uint32_t frame) {
  PathCells cells;
  cells.layout = layout;
  cells.visible_points = points;
  cells.deep_points.resize(points.size(), VisiblePoint{});
  cells.reservoirs.resize(2 * points.size(), {{}, 0.0f, 1.0f});
  std::vector<CellKey> keys;
  for (uint32_t pixel = 0; pixel < kSide * kSide; ++pixel)
    keys.insert(keys.end(), {paths.key(layout, points[pixel], pixel, frame, false), kNoCell});
  cells.cells.build(keys);
  return cells;
}

/// Confidence taken over from the previous frame's cells, mean over the pixels.
float taken_over(const WorldSpacePaths& paths, const PathCells& previous, uint32_t frame) {
  float sum = 0.0f;
  uint64_t non_finite = 0;
  uint32_t others = 0;
  for (uint32_t pixel = 0; pixel < kSide * kSide; ++pixel) {
    const VisiblePoint& visible = previous.visible_points[pixel];
    sum += paths.reuse_in_cells(visible, {{}, 0.0f, 1.0f}, previous, pixel, frame, non_finite, others).c - 1.0f;
  }
  return sum / (kSide * kSide);
}

GridLayout layout_from(Vec3 camera, uint32_t frame) {
  return make_grid_layout({.min_cell_size = 0.01f, .cell_pixels = 10.0f}, {camera, 0.02f, 0.0f}, 1, frame);
}

TEST(WorldSpacePaths, PreviousCellsAreLookedUpWithTheirOwnCamera) {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.diffuse(0.5f));
  const Tracer tracer(scene);
  const WorldSpacePaths paths(tracer.context(), {}, kImage, 1);
  const Vec3 before{0.8f, 0.8f, 1.0f}, now{0.8f, 0.8f, 2.5f};
  const std::vector<VisiblePoint> points = floor_points();
  PathCells previous = cells_of(points, paths, layout_from(before, 6), 6);
  const float found = taken_over(paths, previous, 7);
  EXPECT_GT(found, 2.0f) << "most cells hold three entries or more";
  previous.layout = layout_from(now, 6);
  EXPECT_LT(taken_over(paths, previous, 7), 0.2f * found) << "planted: the present camera in the previous grid";
  previous.layout = layout_from(before, 7);
  EXPECT_LT(taken_over(paths, previous, 7), 0.2f * found) << "planted: the present offset and rotation";
}

}  // namespace
}  // namespace cistern::test
