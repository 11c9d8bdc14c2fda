#include "scene/shutter.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "render/render_scenes.h"
#include "render/session.h"

namespace cistern::test {
namespace {

/// A square of half width 1 whose points lie at `height`, moved along x, before a camera moved along y.
std::shared_ptr<const Scene> scene_at(float x, float height = 0.0f, float eye = 0.0f, uint64_t key = 7, int extra = 0) {
  SceneBuilder builder;
  MeshInput input;
  input.name = "square";
  std::vector<Vec3> positions{{-1, -1, height}, {1, -1, height}, {1, 1, height}, {-1, 1, height}};
  for (int i = 0; i < extra; ++i) positions.push_back({0, 0, 1});
  const std::vector<int32_t> corners{0, 1, 2, 0, 2, 3};
  input.positions = positions;
  input.corner_vertices = corners;
  Instance instance;
  instance.mesh = builder.add_mesh(input);
  instance.material_set = builder.add_material_set({}, "square");
  instance.object = builder.add_object_name("square");
  instance.object_to_world.translation = {x, 0, 0};
  instance.key = key;
  builder.add_instance(instance);
  Camera camera;
  camera.camera_to_world.translation = {0, eye, 5};
  builder.set_camera(camera, "camera");
  return builder.snapshot();
}

Shutter opened(std::shared_ptr<const Scene> middle, const std::vector<std::shared_ptr<const Scene>>& moments) {
  return {std::move(middle), moments};
}

float x_at(const Shutter& shutter, float time) { return shutter.at(time)->instances[0].object_to_world.translation.x; }

TEST(Shutter, ThingsGoStraightFromInstantToInstant) {
  const Shutter shutter = opened(scene_at(1.0f, 0.5f, 2.0f), {scene_at(0.0f, 0.0f, 0.0f), scene_at(4.0f, 1.5f, 3.0f)});
  EXPECT_TRUE(shutter.moves_surfaces());
  for (const auto& [time, x, height, eye] : {std::array{0.0f, 0.0f, 0.0f, 0.0f},
                                             {0.25f, 0.5f, 0.25f, 1.0f},
                                             {0.5f, 1.0f, 0.5f, 2.0f},
                                             {0.75f, 2.5f, 1.0f, 2.5f},
                                             {1.0f, 4.0f, 1.5f, 3.0f}}) {
    const std::shared_ptr<const Scene> scene = shutter.at(time);
    EXPECT_FLOAT_EQ(scene->instances[0].object_to_world.translation.x, x) << time;
    EXPECT_FLOAT_EQ(scene->meshes[0]->positions[0].z, height) << time;
    EXPECT_FLOAT_EQ(scene->meshes[0]->bounds.upper.z, height) << time;
    EXPECT_FLOAT_EQ(scene->camera.camera_to_world.translation.y, eye) << time;
  }
}

TEST(Shutter, HasAsManyMomentsAsItIsGiven) {
  const Shutter shutter = opened(scene_at(1.0f, 0.5f, 2.0f), {scene_at(0.0f), scene_at(3.0f, 1.5f, 1.0f, 8),
                                                              scene_at(2.0f, 2.5f, 4.0f), scene_at(6.0f, 0.0f, 0.0f)});
  for (const auto& [time, x, height, eye] :
       {std::array{0.0f, 0.0f, 0.0f, 0.0f},
        {0.25f, 0.5f, 0.25f, 1.0f},  // another thing: passed by, but for the camera
        {0.375f, 0.75f, 0.375f, 1.5f},
        {0.5f, 1.0f, 0.5f, 2.0f},
        {0.625f, 1.5f, 1.5f, 3.0f},
        {0.75f, 2.0f, 2.5f, 4.0f},
        {0.875f, 4.0f, 1.25f, 2.0f},
        {1.0f, 6.0f, 0.0f, 0.0f}}) {
    const std::shared_ptr<const Scene> scene = shutter.at(time);
    EXPECT_FLOAT_EQ(scene->instances[0].object_to_world.translation.x, x) << time;
    EXPECT_FLOAT_EQ(scene->meshes[0]->positions[0].z, height) << time;
    EXPECT_FLOAT_EQ(scene->camera.camera_to_world.translation.y, eye) << time;
  }
  const std::shared_ptr<const Scene> middle = scene_at(0.0f);
  EXPECT_THROW(opened(middle, {}), Error);
  EXPECT_THROW(opened(middle, {middle, middle, middle}), Error);
}

TEST(Shutter, ExposesByItsCurve) {
  const std::vector<float> opens{0.0f, 1.0f}, closes{2.0f, 0.0f}, flat{3.0f, 3.0f, 3.0f}, gap{1.0f, 0.0f, 0.0f, 1.0f};
  for (const float u : {0.0f, 0.1f, 0.25f, 0.5f, 0.9f, 0.99999994f}) {
    EXPECT_EQ(time_of_exposure({}, u), u);
    EXPECT_NEAR(time_of_exposure(flat, u), u, 1e-6f);
    EXPECT_NEAR(time_of_exposure(opens, u), std::sqrt(u), 1e-6f);
    EXPECT_NEAR(time_of_exposure(closes, u), 1.0f - std::sqrt(1.0f - u), 1e-6f);
    const float falls = (1.0f - std::sqrt(1.0f - 2.0f * u)) / 3.0f, rises = (2.0f + std::sqrt(2.0f * u - 1.0f)) / 3.0f;
    if (u != 0.5f) EXPECT_NEAR(time_of_exposure(gap, u), u < 0.5f ? falls : rises, 1e-6f) << u;
  }
}

TEST(Shutter, LensesAndPanoramasChange) {
  const auto seen_by = [](CameraType type, float by) {
    SceneBuilder builder(*scene_at(0.0f));
    Camera camera = builder.scene().camera;
    camera.type = type;
    camera.clip_start = by;
    camera.panorama.type = PanoramaType::FISHEYE_EQUIDISTANT;
    camera.panorama.fov = by;
    camera.panorama.longitude.y = 2.0f * by;
    camera.panorama.polynomial[2] = 3.0f * by;
    builder.set_camera(camera, "camera");
    return builder.snapshot();
  };
  const auto pano = CameraType::PANORAMIC;
  const Shutter shutter = opened(seen_by(pano, 2.0f), {seen_by(pano, 1.0f), seen_by(CameraType::PERSPECTIVE, 4.0f)});
  for (const auto& [time, by] : {std::pair{0.0f, 1.0f}, {0.25f, 1.5f}, {0.5f, 2.0f}, {0.75f, 2.0f}}) {
    const Camera camera = shutter.at(time)->camera;
    EXPECT_EQ(camera.type, pano);
    EXPECT_FLOAT_EQ(camera.clip_start, by);
    EXPECT_FLOAT_EQ(camera.panorama.fov, by);
    EXPECT_FLOAT_EQ(camera.panorama.longitude.y, 2.0f * by);
    EXPECT_FLOAT_EQ(camera.panorama.polynomial[2], 3.0f * by);
  }
}

TEST(Shutter, WhatRestsIsShared) {
  const std::shared_ptr<const Scene> middle = scene_at(1.0f);
  const Shutter still = opened(middle, {scene_at(1.0f), scene_at(1.0f)});
  EXPECT_FALSE(still.moves_anything());
  const Shutter moved = opened(middle, {scene_at(0.0f), scene_at(2.0f)});
  EXPECT_EQ(moved.at(0.2f)->meshes[0], middle->meshes[0]);
  const Shutter looked = opened(middle, {scene_at(1.0f, 0.0f, -1.0f), scene_at(1.0f)});
  EXPECT_TRUE(looked.moves_anything());
  EXPECT_FALSE(looked.moves_surfaces());
}

TEST(Shutter, WhatIsNotThereAtAnEndStandsStillUntilThen) {
  const Shutter other_key = opened(scene_at(1.0f), {scene_at(0.0f, 0.0f, 0.0f, 8), scene_at(2.0f)});
  EXPECT_EQ(x_at(other_key, 0.0f), 1.0f);
  EXPECT_EQ(x_at(other_key, 1.0f), 2.0f);
  const Shutter other_points = opened(scene_at(1.0f), {scene_at(0.0f, 3.0f, 0.0f, 7, 2), scene_at(2.0f)});
  EXPECT_EQ(x_at(other_points, 0.0f), 0.0f);
  EXPECT_EQ(other_points.at(0.0f)->meshes[0]->positions[0].z, 0.0f);
}

TEST(Shutter, MeshesAreAsWhatShowsThemHasThem) {
  const auto both_at = [](float height, bool has_first) {
    SceneBuilder builder(*scene_at(0.0f, height));
    Instance second = builder.scene().instances[0];
    second.key = 9;
    builder.add_instance(second);
    if (!has_first) builder.remove_instance(0);
    return builder.snapshot();
  };
  const Shutter shutter = opened(both_at(1.0f, true), {both_at(0.0f, false), both_at(2.0f, true)});
  for (const float time : {0.0f, 0.25f, 0.5f, 1.0f})
    EXPECT_FLOAT_EQ(shutter.at(time)->meshes[0]->positions[0].z, 2.0f * time);
}

TEST(Shutter, RadiiOfPointsChange) {
  const auto ball_of = [](float radius) {
    auto scene = std::make_shared<Scene>(*scene_at(0.0f));
    auto mesh = std::make_shared<Mesh>(*scene->meshes[0]);
    mesh->radii.assign(mesh->positions.size(), radius);
    mesh->strand_shape = StrandShape::BALLS;
    scene->meshes[0] = mesh;
    return scene;
  };
  const Shutter shutter = opened(ball_of(2.0f), {ball_of(1.0f), ball_of(4.0f)});
  for (const auto& [time, radius] : {std::array{0.0f, 1.0f}, {0.25f, 1.5f}, {0.5f, 2.0f}, {0.75f, 3.0f}, {1.0f, 4.0f}})
    EXPECT_FLOAT_EQ(shutter.at(time)->meshes[0]->radii[0], radius) << time;
}

/// Its points go up, of an exposure each half by its drift.
std::shared_ptr<const Scene> drifting_scene(const std::vector<float>& drift, int extra = 0, float height = 0.5f) {
  auto scene = std::make_shared<Scene>(*scene_at(0.0f, height, 0.0f, 7, extra));
  auto mesh = std::make_shared<Mesh>(*scene->meshes[0]);
  auto values = std::make_shared<float[]>(drift.size());
  std::copy(drift.begin(), drift.end(), values.get());
  mesh->attributes.push_back({std::string(kDriftAttribute), Domain::POINT, 3, values, 1});
  scene->meshes[0] = mesh;
  return scene;
}

TEST(Shutter, PointsDriftWhereMomentsDoNotTell) {
  const float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> drift{0, 0, 0.25f, 0, 0, 1.0f, 0, 0, kNan, 0, 0, 0};
  const auto height = [](const Shutter& shutter, float time, size_t point) {
    return shutter.at(time)->meshes[0]->positions[point].z;
  };
  const std::shared_ptr<const Scene> same = scene_at(0.0f, 0.5f), other = scene_at(0.0f, 0.5f, 0.0f, 7, 3);
  for (const auto& moment : {same, other}) {
    const Shutter shutter = opened(drifting_scene(drift), {moment, moment});
    EXPECT_FLOAT_EQ(height(shutter, 0.0f, 0), 0.25f);
    EXPECT_FLOAT_EQ(height(shutter, 0.5f, 0), 0.5f);
    EXPECT_FLOAT_EQ(height(shutter, 1.0f, 0), 0.75f);
    EXPECT_FLOAT_EQ(height(shutter, 0.75f, 1), 1.0f);
    EXPECT_FLOAT_EQ(height(shutter, 1.0f, 2), 0.5f) << "not finite: rests";
    EXPECT_FLOAT_EQ(shutter.at(1.0f)->meshes[0]->bounds.upper.z, 1.5f);
  }
  // Two points of a side rise by 1: the flat square leans, and its normals with it.
  auto smooth = std::make_shared<Scene>(*drifting_scene({0, 0, 0, 0, 0, 2, 0, 0, 2, 0, 0, 0}));
  auto mesh = std::make_shared<Mesh>(*smooth->meshes[0]);
  mesh->normals_domain = Domain::POINT;
  mesh->normals.assign(mesh->positions.size(), encode_octahedral({0, 0, 1}));
  smooth->meshes[0] = mesh;
  const Vec3 leaning = decode_octahedral(opened(smooth, {smooth, smooth}).at(1.0f)->meshes[0]->normals[0]);
  EXPECT_NEAR(leaning.x, -std::sqrt(0.5f), 1e-4f);
  EXPECT_NEAR(leaning.z, std::sqrt(0.5f), 1e-4f);
  const Shutter told = opened(drifting_scene(drift), {scene_at(0.0f, 0.5f), scene_at(0.0f, 2.5f)});
  EXPECT_FLOAT_EQ(height(told, 1.0f, 0), 2.5f) << "the moment knows better";
}

TEST(Shutter, VolumesDrift) {
  const auto scene = std::make_shared<Scene>(*scene_at(0.0f));
  auto mesh = std::make_shared<Mesh>(*scene->meshes[0]);
  VoxelGrid way;
  way.size = {1, 1, 1};
  way.channels = 3;
  way.voxels = std::make_shared<std::array<float, 3>>(std::array<float, 3>{0.0f, 0.0f, 1.0f});
  VoxelVolume volume = make_voxel_volume({}, Transform{}, {1, 1, 1}, false);
  add_drift(volume, way, -0.5f);
  mesh->volume = std::make_shared<const VoxelVolume>(volume);
  scene->meshes[0] = mesh;
  const Shutter shutter = opened(scene, {scene_at(0.0f), scene_at(0.0f)});
  EXPECT_TRUE(shutter.moves_surfaces());
  for (const float time : {0.0f, 0.5f, 0.75f}) {
    const std::shared_ptr<const Mesh> then = shutter.at(time)->meshes[0];
    EXPECT_FLOAT_EQ(then->volume->drifts, time - 0.5f);
    EXPECT_EQ(then->positions, mesh->positions);
  }
}

TEST(Shutter, WhatShrinksToNothingOrIsMirroredGoesStraight) {
  const auto scaled = [](float x, float rest) {
    SceneBuilder builder(*scene_at(0.0f));
    Instance instance = builder.scene().instances[0];
    instance.object_to_world.row_x = {x, 0, 0};
    instance.object_to_world.row_y = {0, rest, 0};
    instance.object_to_world.row_z = {0, 0, rest};
    builder.add_instance(instance, 0);
    return builder.snapshot();
  };
  const auto x_scale = [](const Shutter& shutter, float time) {
    const Instance instance = shutter.at(time)->instances[0];
    EXPECT_EQ(instance.mesh >= 0, instance.object_to_world.row_x.x != 0.0f);
    return instance.object_to_world.row_x.x;
  };
  const Shutter mirrored = opened(scaled(1.0f, 1.0f), {scaled(-1.0f, 1.0f), scaled(2.0f, 1.0f)});
  EXPECT_FLOAT_EQ(x_scale(mirrored, 0.125f), -0.5f);
  EXPECT_FLOAT_EQ(x_scale(mirrored, 0.75f), 1.5f);
  const Shutter shrinking = opened(scaled(0.5f, 0.5f), {scaled(1.0f, 1.0f), scaled(0.0f, 0.0f)});
  EXPECT_FLOAT_EQ(x_scale(shrinking, 0.25f), 0.75f);
  EXPECT_FLOAT_EQ(x_scale(shrinking, 0.75f), 0.25f);
  EXPECT_FLOAT_EQ(x_scale(shrinking, 1.0f), 0.0f);
}

/// The small room while the camera passes by and one of its walls is turned.
std::shared_ptr<const Shutter> passing_room() {
  const auto at = [](float offset) {
    SceneBuilder builder(*small_room());
    Camera camera = builder.scene().camera;
    camera.camera_to_world.translation.x += offset;
    builder.set_camera(camera, "camera");
    Instance wall = builder.scene().instances[1];
    wall.object_to_world.translation.z += offset;
    builder.add_instance(wall, 1);
    return builder.snapshot();
  };
  return std::make_shared<const Shutter>(opened(at(0.0f), {at(-0.5f), at(0.5f)}));
}

std::vector<float> blurred(Settings settings, int threads) {
  settings.threads = threads;
  Session session(settings);
  session.start(passing_room());
  const Progress progress = session.wait(30.0);
  EXPECT_EQ(progress.status, Status::DONE) << progress.error;
  EXPECT_EQ(progress.frames_done, settings.samples);
  return session.read(Pass::COMBINED);
}

TEST(Shutter, PicturesAreTheSameForAnyNumberOfThreads) {
  Settings paths = small_settings(40, 24, 6), shared = paths;
  shared.indirect = IndirectAnswer::CELL_SHARED;
  shared.path_sharing.temporal_reuse = false;
  shared.direct = DirectAnswer::LEARNED;
  shared.guiding = Guiding::ON;
  for (const Settings& settings : {paths, shared}) {
    const std::vector<float> one = blurred(settings, 1);
    EXPECT_EQ(one, blurred(settings, 3));
    Session still(settings);
    still.start(passing_room()->middle());
    still.wait(30.0);
    EXPECT_NE(one, still.read(Pass::COMBINED));
  }
}

TEST(Shutter, IsRefusedWhereSamplesAreKept) {
  Settings settings = small_settings();
  settings.indirect = IndirectAnswer::SCREEN_REUSE;
  EXPECT_FALSE(Session::can_blur_motion(settings));
  Session session(settings);
  EXPECT_THROW(session.start(passing_room()), Error);
}

}  // namespace
}  // namespace cistern::test
