#include "render/caustic_photons.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

constexpr uint32_t kWalks = 2048;
const Vec3 kToSun = normalize({0.6f, 0.3f, 0.75f});
/// In which the wall shows the sun.
const Vec3 kToMirroredSun{-kToSun.x, kToSun.y, kToSun.z};

/// A diffuse floor, and a smooth wall beside it that faces the camera.
struct Courtyard : PathScene {
  static constexpr Vec3 kEye{1.5f, -2.5f, 1.8f};
  Settings settings;

  /// Puts what is still missing into the picture.
  void build(int wall) {
    quad({0, 0, 0}, {4, 0, 0}, {0, 4, 0}, diffuse(0.7f));
    quad({-1, 0, 0.6f}, {0, 2, 0}, {0, 0, 1.2f}, wall);
    const Vec3 back = normalize(kEye - Vec3{-0.5f, 0, 0.2f});
    const Vec3 right = normalize(cross({0, 0, 1}, back)), up = cross(back, right);
    Camera camera;
    camera.camera_to_world = {{right.x, up.x, back.x}, {right.y, up.y, back.y}, {right.z, up.z, back.z}, kEye};
    builder.set_camera(camera, "camera");
    settings.width = settings.height = 64;
    settings.region = {0, 0, 64, 64};
    settings.caustic_guide = true;
  }

  void sun(float angle, Vec3 direction = kToSun, uint8_t visibility = kVisibleToAll) {
    Light light;
    light.name = "sun";
    light.shape = SunLight{direction, angle, Rgb(1.0f)};
    light.visibility = visibility;
    builder.add_light(light);
  }

  std::vector<CausticPhoton> photons(const std::function<bool()>& is_stopped = [] { return false; }) const {
    const auto scene = builder.snapshot();
    const auto accel = Accel::build(scene);
    const LightSet lights(scene, LightSampling::TREE, EnvironmentDensity::COMPENSATED);
    const NestedCells cells({}, accel->bounds(), kEye, 1e-3f, 0.0f);
    return CausticPhotons(*scene, *accel, lights, settings).trace(kWalks, cells, is_stopped);
  }
};

TEST(CausticPhotons, ComeFromTheMirroredSun) {
  Courtyard yard;
  yard.build(yard.glossy(0.1f));
  yard.sun(0.01f);
  const std::vector<CausticPhoton> photons = yard.photons();
  ASSERT_GT(photons.size(), 50u);
  size_t near = 0;
  for (const CausticPhoton& photon : photons) near += dot(photon.direction, kToMirroredSun) > 0.99f ? 1 : 0;
  EXPECT_GT(near, photons.size() * 9 / 10);
}

TEST(CausticPhotons, MirrorsShowSunsOfSomeSize) {
  Courtyard yard;
  yard.build(yard.glossy(0.0f));
  yard.sun(0.01f);
  const std::vector<CausticPhoton> photons = yard.photons();
  ASSERT_GT(photons.size(), 50u);
  for (const CausticPhoton& photon : photons) ASSERT_GT(dot(photon.direction, kToMirroredSun), std::cos(0.0051f));
}

/// What light samples or scattered rays find well enough, or nothing finds.
TEST(CausticPhotons, OfOtherLightThereAreNone) {
  const auto count = [](float roughness, float angle, uint8_t visibility) {
    Courtyard yard;
    yard.build(yard.glossy(roughness));
    yard.sun(angle, kToSun, visibility);
    return yard.photons().size();
  };
  EXPECT_EQ(count(0.1f, 0.5f, kVisibleToAll), 0u) << "a wide sun";
  EXPECT_EQ(count(0.5f, 0.01f, kVisibleToAll), 0u) << "a rough wall";
  EXPECT_EQ(count(0.0f, 0.0f, kVisibleToAll), 0u) << "a sun without size in a mirror";
  EXPECT_GT(count(0.1f, 0.0f, kVisibleToAll), 50u) << "but in a blurred one";
  EXPECT_EQ(count(0.1f, 0.01f, kVisibleToAll & ~kVisibleToGlossy), 0u) << "a sun that reflections do not show";
}

TEST(CausticPhotons, ThroughPanesOnlyWhereLightSamplesDoNotLook) {
  const Vec3 behind{-kToSun.x, kToSun.y, kToSun.z};
  const auto count = [&](bool through_panes) {
    Courtyard yard;
    yard.build(yard.clear_glass(1.5f));
    yard.quad({-1.05f, 0, 0.6f}, {0, -2, 0}, {0, 0, 1.2f}, yard.clear_glass(1.5f));  // its other face
    yard.sun(0.01f, behind);
    yard.settings.light_through_panes = through_panes;
    const std::vector<CausticPhoton> photons = yard.photons();
    return std::ranges::count_if(photons, [&](const CausticPhoton& p) { return dot(p.direction, behind) > 0.999f; });
  };
  EXPECT_EQ(count(true), 0);
  EXPECT_GT(count(false), 20);
}

TEST(CausticPhotons, AreThoseOfTheRegion) {
  Courtyard yard;
  yard.build(yard.glossy(0.1f));
  yard.sun(0.01f);
  const auto all = yard.photons().size();
  yard.settings.region = {0, 56, 64, 8};  // above the courtyard
  EXPECT_LT(yard.photons().size(), all / 4);
}

TEST(CausticPhotons, NoneWhenStopped) {
  Courtyard yard;
  yard.build(yard.glossy(0.1f));
  yard.sun(0.01f);
  EXPECT_TRUE(yard.photons([] { return true; }).empty());
}

}  // namespace
}  // namespace cistern::test
