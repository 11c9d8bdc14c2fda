#include "scene/scene_builder.h"

#include <gtest/gtest.h>

#include <functional>

#include "base/check.h"

namespace cistern::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// The text of the Error that `action` raises; empty without one.
std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// A square of two quads with every kind of data, and room to spoil it.
struct SquareMesh {
  std::vector<Vec3> positions{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}};
  std::vector<int32_t> corner_vertices{0, 1, 4, 3, 1, 2, 5, 4};
  std::vector<int32_t> offsets{0, 4, 8};
  std::vector<int32_t> material_indices;
  std::vector<Vec3> normals;
  std::vector<uint8_t> sharp_faces;
  Domain normals_domain = Domain::FACE;
  std::vector<MeshAttribute> attributes;

  MeshInput input() const {
    MeshInput input;
    input.name = "Square";
    input.positions = positions;
    input.corner_vertices = corner_vertices;
    input.polygon_offsets = offsets;
    input.material_indices = material_indices;
    input.normals = normals;
    input.normals_domain = normals_domain;
    input.sharp_faces = sharp_faces;
    input.attributes = attributes;
    return input;
  }
};

std::shared_ptr<const float[]> values(std::vector<float> v) {
  const auto owner = std::make_shared<std::vector<float>>(std::move(v));
  return {owner, owner->data()};
}

const Mesh& built(SceneBuilder& builder, const SquareMesh& square) {
  const int handle = builder.add_mesh(square.input());
  return *builder.snapshot()->meshes[static_cast<size_t>(handle)];
}

Instance instance_of(int mesh, int set, int object) {
  Instance instance;
  instance.mesh = mesh;
  instance.material_set = set;
  instance.object = object;
  return instance;
}

/// A builder with one mesh, one material set and one object, all with handle 0.
SceneBuilder one_object() {
  SceneBuilder builder;
  builder.add_mesh(SquareMesh{}.input());
  builder.add_material_set({}, "Cube");
  builder.add_object_name("Cube");
  return builder;
}

TEST(BuildMesh, StoresCornersOnlyWhenNeeded) {
  SceneBuilder builder;
  SquareMesh square;
  EXPECT_TRUE(built(builder, square).corners.empty());
  square.attributes = {{"Color", Domain::POINT, 3, values(std::vector<float>(18)), 0}};
  EXPECT_TRUE(built(builder, square).corners.empty());
  square.attributes.push_back({"UVMap", Domain::CORNER, 2, values(std::vector<float>(16)), 0});
  const Mesh& mesh = built(builder, square);
  ASSERT_EQ(mesh.corners.size(), 4u);
  EXPECT_EQ(mesh.corners[2], (TriangleIndices{4, 5, 6}));
  EXPECT_EQ(mesh.corner_count, 8u);
}

TEST(BuildMesh, LeavesRoomBehindThePositions) {
  SceneBuilder builder;
  const Mesh& mesh = built(builder, SquareMesh{});
  EXPECT_GT(mesh.positions.capacity(), mesh.positions.size());
}

TEST(BuildMesh, ExpandsFaceAttributesToCorners) {
  SceneBuilder builder;
  SquareMesh square;
  square.attributes = {{"Id", Domain::FACE, 1, values({7.0f, 9.0f}), 0}};
  const Mesh& mesh = built(builder, square);
  EXPECT_EQ(mesh.attributes[0].domain, Domain::CORNER);
  for (size_t c = 0; c < 8; ++c) EXPECT_EQ(mesh.attributes[0].values[c], c < 4 ? 7.0f : 9.0f);
}

TEST(BuildMesh, SharpFacesAreFlatAmongPointNormals) {
  SceneBuilder builder;
  SquareMesh square;
  const Vec3 tilted = normalize({1.0f, 0.0f, 1.0f});
  square.normals_domain = Domain::POINT;
  square.normals.assign(6, tilted);
  EXPECT_EQ(built(builder, square).normals_domain, Domain::POINT);
  square.sharp_faces = {0, 1};
  const Mesh& mixed = built(builder, square);
  EXPECT_EQ(mixed.normals_domain, Domain::POINT);
  for (size_t t = 0; t < 4; ++t) EXPECT_EQ(mixed.is_flat(t), t >= 2);
  for (const uint32_t code : mixed.normals) EXPECT_LT(length(decode_octahedral(code) - tilted), 1e-4f);
  square.sharp_faces = {1, 1};
  EXPECT_EQ(built(builder, square).normals_domain, Domain::FACE);
}

TEST(BuildMesh, CornerNormalsAreThereThoughFacesAreSharp) {
  SceneBuilder builder;
  SquareMesh square;
  square.normals_domain = Domain::CORNER;
  square.normals.assign(8, normalize({1.0f, 0.0f, 1.0f}));
  square.sharp_faces = {0, 1};
  EXPECT_FALSE(built(builder, square).is_flat(3));
}

TEST(BuildMesh, NormalsWithoutDirectionBecomeUnitOnes) {
  SceneBuilder builder;
  SquareMesh square;
  square.normals_domain = Domain::POINT;
  square.normals = {{0, 0, 0}, {kNan, 0, 1}, {INFINITY, 0, 0}, {0, 0, 5}, {0, 1e-30f, 0}, {1, 0, 0}};
  for (const uint32_t code : built(builder, square).normals) EXPECT_NEAR(length(decode_octahedral(code)), 1.0f, 1e-5f);
}

TEST(BuildMesh, MaterialSlotsFollowPolygons) {
  SceneBuilder builder;
  SquareMesh square;
  square.material_indices = {0, 0};
  EXPECT_TRUE(built(builder, square).material_slots.empty());
  square.material_indices = {-1, 3};
  EXPECT_EQ(built(builder, square).material_slots, (std::vector<uint16_t>{0, 0, 3, 3}));
  square.material_indices = {1 << 20, 0};
  EXPECT_EQ(built(builder, square).material_slots[0], UINT16_MAX);
}

TEST(BuildMesh, EmptyAndLooseMeshesAreAllowed) {
  SceneBuilder builder;
  MeshInput empty;
  empty.name = "Empty";
  EXPECT_EQ(builder.add_mesh(empty), 0);
  SquareMesh loose;
  loose.corner_vertices.clear();
  loose.offsets.clear();
  EXPECT_EQ(built(builder, loose).triangle_count(), 0u);
  loose.offsets = {0};
  EXPECT_EQ(built(builder, loose).triangle_count(), 0u);
  loose.normals_domain = Domain::CORNER;
  EXPECT_EQ(built(builder, loose).triangle_count(), 0u);
}

TEST(BuildMesh, BoundsIgnoreWhatIsNotFinite) {
  SceneBuilder builder;
  SquareMesh square;
  square.positions[5] = {kNan, 1.0f, 0.0f};
  const Mesh& mesh = built(builder, square);
  EXPECT_EQ(mesh.dropped_triangles, 2u);
  EXPECT_EQ(mesh.bounds.upper, (Vec3{2.0f, 1.0f, 0.0f}));
}

TEST(BuildMesh, WrongLengthsAreNamed) {
  SceneBuilder builder;
  SquareMesh bad;
  bad.normals_domain = Domain::POINT;
  bad.normals.resize(5);
  const auto add = [&] { builder.add_mesh(bad.input()); };
  EXPECT_EQ(error_of(add), "Square: normals of domain POINT have 5 elements: must have 6");
  bad.normals_domain = Domain::CORNER;
  EXPECT_TRUE(contains(error_of(add), "must have 8"));
  bad.normals_domain = Domain::FACE;
  EXPECT_TRUE(contains(error_of(add), "must have 0"));
  bad = {};
  bad.material_indices = {0};
  EXPECT_TRUE(contains(error_of(add), "material indices have 1 elements: must have 2"));
  bad = {};
  bad.sharp_faces = {0, 0, 0};
  EXPECT_TRUE(contains(error_of(add), "sharp faces have 3 elements: must have 2"));
  bad = {};
  bad.attributes = {{"UVMap", Domain::CORNER, 5, values({0.0f}), 0}};
  EXPECT_TRUE(contains(error_of(add), "attribute \"UVMap\" has 5 components"));
  bad.attributes = {{"UVMap", Domain::CORNER, 2, nullptr, 0}};
  EXPECT_TRUE(contains(error_of(add), "attribute \"UVMap\" has no values"));
  bad = {};
  bad.corner_vertices[2] = 99;
  EXPECT_TRUE(contains(error_of(add), "Square: vertex of corner 2 is 99"));
  EXPECT_TRUE(builder.snapshot()->meshes.empty());
}

TEST(SceneBuilder, HandlesAreStableAndUntouchedPartsShared) {
  SceneBuilder builder = one_object();
  const int second = builder.add_mesh(SquareMesh{}.input());
  builder.add_instance(instance_of(0, 0, 0));
  const std::shared_ptr<const Scene> before = builder.snapshot();
  EXPECT_EQ(builder.add_mesh(SquareMesh{}.input(), second), second);
  EXPECT_EQ(builder.snapshot()->meshes[1], before->meshes[1]) << "replaced by its equal";
  SquareMesh other;
  other.positions[0].x = 0.25f;
  EXPECT_EQ(builder.add_mesh(other.input(), second), second);
  builder.add_light({"Lamp", PointLight{}});
  const std::shared_ptr<const Scene> after = builder.snapshot();
  EXPECT_EQ(before->meshes[0], after->meshes[0]);
  EXPECT_NE(before->meshes[1], after->meshes[1]);
  EXPECT_EQ(before->materials[0], after->materials[0]);
  EXPECT_TRUE(before->lights.empty());
  builder.remove_mesh(0);
  EXPECT_EQ(builder.snapshot()->meshes[0], nullptr);
  EXPECT_NE(before->meshes[0], nullptr);
  EXPECT_TRUE(contains(error_of([&] { builder.add_mesh(SquareMesh{}.input(), 7); }), "mesh handle is 7"));
  EXPECT_TRUE(contains(error_of([&] { builder.remove_instance(-1); }), "instance handle is -1"));
}

TEST(SceneBuilder, EmptySetsGetTheDefaultMaterialOnce) {
  SceneBuilder builder;
  builder.add_material_set({}, "A");
  builder.add_material_set({-1, -1}, "B");
  const std::shared_ptr<const Scene> scene = builder.snapshot();
  EXPECT_EQ(scene->materials.size(), 1u);
  EXPECT_EQ(scene->material_sets[0], std::vector<int>{0});
  EXPECT_EQ(scene->material_sets[1], (std::vector<int>{0, 0}));
  EXPECT_EQ(error_of([&] {
              builder.add_material_set({0, 4}, "Cube");
            }),
            "Cube: material handle is 4: must be at least 0 and less than 1");
}

TEST(SceneBuilder, InstanceMatricesAreChecked) {
  SceneBuilder builder = one_object();
  Instance instance = instance_of(0, 0, 0);
  instance.object_to_world.translation.y = kNan;
  EXPECT_EQ(error_of([&] { builder.add_instance(instance); }), "Cube: matrix row 2 column 4 is nan: must be finite");
  EXPECT_TRUE(builder.snapshot()->instances.empty());
  instance.object_to_world = {};
  instance.object_to_world.row_x.x = -1.0f;
  EXPECT_EQ(builder.snapshot()->instances.size(), 0u);
  EXPECT_EQ(builder.add_instance(instance), 0);
  EXPECT_EQ(builder.singular_instances(), 0);
  EXPECT_EQ(builder.snapshot()->instances[0].mesh, 0);
}

TEST(SceneBuilder, SingularInstancesAreLeftOutAndCounted) {
  SceneBuilder builder = one_object();
  Instance flat = instance_of(0, 0, 0);
  flat.object_to_world.row_z.z = 0.0f;
  Instance sheared = instance_of(0, 0, 0);
  sheared.object_to_world.row_x = {0.3f, 0.6f, 0.1f};
  sheared.object_to_world.row_y = {0.7f, 1.4f, 0.2f};
  sheared.object_to_world.row_z = {0.1f, 0.2f, 0.9f};
  Instance vanishing = instance_of(0, 0, 0);
  vanishing.object_to_world = {{1e-20f, 0, 0}, {0, 1e-20f, 0}, {0, 0, 1e-20f}, {}};
  Instance thin = instance_of(0, 0, 0);
  thin.object_to_world.row_z.z = 1e-7f;
  for (const Instance& i : {flat, sheared, vanishing, thin}) builder.add_instance(i);
  EXPECT_EQ(builder.singular_instances(), 3);
  EXPECT_EQ(builder.snapshot()->instances[0].mesh, -1);
  EXPECT_EQ(builder.snapshot()->instances[3].mesh, 0);
  builder.add_instance(thin, 0);
  EXPECT_EQ(builder.singular_instances(), 2);
  builder.remove_instance(1);
  builder.remove_instance(3);
  builder.remove_instance(3);
  EXPECT_EQ(builder.singular_instances(), 1);
  builder.clear_instances();
  EXPECT_EQ(builder.singular_instances(), 0);
}

TEST(SceneBuilder, InstancesReferToWhatExists) {
  SceneBuilder builder = one_object();
  const auto add = [&](Instance i) { return error_of([&] { builder.add_instance(i); }); };
  EXPECT_EQ(add(instance_of(3, 0, 0)), "Cube: mesh handle is 3: must be at least 0 and less than 1");
  EXPECT_TRUE(contains(add(instance_of(0, -1, 0)), "material set handle is -1"));
  EXPECT_TRUE(contains(add(instance_of(0, 0, 8)), "object handle is 8"));
  EXPECT_TRUE(contains(error_of([&] { builder.add_instance(instance_of(0, 0, 0), 0); }), "instance handle is 0"));
}

TEST(SceneBuilder, LightsAreChecked) {
  SceneBuilder builder;
  const auto add = [&](Light light) { return error_of([&] { builder.add_light(std::move(light)); }); };
  PointLight point;
  point.intensity = Rgb(1.0f, kNan, 1.0f);
  EXPECT_EQ(add({"Lamp", point}), "Lamp: energy is nan: must be finite");
  point = {};
  point.radius = -1.0f;
  EXPECT_EQ(add({"Lamp", point}), "Lamp: radius is -1: must be finite and not negative");
  SunLight sun;
  EXPECT_EQ(add({"Sun", sun}), "Sun: length of direction is 0: must be greater than 0");
  sun.direction = {0, 0, 1};
  sun.irradiance = Rgb(INFINITY);
  EXPECT_EQ(add({"Sun", sun}), "Sun: energy is inf: must be finite");
  AreaLight area;
  area.normal = {0, 0, -1};
  area.edge_u = {kNan, 0, 0};
  EXPECT_EQ(add({"Area", area}), "Area: size is nan: must be finite");
  SpotLight spot;
  spot.world_to_local.row_x.x = kNan;
  EXPECT_TRUE(contains(add({"Spot", spot}), "Spot: matrix row 1 column 1 is nan"));
  Light tinted{"Tinted", PointLight{}};
  tinted.material = 2;
  EXPECT_TRUE(contains(add(tinted), "Tinted: material handle is 2"));
  EXPECT_TRUE(builder.snapshot()->lights.empty());
  point = {};
  point.intensity = Rgb(-1.0f);
  EXPECT_EQ(add({"Dark", point}), "");
}

TEST(SceneBuilder, RemovedLightsCanBeReplaced) {
  SceneBuilder builder;
  const int handle = builder.add_light({"Lamp", PointLight{}});
  builder.remove_light(handle);
  EXPECT_TRUE(builder.snapshot()->lights[0].removed);
  builder.add_light({"Lamp", PointLight{}}, handle);
  EXPECT_FALSE(builder.snapshot()->lights[0].removed);
}

TEST(SceneBuilder, CamerasAreChecked) {
  SceneBuilder builder;
  const auto set = [&](const std::function<void(Camera&)>& spoil) {
    Camera camera;
    spoil(camera);
    return error_of([&] { builder.set_camera(camera, "Camera"); });
  };
  EXPECT_EQ(set([](Camera&) {}), "");
  EXPECT_EQ(set([](Camera& c) { c.right = c.left; }), "Camera: size of window width is 0: must be greater than 0");
  EXPECT_TRUE(contains(set([](Camera& c) { c.top = kNan; }), "window height is nan"));
  EXPECT_TRUE(contains(set([](Camera& c) { c.clip_end = c.clip_start = 1.0f; }), "clip end is 1"));
  EXPECT_TRUE(contains(set([](Camera& c) { c.clip_start = -1.0f; }), "clip start is -1"));
  EXPECT_TRUE(contains(set([](Camera& c) { c.aperture_radius = kNan; }), "aperture radius is nan"));
  EXPECT_TRUE(contains(set([](Camera& c) { c.aperture_radius = 1.0f, c.focus_distance = 0.0f; }), "focus distance"));
  EXPECT_TRUE(contains(set([](Camera& c) { c.aperture_ratio = 0.0f; }), "aperture ratio is 0"));
  EXPECT_TRUE(contains(set([](Camera& c) { c.camera_to_world.row_x.x = 0.0f; }), "determinant of its matrix is 0"));
  const auto far_away = [](Camera& c) {
    c.camera_to_world.row_x = {0.6f, 0.8f, 0.0f};
    c.camera_to_world.row_y = {0.8f, -0.6f, 0.0f};
    c.camera_to_world.translation = {3e38f, 3e38f, 0.0f};
  };
  const auto flat = [](Camera& c) { c.camera_to_world.row_z = c.camera_to_world.row_y = {0.1f, 0.7f, 0.7f}; };
  EXPECT_TRUE(contains(set(flat), "determinant of its matrix is"));
  EXPECT_TRUE(contains(set(far_away), "distance from the origin is"));
  EXPECT_TRUE(contains(set([](Camera& c) { c.camera_to_world.translation.x = kNan; }), "matrix row 1 column 4"));
}

TEST(SceneBuilder, ImagesAreChecked) {
  SceneBuilder builder;
  const auto add = [&](int width, int height, int channels, bool with_pixels) {
    Image image;
    image.name = "Texture";
    image.width = width;
    image.height = height;
    image.channels = channels;
    if (with_pixels) image.pixels = std::make_shared<const int>(0);
    return error_of([&] { builder.add_image(std::move(image)); });
  };
  EXPECT_EQ(add(1, 1, 4, true), "");
  EXPECT_EQ(add(0, 1, 4, true), "Texture: is 0 x 1 pixels: must be at least 1 x 1");
  EXPECT_EQ(add(1, 1, 5, true), "Texture: has 5 channels: must have 1 to 4");
  EXPECT_EQ(add(1, 1, 4, false), "Texture: has no pixels");
}

TEST(SceneBuilder, EnvironmentRefersToAMaterial) {
  SceneBuilder builder;
  Environment environment;
  environment.material = 0;
  EXPECT_EQ(error_of([&] { builder.set_environment(environment); }),
            "World: material handle is 0: must be at least 0 and less than 0");
  environment.material = -1;
  builder.set_environment(environment);
}

}  // namespace
}  // namespace cistern::test
