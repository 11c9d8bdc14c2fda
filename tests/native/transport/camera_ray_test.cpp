#include "transport/camera_ray.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "base/warp.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

/// Stands at (1, 2, 3) and looks along +X with +Z up.
Camera make_camera(CameraType type) {
  Camera camera;
  camera.type = type;
  camera.camera_to_world = {{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}, {1, 2, 3}};
  camera.left = -0.5f, camera.right = 0.7f, camera.bottom = -0.2f, camera.top = 0.4f;
  camera.clip_start = 0.5f, camera.clip_end = 100.0f;
  return camera;
}

void expect_near(Vec3 a, Vec3 b, float tolerance = 1e-5f) { EXPECT_LT(length(a - b), tolerance); }

TEST(CameraRay, PerspectiveWindow) {
  const Camera camera = make_camera(CameraType::PERSPECTIVE);
  const Ray low = camera_ray(camera, {0.0f, 0.0f}, {});
  expect_near(low.origin, {1, 2, 3});
  expect_near(low.direction, normalize(Vec3{1.0f, 0.5f, -0.2f}));  // left is +Y when looking along +X
  const Ray high = camera_ray(camera, {1.0f, 1.0f}, {});
  expect_near(high.direction, normalize(Vec3{1.0f, -0.7f, 0.4f}));
}

TEST(CameraRay, OrthographicWindow) {
  const Camera camera = make_camera(CameraType::ORTHOGRAPHIC);
  const Ray low = camera_ray(camera, {0.0f, 0.0f}, {}), high = camera_ray(camera, {1.0f, 1.0f}, {});
  expect_near(low.origin, {1.0f, 2.5f, 2.8f});
  expect_near(high.origin, {1.0f, 1.3f, 3.4f});
  expect_near(low.direction, {1, 0, 0});
  expect_near(high.direction, {1, 0, 0});
}

TEST(CameraRay, ClipDistancesAreDepths) {
  for (const CameraType type : {CameraType::PERSPECTIVE, CameraType::ORTHOGRAPHIC}) {
    for (const float aperture : {0.0f, 0.2f}) {
      Camera camera = make_camera(type);
      camera.aperture_radius = aperture, camera.focus_distance = 4.0f;
      for (const Vec2 s : {Vec2{0.5f, 0.5f}, Vec2{0.0f, 1.0f}, Vec2{1.0f, 0.1f}}) {
        const Ray ray = camera_ray(camera, s, {0.9f, 0.2f});
        EXPECT_NEAR(length(ray.direction), 1.0f, 1e-6f);
        EXPECT_NEAR(camera_depth(camera, ray.origin + ray.direction * ray.t_min), 0.5f, 1e-5f);
        EXPECT_NEAR(camera_depth(camera, ray.origin + ray.direction * ray.t_max), 100.0f, 1e-3f);
      }
    }
  }
}

TEST(CameraRay, AllRaysOfAnImagePointMeetAtTheFocus) {
  Rng rng(1, 0, 0, 0);
  for (const CameraType type : {CameraType::PERSPECTIVE, CameraType::ORTHOGRAPHIC}) {
    Camera camera = make_camera(type);
    camera.focus_distance = 7.0f;
    const Ray pinhole = camera_ray(camera, {0.3f, 0.8f}, {});
    const float along = camera.focus_distance / dot(pinhole.direction, Vec3{1, 0, 0});
    const Vec3 focus = pinhole.origin + pinhole.direction * along;
    camera.aperture_radius = 0.3f;
    camera.aperture_ratio = 1.5f;
    float widest = 0.0f;
    for (int i = 0; i < 200; ++i) {
      const Ray ray = camera_ray(camera, {0.3f, 0.8f}, rng.next_vec2());
      const Vec3 to_focus = focus - ray.origin;
      EXPECT_LT(length(cross(to_focus, ray.direction)), 1e-5f);
      const Vec3 lens = ray.origin - pinhole.origin;
      EXPECT_NEAR(lens.x, 0.0f, 1e-6f);  // the lens plane
      EXPECT_LE(std::abs(lens.z), 0.3001f);
      EXPECT_LE(std::abs(lens.y), 0.2001f) << "narrower across";
      widest = std::max(widest, std::abs(lens.z));
    }
    EXPECT_GT(widest, 0.25f);
  }
}

TEST(CameraRay, FootprintsAreAPixel) {
  const float pixel = 0.5f * (1.2f / 120.0f + 0.6f / 50.0f);
  const PixelFootprint cone = pixel_footprint(make_camera(CameraType::PERSPECTIVE), 120, 50);
  EXPECT_EQ(cone.size, 0.0f);
  EXPECT_NEAR(cone.angle, pixel, 1e-8f);
  const PixelFootprint cylinder = pixel_footprint(make_camera(CameraType::ORTHOGRAPHIC), 120, 50);
  EXPECT_NEAR(cylinder.size, pixel, 1e-8f);
  EXPECT_EQ(cylinder.angle, 0.0f);
}

// --- aperture: uniform over the area of a disk or a regular polygon -------------------------------------------------

bool is_inside(const Camera& camera, Vec2 p) {
  if (camera.blades < 3) return p.x * p.x + p.y * p.y <= 1.0f;
  const float step = 2.0f * kPi / static_cast<float>(camera.blades);
  for (int i = 0; i < camera.blades; ++i) {
    const float middle = static_cast<float>(i) * step + camera.blade_rotation;
    if (p.x * std::cos(middle) + p.y * std::sin(middle) > std::cos(0.5f * step)) return false;
  }
  return true;
}

/// Chi-square against the area that each cell of a grid over [-1, 1]^2 shares with the aperture.
template <class Sampler>
double area_p_value(const Camera& camera, const Sampler& sampler) {
  constexpr int kGrid = 12, kFine = 32, kSamples = 60000;
  std::vector<double> expected(kGrid * kGrid), observed(kGrid * kGrid);
  double area = 0.0;
  for (int j = 0; j < kGrid * kFine; ++j) {
    for (int i = 0; i < kGrid * kFine; ++i) {
      const auto coordinate = [](int k) { return 2.0f * (static_cast<float>(k) + 0.5f) / (kGrid * kFine) - 1.0f; };
      if (!is_inside(camera, {coordinate(i), coordinate(j)})) continue;
      ++expected[static_cast<size_t>((j / kFine) * kGrid + i / kFine)];
      ++area;
    }
  }
  for (double& e : expected) e *= kSamples / area;
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < kSamples; ++i) {
    const Vec2 p = sampler(rng.next_vec2());
    const auto cell = [](float v) { return std::clamp(static_cast<int>((v + 1.0f) * 0.5f * kGrid), 0, kGrid - 1); };
    ++observed[static_cast<size_t>(cell(p.y) * kGrid + cell(p.x))];
  }
  return chi_square_p_value(observed, expected);
}

TEST(CameraRay, AperturesAreUniformInArea) {
  const double rate = shared_rate(6);
  for (const int blades : {0, 3, 5, 6}) {
    Camera camera;
    camera.blades = blades, camera.blade_rotation = 0.4f;
    const auto sampler = [&](Vec2 u) { return sample_aperture(camera, u); };
    EXPECT_GT(area_p_value(camera, sampler), rate) << blades;
  }
  // Planted bugs: radius linear in the random number; a polygon turned the other way.
  const auto too_central = [](Vec2 u) { return u.x * Vec2{std::cos(2.0f * kPi * u.y), std::sin(2.0f * kPi * u.y)}; };
  EXPECT_LT(area_p_value(Camera{}, too_central), rate);
  Camera turned, other_way;
  turned.blades = other_way.blades = 5;
  turned.blade_rotation = 0.4f, other_way.blade_rotation = -0.4f;
  EXPECT_LT(area_p_value(turned, [&](Vec2 u) { return sample_aperture(other_way, u); }), rate);
}

TEST(CameraRay, AnamorphicAperturesAreNarrowerAcross) {
  Camera camera;
  camera.aperture_ratio = 2.0f;
  Rng rng(3, 0, 0, 0);
  Vec2 widest;
  for (int i = 0; i < 1000; ++i) {
    const Vec2 p = sample_aperture(camera, rng.next_vec2());
    widest = {std::max(widest.x, std::abs(p.x)), std::max(widest.y, std::abs(p.y))};
  }
  EXPECT_NEAR(widest.x, 0.5f, 0.02f);
  EXPECT_NEAR(widest.y, 1.0f, 0.02f);
}

}  // namespace
}  // namespace cistern::test
