#include "shading/nodes_vector.h"

#include <gtest/gtest.h>

#include "base/frame.h"
#include "shading/nodes_scene.h"

namespace cistern {
namespace {

const Vec3 kDown{0.2f, 0.1f, -1.0f};
constexpr float kQuantised = 1e-4f;  // of directions in 32 bits

void expect_near(Vec3 found, Vec3 expected, float tolerance = 1e-5f) {
  EXPECT_NEAR(found.x, expected.x, tolerance);
  EXPECT_NEAR(found.y, expected.y, tolerance);
  EXPECT_NEAR(found.z, expected.z, tolerance);
}

// Rendered with Cycles 5.0.1: Mapping node on (1.37, 2.71, -0.63).
TEST(NodesVector, MappingEqualsCycles) {
  const Vec3 p{1.37f, 2.71f, -0.63f}, rotation{0.3f, 0.5f, 0.7f}, scale{1.0f, 2.0f, 3.0f};
  expect_near(mapping_node(0, p, {5.0f, 5.0f, 5.0f}, rotation, scale), {2.149279f, 10.09905f, 4.164278f});
  expect_near(mapping_node(1, p, {-5.0f, -5.0f, -5.0f}, rotation, scale), {6.539412f, 2.120244f, 2.546725f});
  expect_near(mapping_node(2, p, {9.0f, 9.0f, 9.0f}, rotation, scale), {-2.850721f, 5.09905f, -0.835722f});
  EXPECT_NEAR(length(mapping_node(3, p, {}, rotation, scale)), 1.0f, 1e-6f);
}

TEST(NodesVector, RotationsTurnAndTurnBack) {
  const Vec3 p{1.0f, 2.0f, 3.0f}, center{0.5f, 0.0f, 0.0f};
  expect_near(vector_rotate_node(3, false, {1.0f, 0.0f, 0.0f}, {}, {}, 0.5f * kPi, {}), {0.0f, 1.0f, 0.0f});
  expect_near(vector_rotate_node(1, false, {0.0f, 1.0f, 0.0f}, {}, {}, 0.5f * kPi, {}), {0.0f, 0.0f, 1.0f});
  expect_near(vector_rotate_node(2, false, {0.0f, 0.0f, 1.0f}, {}, {}, 0.5f * kPi, {}), {1.0f, 0.0f, 0.0f});
  for (int type = 0; type < 5; ++type) {
    const Vec3 axis{1.0f, 2.0f, -2.0f}, euler{0.3f, 0.5f, 0.7f};
    const Vec3 turned = vector_rotate_node(type, false, p, center, axis, 0.8f, euler);
    EXPECT_NEAR(length(turned - center), length(p - center), 1e-5f);
    expect_near(vector_rotate_node(type, true, turned, center, axis, 0.8f, euler), p);
  }
  EXPECT_EQ(vector_rotate_node(0, false, p, center, {}, 0.8f, {}), p);  // no axis, no rotation
}

TEST(NodesVector, TransformsRoundTripBetweenSpaces) {
  const Transform m{{1.0f, 0.3f, 0.0f}, {0.2f, 2.0f, 0.1f}, {0.5f, 0.0f, 1.0f}, {3.0f, 2.0f, 1.0f}};
  Scene scene = test::make_scene(test::make_triangle(), m);
  scene.camera.camera_to_world = {{0.0f, 0.0f, 1.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {1.0f, 2.0f, 3.0f}};
  const SurfacePoint point = test::point_at(scene, {0.2f, 0.2f}, kDown);
  const NodeContext c{scene, *scene.materials[0], point, {}};
  const Vec3 v = normalize(Vec3{0.3f, -0.5f, 0.8f});
  for (int kind = 0; kind < 3; ++kind)
    for (int from = 0; from < 3; ++from)
      for (int to = 0; to < 3; ++to)
        expect_near(vector_transform_node(c, kind, to, from, vector_transform_node(c, kind, from, to, v)), v);
  expect_near(vector_transform_node(c, 0, 1, 0, {1.0f, 1.0f, 1.0f}), m.point({1.0f, 1.0f, 1.0f}));
  // the camera looks along its -z = world -x: a point ahead has positive z in Blender's camera space
  expect_near(vector_transform_node(c, 0, 0, 2, {-4.0f, 2.0f, 3.0f}), {0.0f, 0.0f, 5.0f});
}

TEST(NodesVector, TangentSpaceNormalMap) {
  const Vec3 flat{0.5f, 0.5f, 1.0f};
  const Vec3 leaning{0.5f + 0.3f, 0.5f + 0.2f, 0.5f + 0.5f * std::sqrt(1.0f - 0.36f - 0.16f)};
  MaterialProgram program;
  program.attribute_names = {"", "Mirrored", "Missing"};
  for (const std::string& name : program.attribute_names) program.attribute_hashes.push_back(attribute_name_hash(name));
  const Scene scene = test::make_scene(test::make_triangle(), {}, program);
  for (const bool is_back : {false, true}) {
    const SurfacePoint point = test::point_at(scene, {0.2f, 0.2f}, is_back ? -kDown : kDown);
    const NodeContext c{scene, *scene.materials[0], point, {}};
    const float side = is_back ? -1.0f : 1.0f;
    const float z = std::sqrt(1.0f - 0.36f - 0.16f);
    const auto run = [&](int name, int directx, Vec3 color, float strength) {
      const int32_t parameters[4] = {0, name, directx, 0};
      return normal_map_node(c, parameters, color, strength, point.ns);
    };
    expect_near(run(0, 0, flat, 1.0f), point.ns);
    expect_near(run(0, 0, leaning, 1.0f), side * Vec3{0.6f, 0.4f, z});
    expect_near(run(0, 1, leaning, 1.0f), side * Vec3{0.6f, -0.4f, z});
    expect_near(run(1, 0, leaning, 1.0f), side * Vec3{-0.6f, 0.4f, z});
    expect_near(run(0, 0, leaning, 0.0f), point.ns);
    expect_near(run(2, 0, leaning, 1.0f), point.ns);
    const int32_t missing[4] = {0, 2, 0, 0};
    const Vec3 displaced = normalize(point.ns + Vec3{0.2f, 0.1f, 0.0f});
    expect_near(normal_map_node(c, missing, leaning, 1.0f, displaced), displaced);
  }
}

/// Of a surface that displacement tilted, by its own frame and by that before: linearly between both only where the
/// original is smooth.
TEST(NodesVector, NormalMapOfDisplacedSurfaces) {
  MaterialProgram program;
  program.attribute_names = {""};
  program.attribute_hashes = {attribute_name_hash("")};
  Scene scene = test::make_scene(test::make_triangle(), {}, program);
  const Mesh original = *scene.meshes[0];
  for (const bool is_flat : {false, true}) {
    Mesh before = original, moved = original;
    before.normals_domain = moved.normals_domain = is_flat ? Domain::FACE : Domain::POINT;
    before.normals.assign(before.positions.size(), encode_octahedral({0.0f, 0.0f, 1.0f}));
    const Vec3 tilted = normalize(Vec3{0.0f, -0.6f, 0.8f});
    moved.normals.assign(moved.positions.size(), encode_octahedral(tilted));
    moved.undisplaced = std::make_shared<const Mesh>(before);
    scene.meshes[0] = std::make_shared<const Mesh>(moved);
    scene.tangents = {{{0, false, std::make_shared<const CornerTangents>(corner_tangents(moved, 0))},
                       {0, true, std::make_shared<const CornerTangents>(corner_tangents(before, 0))}}};
    SurfacePoint point = test::point_at(scene, {0.2f, 0.2f}, kDown);
    const NodeContext c{scene, *scene.materials[0], point, {}};
    const Vec3 leaning{0.8f, 0.5f, 0.9f};  // (0.6, 0, 0.8)
    const auto run = [&](int is_original, float strength) {
      const int32_t parameters[4] = {0, 0, 0, is_original};
      return normal_map_node(c, parameters, leaning, strength, point.ns);
    };
    const Vec3 now = is_flat ? point.ng : tilted, then = is_flat ? point.ng : Vec3{0.0f, 0.0f, 1.0f};
    const Vec3 across{1.0f, 0.0f, 0.0f};
    expect_near(run(0, 1.0f), 0.6f * across + 0.8f * now, kQuantised);
    expect_near(run(1, 1.0f), 0.6f * across + 0.8f * then, kQuantised);
    expect_near(run(0, 2.0f), normalize(1.2f * across + 0.8f * now), kQuantised);
    const Vec3 whole = 0.6f * across + 0.8f * then;
    expect_near(run(1, 2.0f),
                is_flat ? normalize(1.2f * across + 0.8f * then) : normalize(point.ns + 2.0f * (whole - point.ns)),
                kQuantised);
  }
}

TEST(NodesVector, TangentSpaceNormalMapUnderUnevenScale) {
  MaterialProgram program;
  program.attribute_names = {""};
  program.attribute_hashes = {attribute_name_hash("")};
  const Vec3 in_object = normalize(Vec3{0.6f, 0.4f, 0.7f});
  const Vec3 color = 0.5f * (in_object + Vec3{1.0f, 1.0f, 1.0f});
  const int32_t parameters[4] = {0, 0, 0, 0};
  for (const Vec3 scale : {Vec3{3.0f, 1.0f, 1.0f}, Vec3{1.0f, 3.0f, 1.0f}, Vec3{1.0f, 1.0f, 0.2f}}) {
    const Transform m{{scale.x, 0.0f, 0.0f}, {0.0f, scale.y, 0.0f}, {0.0f, 0.0f, scale.z}, {}};
    const Scene scene = test::make_scene(test::make_triangle(), m, program);
    for (const bool is_back : {false, true}) {
      const SurfacePoint point = test::point_at(scene, {0.2f, 0.2f}, is_back ? -kDown : kDown);
      const NodeContext c{scene, *scene.materials[0], point, {}};
      const Vec3 n{in_object.x / scale.x, in_object.y / scale.y, in_object.z / scale.z};
      expect_near(normal_map_node(c, parameters, color, 1.0f, point.ns), (is_back ? -1.0f : 1.0f) * normalize(n));
    }
  }
}

TEST(NodesVector, BumpOfAPlaneWaveTiltsByItsSlope) {
  const Scene scene = test::make_scene(test::make_triangle());
  SurfacePoint point = test::point_at(scene, {0.2f, 0.2f}, kDown);
  point.footprint = 0.01f;
  // height = 0.5 x - 0.25 y: the normal of z = height is (-0.5, 0.25, 1)
  constexpr float kWidth = 0.5f;
  const auto height = [&](int step) {
    const Vec3 p = point.position + footprint_step(point, {step, kWidth});
    return 0.5f * p.x - 0.25f * p.y;
  };
  const BumpInput in{height(0), height(1), height(2), 1.0f, 1.0f, point.ns, kWidth};
  expect_near(bump_node(point, in, false), normalize(Vec3{-0.5f, 0.25f, 1.0f}), 1e-4f);
  expect_near(bump_node(point, in, true), normalize(Vec3{0.5f, -0.25f, 1.0f}), 1e-4f);
  BumpInput weak = in;
  weak.strength = 0.0f;
  expect_near(bump_node(point, weak, false), point.ns);
  point.footprint = 0.0f;
  expect_near(bump_node(point, in, false), point.ns);
}

TEST(NodesVector, FresnelAndLayerWeightHeadOn) {
  SurfacePoint point;
  point.wo = point.ng = point.ns = {0.0f, 0.0f, 1.0f};
  EXPECT_NEAR(fresnel_node(point, 1.5f, point.ns), 0.04f, 1e-6f);
  EXPECT_NEAR(layer_weight_fresnel_node(point, 0.5f, point.ns), 1.0f / 9.0f, 1e-6f);  // index 2
  EXPECT_NEAR(layer_weight_facing_node(point, 0.5f, point.ns), 0.0f, 1e-6f);
  const Vec3 tilted{std::sqrt(0.75f), 0.0f, 0.5f};
  EXPECT_NEAR(layer_weight_facing_node(point, 0.5f, tilted), 0.5f, 1e-6f);
  EXPECT_NEAR(layer_weight_facing_node(point, 0.25f, tilted), 1.0f - std::sqrt(0.5f), 1e-6f);
  EXPECT_NEAR(layer_weight_facing_node(point, 0.75f, tilted), 0.75f, 1e-6f);
  point.is_backface = true;  // from inside glass at 60 degrees: total internal reflection
  EXPECT_EQ(fresnel_node(point, 1.5f, tilted), 1.0f);
}

}  // namespace
}  // namespace cistern
