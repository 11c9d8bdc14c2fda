#include <gtest/gtest.h>

#include <atomic>

#include "base/check.h"
#include "scene/shutter.h"
#include "shading/displaced_scene.h"
#include "shading/program_builder.h"
#include "subdivision/cages.h"

namespace cistern {
namespace {

/// Moves vertices up.
MaterialProgram mover() {
  test::ProgramBuilder b;
  b.program.name = "Mover";
  b.add(Op::CLOSURE_DISPLACEMENT, {b.constant(1.0f), b.constant(Vec3{0.0f, 0.0f, 0.1f})}, {0});
  return b.program;
}

class DicedScene : public testing::Test {
 protected:
  DicedScene() {
    mesh_ = builder_.add_mesh(test::cube().mesh());
    look();
  }

  void look(int pixels = 60, bool stays_diced = false) {
    DicingView view = test::close_view(pixels);
    builder_.set_camera(view.camera, "Camera");
    view.camera = {};  // the one that is set counts
    view.stays_diced = stays_diced;
    builder_.set_dicing(view, "Scene");
  }
  int add(Vec3 place, const std::vector<int>& materials = {}, std::optional<int> replace = {}) {
    Instance instance;
    instance.mesh = mesh_;
    instance.material_set = builder_.add_material_set(materials, "Object");
    instance.object = builder_.add_object_name("Object");
    instance.object_to_world.translation = place;
    return builder_.add_instance(instance, replace);
  }
  std::shared_ptr<const Mesh> shown(int instance) {
    const std::shared_ptr<const Scene> scene = displaced_snapshot(builder_).scene;
    return scene->meshes[static_cast<size_t>(scene->instances[static_cast<size_t>(instance)].mesh)];
  }

  SceneBuilder builder_;
  int mesh_;
};

TEST_F(DicedScene, WithoutAViewMeshesAreAsTheyAre) {
  const int cube = add({});
  EXPECT_GT(shown(cube)->triangle_count(), 1000u);
  builder_.set_dicing({}, "Scene");
  EXPECT_EQ(shown(cube), builder_.scene().meshes[0]);
}

TEST_F(DicedScene, IsDicedAnewOnlyWhenSomethingChanged) {
  const int cube = add({});
  const std::shared_ptr<const Mesh> first = shown(cube);
  look();
  EXPECT_EQ(shown(cube), first);
  builder_.set_camera(Camera(), "Camera");  // later: another than the one it was diced for
  EXPECT_EQ(shown(cube), first);
  add({0.0f, 0.0f, -1.0f}, {}, cube);
  EXPECT_LT(shown(cube)->triangle_count(), first->triangle_count());
  add({}, {}, cube);
  look(61);
  EXPECT_NE(shown(cube), first);
}

TEST_F(DicedScene, MayStayWhereverThingsGo) {
  look(60, true);
  const int cube = add({});
  const std::shared_ptr<const Mesh> first = shown(cube);
  add({0.0f, 0.0f, -1.0f}, {}, cube);
  EXPECT_EQ(shown(cube), first);
  look(90, true);
  EXPECT_EQ(shown(cube), first);
  look(90);
  EXPECT_NE(shown(cube), first);
}

TEST_F(DicedScene, IsDicedForTheInstanceThatShowsItLargest) {
  const int near = add({});
  const size_t alone = shown(near)->triangle_count();
  const int far = add({0.0f, 0.0f, -5.0f});
  EXPECT_EQ(shown(far)->triangle_count(), alone);
  builder_.remove_instance(near);
  const size_t far_alone = shown(far)->triangle_count();
  EXPECT_LT(far_alone, alone / 2);
  add({0.0f, 0.0f, 5.0f});  // behind the camera, and nearer
  EXPECT_EQ(shown(far)->triangle_count(), far_alone);
}

TEST_F(DicedScene, DisplacementMovesWhatWasDiced) {
  const int plain = add({}), moved = add({}, {builder_.add_material(mover())});
  const std::shared_ptr<const Mesh> below = shown(plain), above = shown(moved);
  EXPECT_EQ(above->undisplaced, below);
  EXPECT_EQ(above->generated_bounds().upper, builder_.scene().meshes[0]->bounds.upper);
  for (size_t i = 0; i < below->positions.size(); ++i)
    EXPECT_NEAR(above->positions[i].z, below->positions[i].z + 0.1f, 1e-5f);
  const SceneBuilder later(*displaced_snapshot(builder_).scene);
  EXPECT_EQ(later.scene().meshes.size(), 1u);
  for (const int instance : {plain, moved})
    EXPECT_EQ(later.scene().instances[static_cast<size_t>(instance)].mesh, mesh_);
}

TEST_F(DicedScene, StopsAndGoesOnLater) {
  const int cube = add({}, {builder_.add_material(mover())});
  for (const int calls : {0, 1, 5, 50}) {
    std::atomic<int> left{calls};
    const cistern::DisplacedScene stopped = displaced_snapshot(builder_, nullptr, [&] { return left-- <= 0; });
    EXPECT_FALSE(stopped.scene) << calls;
    EXPECT_TRUE(builder_.displaced_meshes().empty());
  }
  const std::shared_ptr<const Mesh> whole = shown(cube);
  EXPECT_EQ(whole->undisplaced->dicing->source, builder_.scene().meshes[0]);
  const auto never_asked = [] {
    ADD_FAILURE() << "nothing is left to do";
    return false;
  };
  EXPECT_TRUE(displaced_snapshot(builder_, nullptr, never_asked).scene);
}

/// The cube's instance, of a key, in a scene of its own.
std::shared_ptr<const Scene> moment(const test::Cage& cage, Vec3 place, const Scene* middle) {
  SceneBuilder builder;
  Instance instance;
  instance.mesh = builder.add_mesh(cage.mesh());
  instance.material_set = builder.add_material_set({builder.add_material(mover())}, "Object");
  instance.object = builder.add_object_name("Object");
  instance.object_to_world.translation = place;
  instance.key = 7;
  builder.add_instance(instance);
  builder.set_camera(test::close_view().camera, "Camera");
  if (middle == nullptr) builder.set_dicing(test::close_view(60), "Scene");
  return displaced_snapshot(builder, middle).scene;
}

TEST(DicedShutter, ShapesMoveAsTheyAreCutInTheMiddle) {
  const test::Cage cube = test::cube();
  test::Cage taller = cube, other = cube;
  for (Vec3& p : taller.points) p.z *= 3.0f;
  other.polygons.pop_back();
  const std::shared_ptr<const Scene> middle = moment(cube, {}, nullptr);
  const auto half = [&](const test::Cage& cage, Vec3 place) {
    const std::shared_ptr<const Scene> then = moment(cage, place, middle.get());
    const std::shared_ptr<const Scene> at = Shutter(middle, std::vector{middle, then}).at(0.75f);
    return at->meshes[static_cast<size_t>(at->instances[0].mesh)];
  };
  const std::shared_ptr<const Mesh> shown = middle->meshes[static_cast<size_t>(middle->instances[0].mesh)];
  const std::shared_ptr<const Mesh> bent = half(taller, {0.0f, 0.0f, -2.0f});
  ASSERT_EQ(bent->positions.size(), shown->positions.size());
  for (size_t i = 0; i < bent->positions.size(); ++i) {
    const Vec3 before = shown->positions[i], after = bent->positions[i];  // both lifted by 0.1
    EXPECT_NEAR(after.z - 0.1f, 2.0f * (before.z - 0.1f), 1e-4f);
    EXPECT_NEAR(after.x, before.x, 1e-4f);
  }
  EXPECT_EQ(half(cube, {0.0f, 0.0f, -2.0f})->positions, shown->positions);  // moved, not bent
  EXPECT_EQ(half(other, {}), shown);                                        // other polygons
}

TEST_F(DicedScene, BadViewsAreRefused) {
  const auto message = [&](const DicingView& view) -> std::string {
    try {
      builder_.set_dicing(view, "Scene 'Terrain'");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  DicingView view = test::close_view();
  view.rate = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(message(view).find("Scene 'Terrain': dicing rate is nan"), std::string::npos) << message(view);
  view.rate = 1.0f;
  view.width = 0;
  EXPECT_NE(message(view).find("width is 0"), std::string::npos) << message(view);
  view.width = 8;
  view.offscreen_scale = 0.5f;
  EXPECT_NE(message(view).find("offscreen scale is 0.5"), std::string::npos) << message(view);
}

TEST(SubdivisionInput, BadOnesAreRefused) {
  const std::vector<int32_t> beyond{0, 8}, edge{0, 1};
  const std::vector<float> one{1.0f}, two{1.0f, 1.0f};
  const auto message = [&](const auto& change) -> std::string {
    try {
      test::cube().mesh([&](MeshInput& input) { change(*input.subdivision); });
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const std::string outside = message([&](SubdivisionInput& s) { s.creases = beyond, s.crease_sharpness = one; });
  EXPECT_NE(outside.find("cage: creases have point 8"), std::string::npos) << outside;
  const std::string uneven = message([&](SubdivisionInput& s) { s.creases = edge, s.crease_sharpness = two; });
  EXPECT_NE(uneven.find("creases have 2 elements: must have 4"), std::string::npos) << uneven;
  const std::string no_size = message([&](SubdivisionInput& s) { s.pixels = 0.0f; });
  EXPECT_NE(no_size.find("edges of 0.0"), std::string::npos) << no_size;
  const std::string no_map = message([&](SubdivisionInput& s) { s.uv_maps = 1; });
  EXPECT_NE(no_map.find("attribute 0 is no UV map"), std::string::npos) << no_map;
  const std::string negative = message([&](SubdivisionInput& s) { s.uv_maps = -1; });
  EXPECT_NE(negative.find("has -1 UV maps"), std::string::npos) << negative;
}

}  // namespace
}  // namespace cistern
