#include "restir/pixel_reuse.h"

#include <gtest/gtest.h>

#include "transport/camera_ray.h"

namespace cistern::test {
namespace {

constexpr ImageRegion kImage{0, 0, 64, 48, 64, 48};

/// Looks along +y from `eye`.
Camera camera_at(Vec3 eye) {
  Camera camera;
  camera.camera_to_world = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, eye};
  return camera;
}

/// The point of the plane y = 4 that a camera sees in the middle of a pixel.
VisiblePoint seen(const Camera& camera, const ImageRegion& image, uint32_t pixel) {
  const auto width = static_cast<uint32_t>(image.width);
  const Vec2 film{
      (static_cast<float>(image.x) + static_cast<float>(pixel % width) + 0.5f) / static_cast<float>(image.full_width),
      (static_cast<float>(image.y) + static_cast<float>(pixel / width) + 0.5f) / static_cast<float>(image.full_height)};
  const Ray ray = camera_ray(camera, film, {});
  VisiblePoint visible;
  visible.distance = (4.0f - ray.origin.y) / ray.direction.y;
  visible.receiver.position = ray.origin + ray.direction * visible.distance;
  visible.receiver.n = {0, -1, 0};
  visible.exists = true;
  return visible;
}

TEST(Reproject, FindsThePixelThatShowedThePoint) {
  const Camera before = camera_at({0, 0, 0}), now = camera_at({0.5f, 0.75f, -0.25f});
  int moved = 0;
  for (uint32_t pixel = 0; pixel < 64 * 48; pixel += 5) {
    const VisiblePoint then = seen(before, kImage, pixel);
    VisiblePoint visible = then;
    visible.distance = length(visible.receiver.position - now.camera_to_world.translation);
    const auto place = reproject({before, kImage}, kImage, now, visible, 0);
    ASSERT_TRUE(place);
    EXPECT_EQ(place->pixel, pixel);
    EXPECT_NEAR(place->distance, then.distance, 1e-4f);
    EXPECT_TRUE(is_at({before, kImage}, *place, then, {0.99f, 1.01f}));
    // Planted bug: the present camera in place of the previous one.
    const auto wrong = reproject({now, kImage}, kImage, now, visible, 0);
    moved += !wrong || wrong->pixel != pixel;
  }
  EXPECT_GT(moved, 600);
}

TEST(Reproject, GoesFromOneResolutionAndRegionToAnother) {
  const Camera camera = camera_at({0, 0, 0});
  const ImageRegion coarse{0, 0, 16, 12, 16, 12}, part{10, 20, 30, 10, 64, 48};
  const VisiblePoint visible = seen(camera, kImage, 13 * 64 + 41);
  EXPECT_EQ(reproject({camera, coarse}, kImage, camera, visible, 13 * 64 + 41)->pixel, 3u * 16 + 10);
  EXPECT_FALSE(reproject({camera, part}, kImage, camera, visible, 13 * 64 + 41)) << "outside of the part";
  const VisiblePoint inside = seen(camera, kImage, 25 * 64 + 12);
  EXPECT_EQ(reproject({camera, part}, kImage, camera, inside, 0)->pixel, 5u * 30 + 2);
}

TEST(Reproject, WhatAMirrorShowsIsLookedForInTheSamePlace) {
  const Camera before = camera_at({0, 0, 0}), now = camera_at({1, 0, 0});
  const ImageRegion coarse{0, 0, 16, 12, 16, 12};
  VisiblePoint visible = seen(now, kImage, 17 * 64 + 30);
  visible.state.depth = 1;
  EXPECT_EQ(reproject({before, kImage}, kImage, now, visible, 17 * 64 + 30)->pixel, 17u * 64 + 30);
  EXPECT_EQ(reproject({before, coarse}, kImage, now, visible, 17 * 64 + 30)->pixel, 4u * 16 + 7);
}

TEST(Reproject, PointsMoveWithTheirInstance) {
  const Camera camera = camera_at({0, 0, 0});
  VisiblePoint visible = seen(camera, kImage, 24 * 64 + 40);
  visible.instance = 1;
  SceneChange change;
  change.surfaces = true;
  change.earlier_instances = {SceneChange::kNone, 5};
  change.to_earlier.resize(2);
  change.to_earlier[1].translation = {-1.0f, 0.0f, 0.5f};
  const EarlierView view{camera, kImage, &change};
  const auto place = reproject(view, kImage, camera, visible, 0);
  ASSERT_TRUE(place);
  EXPECT_EQ(place->instance, 5u);
  VisiblePoint then = visible;
  then.receiver.position += Vec3{-1.0f, 0.0f, 0.5f};
  then.instance = 5;
  then.distance = length(then.receiver.position);
  EXPECT_EQ(place->pixel, reproject({camera, kImage}, kImage, camera, then, 0)->pixel);
  EXPECT_TRUE(is_at(view, *place, then, {0.99f, 1.01f}));
  then.instance = 4;
  EXPECT_FALSE(is_at(view, *place, then, {0.99f, 1.01f})) << "another thing was there";
  visible.instance = 0;
  EXPECT_FALSE(reproject(view, kImage, camera, visible, 0)) << "what was not there has no history";
}

TEST(Reproject, NormalsTurnWithTheirInstance) {
  const Camera camera = camera_at({0, 0, 0});
  VisiblePoint visible = seen(camera, kImage, 24 * 64 + 32);
  SceneChange change;
  change.surfaces = true;
  change.earlier_instances = {0};
  change.to_earlier = {Transform{{2, 0, 0}, {0, 0, -3}, {0, 1, 0}, {0, 4, -4}}};  // a quarter turn, and uneven scales
  const auto place = reproject({camera, kImage, &change}, kImage, camera, visible, 0);
  ASSERT_TRUE(place);
  EXPECT_NEAR(length(place->n - Vec3{0, 0, -1}), 0.0f, 1e-6f);
}

}  // namespace
}  // namespace cistern::test
