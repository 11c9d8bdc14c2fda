#include "transport/sheet_ray.h"

#include <gtest/gtest.h>

#include <numeric>

#include "base/check.h"
#include "render/render_scenes.h"
#include "render/session.h"
#include "shading/surface_point.h"

namespace cistern::test {
namespace {

constexpr int kSide = 4;
constexpr int kFloor = 0;  // instance
constexpr float kSize = 10.0f, kPixel = kSize / kSide;

float middle(int pixel) { return -0.5f * kSize + (static_cast<float>(pixel) + 0.5f) * kPixel; }

/// The floor, a square of side kSize, laid out as kSide x kSide pixels, of which those before `first` show nothing.
std::shared_ptr<const Scene> with_floor_sheet(const Scene& scene, bool sees_from_eye, int first) {
  SceneBuilder builder(scene);
  std::vector<int32_t> polygons(kSide * kSide, 0);
  std::fill_n(polygons.begin(), first, -1);
  const std::vector<Vec3> steps_x(polygons.size(), {kPixel, 0, 0}), steps_y(polygons.size(), {0, kPixel, 0});
  std::vector<Vec3> points;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) points.push_back({middle(x), middle(y), 0.0f});
  builder.set_sheet({kSide, kSide, kFloor, polygons, points, steps_x, steps_y}, sees_from_eye, "Floor");
  return builder.snapshot();
}

std::shared_ptr<const Scene> floor_sheet(bool sees_from_eye = false) {
  return with_floor_sheet(*small_room(), sees_from_eye, 1);
}

TEST(SheetRay, ComesFromRightAbove) {
  const auto scene = floor_sheet();
  for (size_t pixel = 1; pixel < kSide * kSide; ++pixel) {
    const auto onto = sheet_ray(*scene, pixel, {0.01f, -0.01f});
    ASSERT_TRUE(onto);
    EXPECT_EQ(onto->ray.direction, (Vec3{0, 0, -1}));
    const SurfacePoint point = make_surface_point(*scene, onto->ray, onto->hit);
    EXPECT_FALSE(point.is_backface);
    const Vec3 expected{middle(static_cast<int>(pixel) % kSide), middle(static_cast<int>(pixel) / kSide), 0.0f};
    EXPECT_LT(length(point.position - expected), 0.02f * kPixel);
    EXPECT_LT(length(onto->ray.origin + onto->hit.t * onto->ray.direction - point.position), 1e-4f);
  }
  EXPECT_FALSE(sheet_ray(*scene, 0, {}));
}

TEST(SheetRay, ComesFromTheCameraWhereThatIsAsked) {
  const auto scene = floor_sheet(true);
  const auto onto = sheet_ray(*scene, 5, {});
  ASSERT_TRUE(onto);
  const SurfacePoint point = make_surface_point(*scene, onto->ray, onto->hit);
  EXPECT_LT(length(onto->ray.direction - normalize(point.position - scene->camera.camera_to_world.translation)), 1e-5f);
}

TEST(SheetRay, NeverLeavesItsTriangle) {
  const auto scene = floor_sheet();
  for (const Vec2 offset : {Vec2{9.0f, 0.0f}, Vec2{-9.0f, -9.0f}, Vec2{2.0f, -9.0f}}) {
    const Hit hit = sheet_ray(*scene, 7, offset)->hit;
    EXPECT_GT(std::min({hit.u, hit.v, 1.0f - hit.u - hit.v}), 1e-6f);
  }
}

std::vector<float> rendered(std::shared_ptr<const Scene> scene, IndirectAnswer indirect) {
  Settings settings = small_settings(kSide, kSide, 16);
  settings.indirect = indirect;
  settings.filter_width = 0.01f;
  Session session(settings);
  session.start(std::move(scene));
  EXPECT_EQ(session.wait(30.0).error, "");
  return session.read(Pass::COMBINED);
}

/// A sheet of a floor is what a parallel camera above it sees: the same random numbers find the same light.
TEST(SheetRay, PicturesAreThoseOfAParallelCameraAbove) {
  PathScene room;
  room.floor(0.0f, kSize, room.mixed(0.6f, 0.4f, 0.3f));
  room.quad({0, kSize, 1}, {kSize, 0, 0}, {0, 0, kSize}, room.diffuse(0.8f));
  room.point_lamp({1, 6, 2}, 50.0f, 0.1f);
  Camera above;
  above.type = CameraType::ORTHOGRAPHIC;
  above.camera_to_world.translation = {0, 0, 5};
  above.left = above.bottom = -0.5f * kSize, above.right = above.top = 0.5f * kSize;
  room.builder.set_camera(above, "camera");
  const auto seen = room.builder.snapshot();
  const auto sheet = with_floor_sheet(*seen, false, 0);
  const std::vector<float> by_camera = rendered(seen, IndirectAnswer::PATH);
  const std::vector<float> by_sheet = rendered(sheet, IndirectAnswer::PATH);
  for (size_t i = 0; i < by_camera.size(); ++i) {
    EXPECT_NEAR(by_sheet[i], by_camera[i], 2e-3f * by_camera[i]) << i;
    EXPECT_GT(by_camera[i], 0.0f);
  }
  // Who shares with whom depends on roundings: the same light by other samples.
  const auto mean = [](const std::vector<float>& picture) {
    return std::accumulate(picture.begin(), picture.end(), 0.0);
  };
  const double shared = mean(rendered(sheet, IndirectAnswer::CELL_SHARED));
  EXPECT_NEAR(shared, mean(by_camera), 0.02 * shared);
}

TEST(SheetRay, PixelsThatShowNothingAreBlack) {
  const std::vector<float> picture = rendered(floor_sheet(), IndirectAnswer::PATH);
  EXPECT_EQ(picture[0] + picture[1] + picture[2], 0.0f);
  EXPECT_GT(picture[4], 0.0f);
}

TEST(SheetRay, PicturesOfAnotherSizeAreRefused) {
  Session session(small_settings(kSide + 1, kSide, 1));
  EXPECT_THROW(session.start(floor_sheet()), Error);
}

}  // namespace
}  // namespace cistern::test
