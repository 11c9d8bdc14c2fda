#include "base/direction_guide_lanes.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "base/sphere_map.h"

namespace cistern::test {
namespace {

DirectionHistogram sloping_histogram() {
  std::array<double, DirectionHistogram::kBins> weights{};
  for (size_t i = 0; i < weights.size(); ++i) weights[i] = 1.0 + static_cast<double>(i % 7);
  return DirectionHistogram(weights);
}

/// `count` lobes that turn with the place they are seen from.
DirectionLobes some_lobes(size_t count) {
  DirectionLobes lobes;
  Rng rng(7, 0, 0, 0);
  for (size_t i = 0; i < count; ++i)
    lobes.add({.axis = equal_area_direction(rng.next_vec2()),
               .square_radius = i == 0 ? 1e-4f : 0.2f,
               .share = 1.0f + static_cast<float>(i),
               .from = {0.1f, 0.2f, 0.3f},
               .nearness = 0.4f});
  lobes.set_worth(0.3f);
  return lobes;
}

class DirectionGuideLanesTest : public testing::Test {
 protected:
  DirectionGuide guide(size_t lane) const {
    const Vec3 position{0.1f * static_cast<float>(lane), 1, -1};
    switch (lane % 4) {
      case 0:
        return {};
      case 1:
        return {&histogram_, nullptr, position};
      case 2:
        return {nullptr, &one_, position};
      default:
        return {&histogram_, &most_, position};
    }
  }

  const DirectionHistogram histogram_ = sloping_histogram();
  const DirectionLobes one_ = some_lobes(1), most_ = some_lobes(DirectionLobes::kMost);
};

/// As far as single precision tells where a lobe is narrow.
TEST_F(DirectionGuideLanesTest, EachPlaceHasTheDensityOfItsOwnGuide) {
  constexpr float kTolerance = 2e-3f;
  DirectionGuideLanes lanes;
  for (size_t lane = 0; lane < kLanes; ++lane) lanes.set(lane, guide(lane));
  Rng rng(1, 0, 0, 0);
  float without_turning = 0.0f;
  for (int i = 0; i < 1000; ++i) {
    Vec3Lanes w;
    Lanes unguided = 0.0f;
    for (size_t lane = 0; lane < kLanes; ++lane) {
      const DirectionGuide own = guide(lane);
      const bool follows = own && rng.next_float() < 0.5f;
      w.set(lane, follows ? own.sample(rng.next_vec2()) : equal_area_direction(rng.next_vec2()));
      unguided[lane] = rng.next_float();
    }
    const Lanes pdf = lanes.pdf(unguided, w);
    for (size_t lane = 0; lane < kLanes; ++lane) {
      DirectionGuide own = guide(lane);
      if (!own) {
        EXPECT_EQ(pdf[lane], unguided[lane]);
        continue;
      }
      const float expected = lerp(unguided[lane], own.pdf(w.at(lane)), own.share());
      EXPECT_NEAR(pdf[lane], expected, kTolerance * expected);
      own.position = {};  // planted bug: seen from one place
      const float planted = lerp(unguided[lane], own.pdf(w.at(lane)), own.share());
      without_turning = std::max(without_turning, std::abs(pdf[lane] / planted - 1.0f));
    }
  }
  EXPECT_GT(without_turning, 10.0f * kTolerance);
}

TEST_F(DirectionGuideLanesTest, NothingIsGuidedWhereNothingGoes) {
  DirectionGuideLanes lanes;
  for (size_t lane = 0; lane < kLanes; ++lane) lanes.set(lane, guide(lane));
  const Lanes pdf = lanes.pdf(Lanes(0.0f), Vec3Lanes(Vec3{0, 0, 1}));
  EXPECT_TRUE(all_of(pdf == 0.0f));
}

TEST(DirectionGuideLanes, WithoutGuidesDensitiesStay) {
  const Lanes unguided([](auto lane) { return static_cast<float>(lane); });
  EXPECT_TRUE(all_of(DirectionGuideLanes().pdf(unguided, Vec3Lanes(Vec3{0, 0, 1})) == unguided));
}

}  // namespace
}  // namespace cistern::test
