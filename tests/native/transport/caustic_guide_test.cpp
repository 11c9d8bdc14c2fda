#include "transport/caustic_guide.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/rng.h"
#include "base/sphere_map.h"
#include "transport/path_guide.h"
#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

const NestedCells kCells({}, Bounds3{{-4, -4, 0}, {4, 4, 4}}, {0, 0, 2}, 1e-3f, 0.0f);
const Vec3 kUp{0, 0, 1}, kSun = normalize({1, 0.5f, 1}), kLamp = normalize({-1, 0.3f, 0.5f});
const Vec3 kPlace{1, 1, 0};

/// Photons that arrive on a small piece of the floor from about a direction.
std::vector<CausticPhoton> photons(int count, Vec3 from, float spread = 0.0f, float light = 1.0f) {
  std::vector<CausticPhoton> result;
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < count; ++i) {
    const Vec3 position = kPlace + Vec3{0.01f * rng.next_float(), 0.01f * rng.next_float(), 0};
    const Vec3 w = normalize(from + spread * equal_area_direction(rng.next_vec2()));
    result.push_back({kCells.key(position, kUp), position, w, light, 0.1f, 0.0f, 1e-4f});
  }
  return result;
}

const DirectionLobes* find(const CausticGuide& guide, Vec3 position, Vec3 normal) {
  const NestedCellKey cell = guide.cell(position, normal);
  return cell == kNoNestedCell ? nullptr : guide.find(cell);
}

TEST(CausticGuide, PointsWhereThePhotonsCameFrom) {
  std::vector<CausticPhoton> all = photons(30, kSun);
  std::ranges::copy(photons(10, kLamp), std::back_inserter(all));
  const CausticGuide guide(kCells, all);
  const DirectionLobes* lobes = find(guide, kPlace, kUp);
  ASSERT_NE(lobes, nullptr);
  ASSERT_EQ(lobes->lobes().size(), 2u);
  EXPECT_NEAR(dot(lobes->lobes()[0].axis, kSun), 1.0f, 1e-6f);
  EXPECT_NEAR(lobes->lobes()[0].share, 0.75f, 1e-5f);
  EXPECT_NEAR(dot(lobes->lobes()[1].axis, kLamp), 1.0f, 1e-6f);
  EXPECT_FLOAT_EQ(lobes->lobes()[0].square_radius, 1e-4f);
}

TEST(CausticGuide, LobesAreAsWideAsDirectionsDiffer) {
  constexpr float kSpread = 0.02f;
  const Vec3 middle = equal_area_direction({20.5f / 64.0f, 30.5f / 64.0f});  // of one of the parts that are told apart
  const CausticGuide guide(kCells, photons(100, middle, kSpread));
  const DirectionLobes* lobes = find(guide, kPlace, kUp);
  ASSERT_NE(lobes, nullptr);
  // Evenly on a sphere of that radius, two of whose three coordinates lie across.
  EXPECT_NEAR(lobes->lobes()[0].square_radius, 2.0f / 3.0f * sqr(kSpread), 0.1f * sqr(kSpread));
}

/// Of a lamp nearby, directions differ over a cell, and lobes turn with the place.
TEST(CausticGuide, LobesPointToLampsNearby) {
  const Vec3 lamp{1.2f, 1.1f, 0.3f};
  std::vector<CausticPhoton> photons;
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < 100; ++i) {
    const Vec3 position = kPlace + Vec3{0.05f * rng.next_float(), 0.05f * rng.next_float(), 0}, off = lamp - position;
    photons.push_back({kCells.key(position, kUp), position, normalize(off), 1.0f, 0.1f, 1.0f / length(off), 1e-6f});
  }
  const CausticGuide guide(kCells, photons);
  for (const Vec3 place : {kPlace, kPlace + Vec3{0.05f, 0, 0}}) {
    const DirectionLobes* lobes = find(guide, place, kUp);
    ASSERT_NE(lobes, nullptr);
    EXPECT_GT(dot(lobes->lobes()[0].axis_at(place), normalize(lamp - place)), 0.9999f);
    EXPECT_LT(lobes->lobes()[0].square_radius, 1e-3f);
  }
}

/// Strong beams are worth many bounces, weak ones few, and so are those that few directions of a lobe lead to.
TEST(CausticGuide, IsWorthWhatItBrings) {
  const auto worth = [](float strength, float spread) {
    std::vector<CausticPhoton> of_strength = photons(30, kSun, spread);
    for (CausticPhoton& photon : of_strength) photon.strength = strength;
    return find(CausticGuide(kCells, of_strength), kPlace, kUp)->worth();
  };
  EXPECT_NEAR(worth(0.1f, 0.0f), 0.15f / 1.15f, 1e-4f);
  EXPECT_EQ(worth(10.0f, 0.0f), 0.5f);
  EXPECT_EQ(worth(0.001f, 0.0f), 0.03f);
  EXPECT_LT(worth(0.1f, 0.05f), 0.05f);
}

TEST(CausticGuide, KnowsNothingElsewhere) {
  const CausticGuide guide(kCells, photons(30, kSun));
  EXPECT_EQ(find(guide, kPlace, {1, 0, 0}), nullptr) << "other sides of surfaces";
  EXPECT_EQ(find(guide, {-3, -3, 0}, kUp), nullptr);
  EXPECT_TRUE(CausticGuide(kCells, {}).is_empty());
}

TEST(CausticGuide, FewPhotonsAreNone) {
  const auto least = static_cast<int>(CausticGuide::kLeastPhotons);
  EXPECT_TRUE(CausticGuide(kCells, photons(least - 1, kSun)).is_empty());
  EXPECT_FALSE(CausticGuide(kCells, photons(least, kSun)).is_empty());
}

TEST(CausticGuide, LobesOfLittleLightAreLeftOut) {
  std::vector<CausticPhoton> all = photons(30, kSun);
  std::ranges::copy(photons(10, kLamp, 0.0f, 0.01f), std::back_inserter(all));
  const CausticGuide guide(kCells, all);
  EXPECT_EQ(find(guide, kPlace, kUp)->lobes().size(), 1u);
}

/// Paths that know nothing but a guide are those of walks that could also learn.
TEST(CausticGuide, IsFollowedAlikeByWalksOfBothKinds) {
  PathScene scene;
  scene.floor(0.0f, 8.0f, scene.mixed(0.6f, 0.6f, 0.4f));
  scene.floor(2.0f, 8.0f, scene.diffuse(0.7f));
  scene.point_lamp({0.5f, 0.5f, 1.0f}, 5.0f);
  const Tracer tracer(scene);
  const CausticGuide guide(kCells, photons(30, kLamp));
  const PathGuide nothing_learned(kCells);
  const GuideUse guiding{&nothing_learned, true};
  PathContext plain = tracer.context(), guided = plain, learned = plain;
  guided.caustics = learned.caustics = &guide;
  learned.guiding = &guiding;
  const Ray ray{kPlace + Vec3{0.005f, 0.005f, 1.5f}, {0, 0, -1}};
  int unlike_plain = 0;
  for (uint32_t path = 0; path < 500; ++path) {
    const auto light = [&](const PathContext& context) {
      PathScratch scratch;
      PathSampler sampler(1, 0, path, SampleSequence::RANDOM);
      return trace_path(context, ray, sampler, scratch).combined().g;
    };
    EXPECT_NEAR(light(guided), light(learned), 1e-5f * light(learned));
    unlike_plain += std::abs(light(guided) - light(plain)) > 1e-3f * light(plain) ? 1 : 0;
  }
  EXPECT_GT(unlike_plain, 100);
}

}  // namespace
}  // namespace cistern::test
