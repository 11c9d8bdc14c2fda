#include "lights/linked_choice.h"

#include <gtest/gtest.h>

#include "lights/emitter_match.h"
#include "lights/light_scenes.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr LightSampling kSamplings[] = {LightSampling::UNIFORM, LightSampling::POWER, LightSampling::TREE};
constexpr uint64_t only(int set) { return uint64_t{1} << set; }

/// Six triangles that light set 2 alone, six that light all but it, and lamps: one that lights set 3 alone, one that
/// lights all, a sun for 2 and 3.
std::shared_ptr<Scene> linked_scene() {
  auto scene = std::make_shared<Scene>();
  add_mesh(*scene, scattered_triangles(1, 6, 3.0f, 0.4f), constant_emission({2, 2, 2}));
  scene->instances.back().links.lit = only(2);
  add_mesh(*scene, scattered_triangles(2, 6, 3.0f, 0.4f), constant_emission({2, 2, 2}));
  scene->instances.back().links.lit = ~only(2);
  scene->lights = {make_light(PointLight{{1, 2, 3}, 0.2f, Rgb(5.0f), true}),
                   make_light(PointLight{{-1, 2, 3}, 0.5f, Rgb(5.0f), true}),
                   make_light(SunLight{{0, 0.6f, 0.8f}, 0.2f, Rgb(1.0f)})};
  scene->lights[0].links.lit = only(3);
  scene->lights[2].links.lit = only(2) | only(3);
  return scene;
}
constexpr uint32_t kEmitters = 3 + 12;

bool lights_set(uint32_t emitter, uint8_t set) {
  if (emitter == 0) return set == 3;
  if (emitter == 1) return true;
  if (emitter == 2) return set == 2 || set == 3;
  return (emitter < 9) == (set == 2);
}

PathState scattered_by(uint8_t set) {
  PathState state;
  state.ray_kind = kVisibleToDiffuse;
  state.depth = state.diffuse_depth = 1;
  state.set_receiver(set);
  return state;
}

TEST(LinkedLights, LightThoseWhomTheyAreForAndNobodyElse) {
  const LightSet lights(linked_scene(), LightSampling::TREE);
  ASSERT_EQ(lights.emitter_count(), kEmitters);
  Rng rng(1, 0, 0, 0);
  for (uint32_t e = 0; e < kEmitters; ++e) {
    const LightSample sample{e, rng.next_vec2()};
    for (const uint8_t set : {0, 2, 3, 63})
      EXPECT_EQ(lights.evaluate(sample, {}, scattered_by(set)).has_value(), lights_set(e, set)) << e << ' ' << int(set);
    EXPECT_TRUE(lights.evaluate(sample, {}, PathState{})) << "who stands for all";
  }
}

TEST(LinkedLights, AreMetByRaysOfThoseWhomTheyAreFor) {
  const LightSet lights(linked_scene(), LightSampling::TREE);
  const auto lamps_met = [&](const Ray& ray, const PathState& path) {
    std::vector<LampHit> hits;
    lights.intersect_lamps(ray, path, hits);
    return hits.size();
  };
  const Ray to_first{{1, 2, 0}, {0, 0, 1}}, to_sun{{9, 9, 0}, {0, 0.6f, 0.8f}};
  EXPECT_EQ(lamps_met(to_first, scattered_by(3)), 1u);
  EXPECT_EQ(lamps_met(to_first, scattered_by(2)), 0u);
  EXPECT_EQ(lamps_met(to_first, PathState{}), 1u);
  EXPECT_EQ(lamps_met(to_sun, scattered_by(2)), 1u);
  EXPECT_EQ(lamps_met(to_sun, scattered_by(0)), 0u);
}

double choice_p_value(const LightSet& lights, uint8_t set, uint8_t asked_for) {
  constexpr int kDraws = 20000;
  std::vector<double> observed(kEmitters), expected(kEmitters);
  Rng rng(2, 0, 0, 0);
  const Vec3 position{0.3f, -0.2f, 0.1f}, n{0, 0, 1};
  for (int i = 0; i < kDraws; ++i) {
    const auto choice = lights.choose(position, n, rng.next_float(), {}, set);
    ++observed[choice->sample.emitter];
    EXPECT_FLOAT_EQ(choice->pmf, lights.pmf(choice->sample.emitter, position, n, set));
  }
  for (uint32_t e = 0; e < kEmitters; ++e) expected[e] = kDraws * double{lights.pmf(e, position, n, asked_for)};
  return chi_square_p_value(observed, expected);
}

/// False-alarm rate kFalseAlarmRate for all comparisons together.
TEST(LinkedLights, AreChosenAmongThoseThatLightTheReceiver) {
  for (const LightSampling sampling : kSamplings) {
    const LightSet lights(linked_scene(), sampling);
    for (const uint8_t set : {0, 2, 3, 63, 64}) {
      EXPECT_GT(choice_p_value(lights, set, set), shared_rate(15));
      double sum = 0.0;
      for (uint32_t e = 0; e < kEmitters; ++e) {
        sum += lights.pmf(e, {}, {}, set);
        if (set < kLightSets && !lights_set(e, set)) EXPECT_EQ(lights.pmf(e, {}, {}, set), 0.0f);
      }
      EXPECT_NEAR(sum, 1.0, 1e-5);
    }
    EXPECT_LT(choice_p_value(lights, 2, 3), shared_rate(15)) << "planted: the probabilities of another set";
    EXPECT_LT(choice_p_value(lights, 2, kEveryLight), shared_rate(15)) << "planted: those without links";
  }
}

TEST(LinkedLights, ReceiversThatNothingLightsHaveNoChoice) {
  auto scene = std::make_shared<Scene>();
  scene->lights = {make_light(PointLight{{1, 2, 3}, 0.2f, Rgb(5.0f), true})};
  scene->lights[0].links.lit = only(5);
  for (const LightSampling sampling : kSamplings) {
    const LightSet lights(scene, sampling);
    EXPECT_TRUE(lights.choose({}, {}, 0.5, {}, 5));
    EXPECT_FALSE(lights.choose({}, {}, 0.5, {}, 0));
    EXPECT_EQ(lights.pmf(0, {}, {}, 0), 0.0f);
  }
}

TEST(LinkedLights, AreOthersWhenTheirLinksAre) {
  const auto before = linked_scene();
  const auto same_emitters = [&](const Scene& after) {
    return has_same_emitters(*before, after, compare_scenes(*before, after));
  };
  EXPECT_TRUE(same_emitters(Scene(*before)));
  Scene lamp = *before;
  lamp.lights[1].links.blockers = only(7);
  EXPECT_FALSE(same_emitters(lamp));
  Scene mesh = *before;
  mesh.instances[0].links.lit = only(7);
  EXPECT_TRUE(compare_scenes(*before, mesh).affects_light());
  EXPECT_FALSE(same_emitters(mesh));
}

}  // namespace
}  // namespace cistern::test
