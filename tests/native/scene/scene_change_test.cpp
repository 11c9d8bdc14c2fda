#include "scene/scene_change.h"

#include <gtest/gtest.h>

#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

constexpr uint32_t kNone = SceneChange::kNone;

/// A floor and a lamp; edits go on with the same builder.
struct Stage {
  PathScene scene;
  int grey = scene.diffuse(0.5f);
  Instance floor = scene.floor(0.0f, 1.0f, grey);
  Light lamp = scene.point_lamp({0, 0, 1}, 1.0f);
  std::shared_ptr<const Scene> before = scene.builder.snapshot();

  SceneChange change() const { return compare_scenes(*before, *scene.builder.snapshot()); }
};

TEST(SceneChange, NothingChangedBetweenEqualSnapshots) {
  const SceneChange change = Stage().change();
  EXPECT_FALSE(change.affects_light());
  EXPECT_FALSE(change.camera);
  EXPECT_TRUE(change.earlier_instances.empty());
  EXPECT_TRUE(change.earlier_lights.empty());
}

TEST(SceneChange, TheCameraMattersToLightOnlyWhereMaterialsReadIt) {
  Stage stage;
  Camera camera;
  camera.left = -0.5f;
  stage.scene.builder.set_camera(camera, "camera");
  EXPECT_TRUE(stage.change().camera);
  EXPECT_EQ(stage.change().earlier_camera, stage.before->camera);
  EXPECT_FALSE(stage.change().affects_light());

  ProgramBuilder window;
  const Operand color = window.add(Op::WINDOW_COORDINATE, {}, {0});
  window.add(Op::CLOSURE_EMISSION, {window.constant(1), color, window.constant(1)});
  stage.scene.builder.add_material(window.program);
  EXPECT_TRUE(stage.change().affects_light());
}

TEST(SceneChange, FollowsAnInstance) {
  Stage stage;
  Instance moved = stage.floor;
  moved.object_to_world = {{0, -2, 0}, {2, 0, 0}, {0, 0, 2}, {1, 2, 3}};
  stage.scene.replace_last(moved);
  const SceneChange change = stage.change();
  EXPECT_TRUE(change.surfaces && change.affects_light());
  EXPECT_FALSE(change.lamps || change.materials || change.environment);
  ASSERT_EQ(change.earlier_instances, std::vector<uint32_t>{0});
  const Vec3 there = change.to_earlier[0].point(moved.object_to_world.point({0.25f, -0.5f, 0.125f}));
  EXPECT_NEAR(length(there - Vec3{0.25f, -0.5f, 0.125f}), 0.0f, 1e-6f);
}

TEST(SceneChange, ValuesOfInstancesAreLikeMaterials) {
  Stage stage;
  stage.scene.builder.set_instance_values({"tint"}, {1, 2, 3, 4});
  EXPECT_TRUE(stage.change().materials);
  stage.before = stage.scene.builder.snapshot();
  stage.scene.builder.set_instance_values({"tint"}, {1, 2, 3, 4});
  EXPECT_FALSE(stage.change().affects_light());
  Instance other = stage.floor;
  other.values = 0;
  stage.scene.replace_last(other);
  EXPECT_TRUE(stage.change().materials);
  EXPECT_FALSE(stage.change().surfaces);
}

TEST(SceneChange, KeysNameThingsWhateverTheirOrder) {
  Stage stage;
  stage.scene.builder.clear_instances();
  stage.scene.builder.clear_lights();
  const auto add = [&](std::vector<uint64_t> keys) {
    for (const uint64_t key : keys) {
      Instance instance = stage.floor;
      instance.key = key;
      stage.scene.builder.add_instance(instance);
      Light light = stage.lamp;
      light.key = key;
      stage.scene.builder.add_light(light);
    }
    return stage.scene.builder.snapshot();
  };
  const auto before = add({7, 8, 9, 9});
  stage.scene.builder.clear_instances();
  stage.scene.builder.clear_lights();
  const auto after = add({9, 1, 7, 9, 9, 0});
  const SceneChange change = compare_scenes(*before, *after);
  const std::vector<uint32_t> expected{2, kNone, 0, kNone, kNone, kNone};
  EXPECT_EQ(change.earlier_instances, expected) << "of equal keys the first counts, once";
  EXPECT_EQ(change.earlier_lights, expected);
}

TEST(SceneChange, AnotherMeshIsAnotherThing) {
  Stage stage;
  stage.scene.builder.add_mesh(stage.before->meshes[0]);
  Instance other = stage.floor;
  other.mesh = 1;
  stage.scene.replace_last(other);
  EXPECT_FALSE(stage.change().surfaces) << "the very same mesh by another handle";

  stage.scene.builder.add_mesh(std::make_shared<const Mesh>(*stage.before->meshes[0]));
  other.mesh = 2;
  stage.scene.replace_last(other);
  EXPECT_EQ(stage.change().earlier_instances, std::vector<uint32_t>{kNone});
}

TEST(SceneChange, SeesMaterialsByWhatTheySay) {
  Stage stage;
  const auto paint = [](float albedo) {
    ProgramBuilder p;
    const Operand normal = p.add(Op::NORMAL, {});
    p.add(Op::CLOSURE_DIFFUSE, {p.constant(1), p.constant(albedo), p.constant(0), normal});
    return p.program;
  };
  stage.scene.builder.add_material(paint(0.5f), stage.grey);
  EXPECT_EQ(stage.scene.builder.scene().materials[0], stage.before->materials[0]) << "an equal one stays what it was";
  EXPECT_FALSE(stage.change().affects_light());
  stage.scene.builder.add_material(paint(0.25f), stage.grey);
  EXPECT_TRUE(stage.change().materials);
}

TEST(SceneChange, SeesLampsAndTheEnvironment) {
  Stage stage;
  stage.scene.builder.remove_light(0);
  EXPECT_TRUE(stage.change().lamps);
  EXPECT_EQ(stage.change().earlier_lights, std::vector<uint32_t>{kNone});
  stage.scene.builder.add_light(stage.lamp, 0);
  EXPECT_FALSE(stage.change().affects_light());
  stage.scene.environment({1, 1, 1});
  EXPECT_TRUE(stage.change().environment);
}

TEST(SceneBuilder, GoesOnFromASnapshot) {
  Stage stage;
  SceneBuilder next(*stage.before);
  EXPECT_EQ(next.add_object_name("object"), 0);
  EXPECT_EQ(next.add_material_set({stage.grey}, "quad"), stage.floor.material_set);
  EXPECT_EQ(next.add_object_name("other"), 1);
  EXPECT_FALSE(compare_scenes(*stage.before, *next.snapshot()).affects_light());
  EXPECT_EQ(next.snapshot()->meshes[0], stage.before->meshes[0]);
}

}  // namespace
}  // namespace cistern::test
