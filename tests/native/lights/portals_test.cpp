#include "lights/portals.h"

#include <gtest/gtest.h>

#include <array>

#include "lights/light_scenes.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

/// 2 x 1 m at height `z`, letting light in downwards.
Light opening(float z, float x = 0.0f, bool is_ellipse = false) {
  AreaLight area;
  area.center = {x, 0.0f, z};
  area.edge_u = {2.0f, 0.0f, 0.0f};
  area.edge_v = {0.0f, 1.0f, 0.0f};
  area.normal = {0.0f, 0.0f, -1.0f};
  area.is_ellipse = is_ellipse;
  area.is_portal = true;
  return make_light(area);
}

/// Of opening(1) as seen from the origin.
const double kSolidAngle = 4.0 * std::asin(1.0 * 0.5 / std::sqrt((1.0 + 1.0) * (0.25 + 1.0)));

/// Means of 1 / pdf over samples, which should be the solid angle that they cover.
template <class Sample>
Moments covered(const Sample& sample, int count = 40000) {
  Moments moments;
  Rng rng(3, 0, 0, 0);
  for (int i = 0; i < count; ++i) moments.add(sample(rng.next_vec2()));
  return moments;
}

bool agrees(const Moments& moments, double expected) { return mean_p_value(moments, expected) > kFalseAlarmRate; }

TEST(Portals, SamplesCoverWhatIsSeenThroughThem) {
  const auto by = [](const Portals& portals, float planted_share) {
    return covered([&, planted_share](Vec2 uv) {
      const std::optional<Vec3> direction = portals.sample(uv, {});
      return direction ? planted_share / portals.pdf(*direction, {}) : 0.0;
    });
  };
  const Portals one(std::array{opening(1.0f)});
  EXPECT_NEAR(by(one, 1.0f).mean(), kSolidAngle, 1e-4 * kSolidAngle);         // all samples weigh the same
  const Portals behind_each_other(std::array{opening(1.0f), opening(2.0f)});  // the farther one is hidden by the nearer
  EXPECT_TRUE(agrees(by(behind_each_other, 1.0f), kSolidAngle));
  EXPECT_FALSE(agrees(by(behind_each_other, 0.99f), kSolidAngle)) << "planted: a hundredth of the light lost";
  const Portals aside(std::array{opening(1.0f, 3.0f)}), both(std::array{opening(1.0f), opening(1.0f, 3.0f)});
  EXPECT_TRUE(agrees(by(both, 1.0f), kSolidAngle + by(aside, 1.0f).mean()));
  const Portals ellipse(std::array{opening(20.0f, 0.0f, true)});
  const double small = kPi / 2.0 / 400.0 * (1.0 - 1.5 * 0.3125 / 400.0);  // area over squared distance, and a term more
  EXPECT_NEAR(by(ellipse, 1.0f).mean(), small, 2e-5 * small);
}

TEST(Portals, AreForThoseInFrontOfThem) {
  const Portals portals(std::array{opening(1.0f)});
  EXPECT_TRUE(portals.can_light({5.0f, 0.0f, 0.0f}));
  EXPECT_FALSE(portals.can_light({0.0f, 0.0f, 2.0f}));
  EXPECT_EQ(portals.pdf({0.0f, 0.0f, -1.0f}, {0.0f, 0.0f, 2.0f}), 0.0f);
  EXPECT_EQ(portals.pdf({1.0f, 0.0f, 0.0f}, {}), 0.0f);
  EXPECT_FALSE(Portals(std::array{opening(1.0f)}).sample({0.5f, 0.5f}, {0.0f, 0.0f, 1.5f}));
}

/// Light samples of an environment by one who is in front of a portal, or not.
struct Room {
  std::shared_ptr<Scene> scene = std::make_shared<Scene>();
  std::unique_ptr<LightSet> lights;

  Room(bool is_even, EnvironmentDensity density) {
    ProgramWriter w;
    const Operand z = w.add(Op::SEPARATE_Z, {w.add(Op::GENERATED, {}, {0})});
    const Operand up = w.add(Op::MATH, {z, w.constant(2.0f), w.constant(0.0f)}, {0, 0});  // z + 2
    scene->materials = {is_even ? constant_emission({1, 1, 1}) : w.emit({1, 1, 1}, up)};
    scene->environment.material = 0;
    scene->lights = {opening(1.0f)};
    lights = std::make_unique<LightSet>(scene, LightSampling::TREE, density);
  }

  Moments solid_angle(Vec3 receiver, float planted = 1.0f) const {
    return covered([&](Vec2 uv) {
      const auto light = lights->evaluate({*lights->environment_emitter(), uv}, receiver, PathState{});
      if (!light) return 0.0;
      const float pdf = lights->environment_pdf(light->wi, receiver);
      EXPECT_NEAR(light->pdf, pdf, 1e-2f * pdf);  // directions on the edge of a texel are its neighbour's
      return 1.0 / (light->pdf * planted);
    });
  }
};

TEST(Portals, EvenSkiesAreLookedForThroughThemAlone) {
  const Room room(true, EnvironmentDensity::COMPENSATED);
  EXPECT_NEAR(room.solid_angle({}).mean(), kSolidAngle, 1e-4 * kSolidAngle);
  const Vec3 behind{0.0f, 0.0f, 2.0f};
  EXPECT_EQ(room.solid_angle(behind).mean(), 0.0);
  EXPECT_EQ(room.lights->environment_pdf({0.0f, 0.0f, 1.0f}, behind), 0.0f);
}

TEST(Portals, OthersAreLookedForEverywhereToo) {
  const Room room(false, EnvironmentDensity::COMPENSATED);
  EXPECT_TRUE(agrees(room.solid_angle({}), 4.0 * kPi));
  EXPECT_FALSE(agrees(room.solid_angle({}, 1.1f), 4.0 * kPi)) << "planted: a density too large";
  EXPECT_TRUE(agrees(room.solid_angle({0.0f, 0.0f, 2.0f}), 4.0 * kPi));  // from behind
}

/// Samples in bins of the sphere against the density of the LightSet integrated over each.
double chi_square(const Room& room, Vec3 receiver, float planted_share = 0.0f) {
  constexpr int kRows = 16, kColumns = 32, kCells = 12, kDraws = 100000;
  std::vector<double> observed(kRows * kColumns), expected(kRows * kColumns);
  const auto bin = [](Vec3 d) {
    const int x = std::min(static_cast<int>((std::atan2(d.y, d.x) / (2.0f * kPi) + 0.5f) * kColumns), kColumns - 1);
    return static_cast<size_t>(std::min(static_cast<int>((0.5f - 0.5f * d.z) * kRows), kRows - 1) * kColumns + x);
  };
  Rng rng(17, 0, 0, 0);
  for (int i = 0; i < kDraws; ++i) {
    const auto light = room.lights->evaluate({*room.lights->environment_emitter(), rng.next_vec2()}, receiver, {});
    if (light) ++observed[bin(light->wi)];
  }
  constexpr int kSteps = kRows * kColumns * kCells * kCells * 16;
  Rng directions(18, 0, 0, 0);
  for (int i = 0; i < kSteps; ++i) {
    const float z = 1.0f - 2.0f * (static_cast<float>(i) + 0.5f) / kSteps, s = std::sqrt(1.0f - z * z);
    const float phi = 2.0f * kPi * directions.next_float();
    const Vec3 d{s * std::cos(phi), s * std::sin(phi), z};
    const float pdf = room.lights->environment_pdf(d, receiver) * (1.0f - planted_share) + planted_share / (4.0f * kPi);
    expected[bin(d)] += kDraws * 4.0 * kPi / kSteps * pdf;
  }
  return chi_square_p_value(observed, expected);
}

TEST(Portals, SamplesOfTheEnvironmentFollowTheirDensity) {
  const Room room(false, EnvironmentDensity::COMPENSATED);
  EXPECT_GT(chi_square(room, {}), kFalseAlarmRate);
  EXPECT_GT(chi_square(room, {2.0f, 1.0f, 0.5f}), kFalseAlarmRate);
  EXPECT_LT(chi_square(room, {}, 0.05f), kFalseAlarmRate) << "planted: a twentieth of the density is even";
}

TEST(Portals, LampsHaveAllSamplesWhereNoneIsSeen) {
  auto scene = std::make_shared<Scene>(*Room(true, EnvironmentDensity::COMPENSATED).scene);
  scene->lights.push_back(make_light(PointLight{{3.0f, 0.0f, 0.0f}, 0.0f, Rgb(5.0f)}));
  const LightSet lights(scene, LightSampling::TREE, EnvironmentDensity::COMPENSATED);
  const uint32_t sky = *lights.environment_emitter();
  ASSERT_EQ(lights.emitter_count(), 2u);
  for (const float z : {2.0f, 0.5f, -3.0f}) {
    const Vec3 receiver{0.2f, 0.1f, z};
    EXPECT_NEAR(lights.pmf(0, receiver, {}) + lights.pmf(sky, receiver, {}), 1.0f, 1e-6f);
    EXPECT_EQ(lights.pmf(sky, receiver, {}) > 0.0f, z < 1.0f);
    int skies = 0;
    for (int i = 0; i < 1000; ++i) skies += lights.choose(receiver, {}, i / 1000.0, {})->sample.emitter == sky;
    EXPECT_NEAR(skies / 1000.0, lights.pmf(sky, receiver, {}), 2e-3);
  }
}

TEST(Portals, RemovedOnesAreNone) {
  Light removed = opening(1.0f);
  removed.removed = true;
  EXPECT_TRUE(Portals(std::array{removed}).is_empty());
}

TEST(Portals, EmitNothingAndAreUnknownToReservoirs) {
  const Room room(true, EnvironmentDensity::COMPLETE);
  EXPECT_EQ(room.lights->emitter_count(), 1u);
  EXPECT_NEAR(room.solid_angle({}).mean(), 4.0 * kPi, 1e-3);
  EXPECT_FALSE(room.lights->has_visible_lamps());
}

}  // namespace
}  // namespace cistern::test
