#include <gtest/gtest.h>

#include "accel_scenes.h"

namespace cistern::test {
namespace {

constexpr Transform kHere;
constexpr uint64_t only(int set) { return uint64_t{1} << set; }

/// A triangle across the z axis at z = 0.
std::shared_ptr<Mesh> sheet() { return make_mesh({{-1, -1, 0}, {1, -1, 0}, {0, 2, 0}}); }

/// A strand across the axis, 0.1 m thick.
std::shared_ptr<Mesh> strand() {
  SceneBuilder builder;
  const std::vector<Vec3> positions{{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}};
  const std::vector<float> radii(3, 0.05f);
  const std::vector<int32_t> offsets{0, 3};
  StrandInput input;
  input.name = "hair";
  input.positions = positions, input.radii = radii, input.strand_offsets = offsets;
  builder.add_strands(input);
  return std::make_shared<Mesh>(*builder.scene().meshes[0]);
}

/// A splat about 0, so opaque that the axis meets it.
std::shared_ptr<Mesh> splat() {
  SceneBuilder builder;
  const std::vector<Vec3> positions{{0, 0, 0}}, scales{{1, 1, 1}};
  const std::vector<std::array<float, 4>> rotations{{1, 0, 0, 0}}, radiance{{0, 0, 0, 1}};
  SplatInput input;
  input.name = "garden";
  input.positions = positions, input.scales = scales, input.rotations = rotations, input.radiance = radiance;
  builder.add_splats(input);
  return std::make_shared<Mesh>(*builder.scene().meshes[0]);
}

Transform at(float z) { return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, z}}; }

/// What is placed last is of that shadow set.
void set_last(Scene& scene, uint8_t shadow_set) { scene.instances.back().shadow_set = shadow_set; }

/// With a lamp that the sets are for.
std::shared_ptr<Scene> linked_scene() {
  const auto scene = make_scene();
  Light lamp;
  lamp.links.blockers = only(0);
  scene->lights = {lamp};
  return scene;
}

const Ray kUp{{0.0f, 0.0f, -5.0f}, {0, 0, 1}};

class ShadowLinks : public testing::TestWithParam<bool> {};

TEST_P(ShadowLinks, BlockersAreThoseOfTheSets) {
  for (const auto& mesh : {sheet(), strand(), splat()}) {
    const auto scene = linked_scene();
    scene->meshes = {mesh};
    place(*scene, 0, at(0.0f)), set_last(*scene, 3);
    const auto accel = Accel::build(scene, {}, GetParam());
    EXPECT_TRUE(accel->occluded(kUp));
    EXPECT_TRUE(accel->occluded(kUp, kVisibleToShadow, only(3)));
    EXPECT_FALSE(accel->occluded(kUp, kVisibleToShadow, ~only(3)));
    EXPECT_FALSE(accel->occluded(kUp, kVisibleToShadow, 0));
    EXPECT_FALSE(accel->intersect_transparent(kUp, kVisibleToShadow, only(3))) << "it is opaque";
  }
}

TEST_P(ShadowLinks, OneInTheSamePlaceDoesNotHideAnother) {
  const auto scene = linked_scene();
  scene->meshes = {sheet(), sheet()};
  for (const uint8_t set : {1, 2, 63}) {
    place(*scene, set == 2, kHere), set_last(*scene, set);
    place(*scene, set == 2, kHere, kVisibleToAll, 1), set_last(*scene, set);  // may let light through
  }
  const auto accel = Accel::build(scene, {}, GetParam());
  for (const int set : {1, 2, 63}) {
    EXPECT_TRUE(accel->occluded(kUp, kVisibleToShadow, only(set)));
    const auto hit = accel->intersect_transparent(kUp, kVisibleToShadow, only(set));
    ASSERT_TRUE(hit);
    EXPECT_EQ(scene->instances[hit->instance].shadow_set, set);
    EXPECT_EQ(scene->instances[hit->instance].material_set, 1);
  }
  EXPECT_FALSE(accel->occluded(kUp, kVisibleToShadow, only(4)));
}

TEST_P(ShadowLinks, EmittersThatSomethingDoesNotBlockAreFoundBehindAll) {
  const auto scene = linked_scene();
  const auto glow = std::make_shared<MaterialProgram>();
  glow->may_emit = true;
  scene->materials.push_back(glow);
  scene->material_sets.push_back({2});
  scene->meshes = {sheet(), strand(), splat()};
  place(*scene, 0, at(0.0f));
  place(*scene, 0, at(1.0f)), scene->instances.back().links.blockers = only(1);  // gives no light
  place(*scene, 0, at(2.0f), kVisibleToAll, 2);                                  // everything blocks its light
  place(*scene, 0, at(3.0f), kVisibleToAll, 2), scene->instances.back().links.blockers = only(1);
  place(*scene, 1, at(4.0f), kVisibleToGlossy, 2), scene->instances.back().links.blockers = only(1);
  const auto accel = Accel::build(scene, {}, GetParam());
  const auto hit = accel->intersect_shadow_linked(kUp, kVisibleToDiffuse);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->instance, 3u);
  const Ray behind{kUp.origin, kUp.direction, hit->t + 0.5f};
  EXPECT_FALSE(accel->intersect_shadow_linked(behind, kVisibleToDiffuse));
  EXPECT_TRUE(accel->intersect_shadow_linked(behind, kVisibleToGlossy));
}

TEST_P(ShadowLinks, ScenesWithoutThemAreOtherScenes) {
  const auto plain = make_scene();
  plain->meshes = {sheet(), sheet()};
  place(*plain, 0, kHere), set_last(*plain, 3);
  place(*plain, 0, at(9.0f));
  const auto before = Accel::build(plain, {}, GetParam());
  EXPECT_TRUE(before->occluded(kUp, kVisibleToShadow, only(1))) << "no emitter asks";
  EXPECT_FALSE(before->intersect_shadow_linked(kUp, kVisibleToAll));
  const auto linked = std::make_shared<Scene>(*plain);
  linked->lights = linked_scene()->lights;
  const auto after = Accel::build(linked, before, GetParam());
  EXPECT_FALSE(after->occluded({kUp.origin, kUp.direction, 0.0f, 8.0f}, kVisibleToShadow, only(1)));
  EXPECT_TRUE(Accel::build(plain, after, GetParam())->occluded(kUp, kVisibleToShadow, only(1)));
}

INSTANTIATE_TEST_SUITE_P(Instances, ShadowLinks, testing::Bool());

}  // namespace
}  // namespace cistern::test
