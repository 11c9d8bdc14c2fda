#include <gtest/gtest.h>

#include <array>

#include "accel_scenes.h"

namespace cistern::test {
namespace {

const Ray kUp{{0.1f, 0.1f, -5.0f}, {0, 0, 1}};

/// A triangle across the z axis at z = 0.
std::shared_ptr<Mesh> sheet() { return make_mesh({{-1, -1, 0}, {1, -1, 0}, {0, 2, 0}}); }

Transform at(float z) { return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, z}}; }

/// Set 0 is a surface, 1 a boundary of a medium, 2 a surface with a medium inside.
std::shared_ptr<Scene> media_scene() {
  const auto scene = make_scene();
  const auto boundary = std::make_shared<MaterialProgram>(), filled = std::make_shared<MaterialProgram>();
  boundary->has_volume = filled->has_volume = boundary->is_boundary = boundary->may_be_transparent = true;
  scene->materials = {scene->materials[0], boundary, filled};
  scene->material_sets = {{0}, {1}, {2}};
  scene->meshes = {sheet()};
  return scene;
}

class MediaAccel : public testing::TestWithParam<bool> {
 protected:
  std::shared_ptr<const Accel> build(const std::shared_ptr<Scene>& scene) const {
    return Accel::build(scene, {}, GetParam());
  }
};

TEST_P(MediaAccel, RaysMeetMediaThatTheyDoNotSee) {
  const auto scene = media_scene();
  place(*scene, 0, at(1.0f), kVisibleToShadow, 1);
  place(*scene, 0, at(2.0f), kVisibleToAll, 0);
  const auto accel = build(scene);
  EXPECT_EQ(accel->intersect(kUp, kVisibleToCamera)->instance, 1);
  EXPECT_EQ(accel->intersect_or_medium(kUp, kVisibleToCamera, {})->instance, 0);
  EXPECT_EQ(accel->intersect_surface(kUp, kVisibleToShadow)->instance, 1);
  EXPECT_EQ(accel->intersect_transparent_or_medium(kUp, kVisibleToCamera, kAllSets, {})->instance, 0);
  EXPECT_EQ(accel->intersect_or_medium(kUp, 0, {})->instance, 0);
  EXPECT_TRUE(accel->has_media());
  EXPECT_FALSE(accel->occluded({kUp.origin, kUp.direction, 0.0f, 6.5f}));
}

TEST_P(MediaAccel, ThoseAtOnePlaceAreAllFound) {
  const auto scene = media_scene();
  for (const int set : {1, 2, 0, 1}) place(*scene, 0, at(1.0f), kVisibleToCamera, set);
  place(*scene, 0, at(1.5f), kVisibleToAll, 1);
  const HitList found = build(scene)->media_along({kUp.origin, kUp.direction, 5.9f, 6.1f}, kAllSets);
  std::vector<uint32_t> instances;
  for (const Hit& hit : found.all()) {
    instances.push_back(hit.instance);
    EXPECT_NEAR(hit.t, 6.0f, 1e-5f);
    EXPECT_GT(hit.normal.z, 0.0f);
  }
  std::ranges::sort(instances);
  EXPECT_EQ(instances, (std::vector<uint32_t>{0, 1, 3}));
}

/// Embree aborts where a filter meets an instanced mesh that was built without.
TEST_P(MediaAccel, MeshesWithoutMediaArePassedToo) {
  const auto scene = media_scene();
  scene->meshes.push_back(sheet());
  place(*scene, 1, at(1.0f), kVisibleToAll, 0);
  place(*scene, 1, at(3.0f), kVisibleToAll, 0);
  place(*scene, 0, at(2.0f), kVisibleToAll, 1);
  const auto accel = build(scene);
  const TriangleId first{0, 0}, boundary{2, 0};
  EXPECT_EQ(accel->intersect_or_medium(kUp, kVisibleToCamera, std::array{first})->instance, 2);
  EXPECT_EQ(accel->intersect_or_medium(kUp, kVisibleToCamera, std::array{first, boundary})->instance, 1);
}

TEST_P(MediaAccel, NoMoreThanTheListHolds) {
  const auto scene = media_scene();
  for (int i = 0; i < 40; ++i) place(*scene, 0, at(0.0f), kVisibleToAll, 1);
  EXPECT_EQ(build(scene)->media_along(kUp, kAllSets).count, HitList::kCapacity);
}

TEST_P(MediaAccel, ScenesWithoutMediaHaveNone) {
  const auto scene = media_scene();
  place(*scene, 0, at(1.0f), kVisibleToAll, 0);
  EXPECT_FALSE(build(scene)->has_media());
  EXPECT_EQ(build(scene)->media_along(kUp, kAllSets).count, 0u);
  EXPECT_EQ(build(scene)->intersect_surface(kUp, kVisibleToCamera)->instance, 0);
}

TEST_P(MediaAccel, MaterialsThatGetAMediumAreSeenAtOnce) {
  const auto scene = media_scene();
  for (int i = 0; i < 2; ++i) place(*scene, 0, at(1.0f), kVisibleToAll, 0);
  const auto before = build(scene);
  const auto edited = std::make_shared<Scene>(*scene);
  edited->instances[1].material_set = 2;
  const auto after = Accel::build(edited, before, GetParam());
  EXPECT_EQ(before->media_along(kUp, kAllSets).count, 0u);
  ASSERT_EQ(after->media_along(kUp, kAllSets).count, 1u);
  EXPECT_EQ(after->media_along(kUp, kAllSets).hits[0].instance, 1u);
}

INSTANTIATE_TEST_SUITE_P(FlattenedAndInstanced, MediaAccel, testing::Bool());

}  // namespace
}  // namespace cistern::test
