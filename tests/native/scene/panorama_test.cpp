#include "scene/panorama.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "transport/camera_ray.h"

namespace cistern::test {
namespace {

Panorama panorama(PanoramaType type) {
  Panorama p;
  p.type = type;
  p.longitude = {-2.0f, 1.0f};
  p.latitude = {-1.2f, 0.7f};
  p.cylinder = {-0.5f, 1.5f};
  p.fov = 2.5f;
  p.polynomial = {0.0f, -0.06f, 0.0004f};
  return p;
}

const std::vector<PanoramaType> kTypes{PanoramaType::EQUIRECTANGULAR,    PanoramaType::CUBEMAP_FACE,
                                       PanoramaType::MIRROR_BALL,        PanoramaType::FISHEYE_EQUIDISTANT,
                                       PanoramaType::FISHEYE_EQUISOLID,  PanoramaType::FISHEYE_POLYNOMIAL,
                                       PanoramaType::CENTRAL_CYLINDRICAL};

TEST(Panorama, PositionsAndDirectionsAreInverse) {
  for (const PanoramaType type : kTypes) {
    const Panorama p = panorama(type);
    Rng rng(1, 0, 0, 0);
    int seen = 0;
    for (int i = 0; i < 1000; ++i) {
      const Vec2 film = rng.next_vec2();
      const std::optional<Vec3> direction = panorama_direction(p, film);
      if (!direction) continue;
      EXPECT_NEAR(length(*direction), 1.0f, 1e-5f);
      const std::optional<Vec2> back = panorama_position(p, *direction);
      const float slack = 1e-3f;
      ASSERT_TRUE(back) << static_cast<int>(type);
      ++seen;
      EXPECT_NEAR(back->x, film.x, slack) << static_cast<int>(type);
      EXPECT_NEAR(back->y, film.y, slack) << static_cast<int>(type);
    }
    EXPECT_GT(seen, 300) << static_cast<int>(type);
  }
}

TEST(Panorama, PolynomialsMayTurnTheOtherWay) {
  Panorama p = panorama(PanoramaType::FISHEYE_POLYNOMIAL);
  for (float& coefficient : p.polynomial) coefficient = -coefficient;
  const std::optional<Vec2> back = panorama_position(p, *panorama_direction(p, {0.7f, 0.4f}));
  ASSERT_TRUE(back);
  EXPECT_NEAR(back->x, 0.7f, 1e-3f);
  EXPECT_NEAR(back->y, 0.4f, 1e-3f);
}

TEST(Panorama, WholeTurnsStartAnywhere) {
  Panorama p;
  for (const Vec2 range : {Vec2{-kPi, kPi}, Vec2{0.0f, 2.0f * kPi}, Vec2{2.0f * kPi, 0.0f}, Vec2{-7.0f, -7.0f + 6.0f}})
    for (const PanoramaType type : {PanoramaType::EQUIRECTANGULAR, PanoramaType::CENTRAL_CYLINDRICAL})
      for (const float x : {0.01f, 0.3f, 0.5f, 0.8f, 0.99f}) {
        p.type = type, p.longitude = range;
        const std::optional<Vec2> back = panorama_position(p, *panorama_direction(p, {x, 0.4f}));
        ASSERT_TRUE(back) << range.x << " " << x;
        EXPECT_NEAR(back->x, x, 1e-4f) << range.x;
      }
}

TEST(Panorama, WhatIsLeftOfAPartOfATurnIsLeft) {
  Panorama p;
  p.longitude = {-1.0f, 1.0f};
  EXPECT_NEAR(panorama_position(p, {std::sin(-1.2f), 0, -std::cos(1.2f)})->x, -0.1f, 1e-4f);
  EXPECT_NEAR(panorama_position(p, {std::sin(1.2f), 0, -std::cos(1.2f)})->x, 1.1f, 1e-4f);
}

TEST(Panorama, RightIsRightAndUpIsUp) {
  for (const PanoramaType type : kTypes) {
    Panorama p = panorama(type);
    p.longitude = {-1.0f, 1.0f}, p.latitude = {-1.0f, 1.0f}, p.cylinder = {-1.0f, 1.0f};
    const Vec3 middle = *panorama_direction(p, {0.5f, 0.5f});
    EXPECT_LT(length(middle - Vec3{0, 0, -1}), 1e-5f) << static_cast<int>(type);
    EXPECT_GT(panorama_direction(p, {0.6f, 0.5f})->x, 0.01f) << static_cast<int>(type);
    EXPECT_GT(panorama_direction(p, {0.5f, 0.6f})->y, 0.01f) << static_cast<int>(type);
  }
}

/// The angle of a pixel, against neighbours in the middle.
TEST(Panorama, PixelsHaveTheAngleBetweenNeighbours) {
  for (const PanoramaType type : {PanoramaType::EQUIRECTANGULAR, PanoramaType::FISHEYE_EQUIDISTANT}) {
    Panorama p;
    p.type = type;
    const float angle = panorama_pixel_angle(p, {1.0f / 400.0f, 1.0f / 400.0f});
    const float expected = type == PanoramaType::EQUIRECTANGULAR ? 0.75f * 2.0f * kPi / 400.0f : kPi / 400.0f;
    EXPECT_NEAR(angle, expected, 0.02f * expected);
  }
}

TEST(Panorama, NothingIsSeenOutsideOfTheCircle) {
  Camera camera;
  camera.type = CameraType::PANORAMIC;
  camera.left = camera.bottom = 0.0f, camera.right = camera.top = 1.0f;
  camera.panorama = panorama(PanoramaType::FISHEYE_EQUIDISTANT);
  EXPECT_TRUE(sees_nothing(camera_ray(camera, {0.05f, 0.05f}, {})));
  EXPECT_FALSE(sees_nothing(camera_ray(camera, {0.5f, 0.05f}, {})));
  EXPECT_FALSE(project(camera, {0, 0, 1}));  // behind
  EXPECT_TRUE(project(camera, {0, 0.1f, -1}));
  EXPECT_GT(project(camera, {1.0f, 0, 0})->x, 1.0f);  // what leaves the frame has a velocity until then
}

/// A viewport around a frame that fills the right half of it, a quarter of its height from the bottom.
TEST(Panorama, FramesLieInWindows) {
  Camera whole;
  whole.type = CameraType::PANORAMIC;
  whole.left = whole.bottom = 0.0f, whole.right = whole.top = 1.0f;
  whole.panorama = panorama(PanoramaType::EQUIRECTANGULAR);
  Camera window = whole;
  window.left = -1.0f, window.bottom = -0.5f, window.top = 1.5f;
  const Vec3 seen = camera_ray(whole, {0.2f, 0.6f}, {}).direction;
  EXPECT_LT(length(camera_ray(window, {0.6f, 0.55f}, {}).direction - seen), 1e-5f);
  EXPECT_NEAR(project(window, seen)->x, 0.6f, 1e-4f);
  EXPECT_NEAR(project(window, seen)->y, 0.55f, 1e-4f);
  EXPECT_NEAR(pixel_footprint(window, 400, 400).angle, 2.0f * pixel_footprint(whole, 400, 400).angle, 1e-4f);
}

}  // namespace
}  // namespace cistern::test
