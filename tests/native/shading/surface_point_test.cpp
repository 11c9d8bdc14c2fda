#include "shading/surface_point.h"

#include <gtest/gtest.h>

#include "base/frame.h"
#include "shading/nodes_scene.h"

namespace cistern {
namespace {

void expect_near(Vec3 found, Vec3 expected, float tolerance = 1e-5f) {
  EXPECT_NEAR(found.x, expected.x, tolerance);
  EXPECT_NEAR(found.y, expected.y, tolerance);
  EXPECT_NEAR(found.z, expected.z, tolerance);
}

const Transform kMirror{{-1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, {}};
const Vec3 kDown{0.2f, 0.1f, -1.0f};

TEST(SurfacePoint, FrontAndBack) {
  const Scene scene = test::make_scene(test::make_triangle());
  const SurfacePoint front = test::point_at(scene, {0.25f, 0.5f}, kDown);
  expect_near(front.position, {0.5f, 0.5f, 0.0f});
  expect_near(front.ng, {0.0f, 0.0f, 1.0f});
  EXPECT_FALSE(front.is_backface);
  EXPECT_GT(dot(front.wo, front.ng), 0.0f);
  const SurfacePoint back = test::point_at(scene, {0.25f, 0.5f}, -kDown);
  expect_near(back.ng, {0.0f, 0.0f, -1.0f});
  expect_near(back.ns, back.ng);
  EXPECT_TRUE(back.is_backface);
}

TEST(SurfacePoint, MirroredInstanceKeepsItsOutside) {
  const Scene scene = test::make_scene(test::make_triangle(), kMirror);
  const SurfacePoint point = test::point_at(scene, {0.25f, 0.5f}, kDown);
  expect_near(point.position, {-0.5f, 0.5f, 0.0f});
  EXPECT_FALSE(point.is_backface);
  expect_near(point.ng, {0.0f, 0.0f, 1.0f});
}

TEST(SurfacePoint, NormalsGoByTheInverseTranspose) {
  auto mesh = test::make_triangle();
  const Vec3 n = normalize(Vec3{1.0f, 0.0f, 1.0f});
  mesh->normals_domain = Domain::POINT;
  mesh->normals.assign(3, encode_octahedral(n));
  const Transform stretch{{4.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, {}};
  for (const bool is_mirrored : {false, true}) {
    Transform m = stretch;
    if (is_mirrored) m.row_x.x = -4.0f;
    const Scene scene = test::make_scene(mesh, m);
    const Vec3 expected = normalize(Vec3{is_mirrored ? -0.25f : 0.25f, 0.0f, 1.0f});
    expect_near(test::point_at(scene, {0.2f, 0.2f}, kDown).ns, expected, 1e-4f);
    expect_near(test::point_at(scene, {0.2f, 0.2f}, -kDown).ns, -expected, 1e-4f);
  }
}

TEST(SurfacePoint, TangentFrameFollowsTheUvMap) {
  for (const bool is_mirrored_instance : {false, true})
    for (const int attribute : {0, 1})
      for (const Vec3 view : {kDown, -kDown}) {
        const Scene scene = test::make_scene(test::make_triangle(), is_mirrored_instance ? kMirror : Transform{});
        const auto frame = tangent_frame(scene, test::point_at(scene, {0.2f, 0.2f}, view), attribute);
        ASSERT_TRUE(frame);
        expect_near(frame->tangent, {attribute == 1 ? -1.0f : 1.0f, 0.0f, 0.0f});
        expect_near(frame->bitangent, {0.0f, 1.0f, 0.0f});
        expect_near(frame->normal, {0.0f, 0.0f, 1.0f});  // outside, from both sides
      }
}

TEST(SurfacePoint, TangentFrameDoesNotKnowTheTransform) {
  auto mesh = test::make_triangle();
  mesh->normals_domain = Domain::POINT;
  mesh->normals.assign(3, encode_octahedral(normalize(Vec3{0.4f, 0.3f, 1.0f})));
  const Transform m{{3.0f, 0.3f, 0.0f}, {0.2f, -0.5f, 0.1f}, {0.5f, 0.0f, 1.0f}, {3.0f, 2.0f, 1.0f}};
  const Scene plain = test::make_scene(mesh), moved = test::make_scene(mesh, m);
  const auto expected = tangent_frame(plain, test::point_at(plain, {0.2f, 0.2f}, kDown), 0);
  const auto found = tangent_frame(moved, test::point_at(moved, {0.2f, 0.2f}, kDown), 0);
  ASSERT_TRUE(expected && found);
  expect_near(found->tangent, expected->tangent);
  expect_near(found->bitangent, expected->bitangent);
  expect_near(found->normal, expected->normal);
  EXPECT_NEAR(dot(found->tangent, found->normal), 0.0f, 1e-5f);
}

TEST(SurfacePoint, OnlyWhatMaterialsReadHasTangents) {
  Scene scene = test::make_scene(test::make_triangle());
  const SurfacePoint point = test::point_at(scene, {0.2f, 0.2f}, kDown);
  EXPECT_TRUE(tangent_frame(scene, point, 0));
  EXPECT_FALSE(tangent_frame(scene, point, 0, true));
  EXPECT_FALSE(tangent_frame(scene, point, 2));
  EXPECT_FALSE(tangent_frame(scene, point, -1));
  scene.tangents.clear();
  EXPECT_FALSE(tangent_frame(scene, point, 0));
}

/// What neither the mesh's normal nor its tangent is: of unit length in between.
TEST(SurfacePoint, TangentFramesAreNotNormalised) {
  auto mesh = test::make_triangle();
  mesh->normals_domain = Domain::POINT;
  for (const Vec3 n : {Vec3{0, 0, 1}, Vec3{0, 0.6f, 0.8f}, Vec3{0.6f, 0, 0.8f}})
    mesh->normals.push_back(encode_octahedral(n));
  const Scene scene = test::make_scene(mesh);
  const auto frame = tangent_frame(scene, test::point_at(scene, {0.25f, 0.25f}, kDown), 0);
  ASSERT_TRUE(frame);
  expect_near(frame->normal, {0.15f, 0.15f, 0.9f}, 1e-4f);
  expect_near(frame->tangent, 0.75f * Vec3{1, 0, 0} + 0.25f * Vec3{0.8f, 0, -0.6f}, 1e-4f);
  expect_near(frame->bitangent, cross(frame->normal, frame->tangent));
}

TEST(SurfacePoint, AttributesInterpolate) {
  const Scene scene = test::make_scene(test::make_triangle());
  const AttributeValue tint = surface_attribute(scene, test::point_at(scene, {0.25f, 0.5f}, kDown), 2);
  expect_near(tint.value, {0.25f, 0.5f, 0.0f});
  EXPECT_FLOAT_EQ(tint.alpha, 0.5f);
}

TEST(SurfacePoint, ShiftedWeightsLeadToTheShiftedPositionAndBackOnBackFaces) {
  const Transform m{{1.0f, 0.3f, 0.0f}, {0.2f, 2.0f, 0.1f}, {0.5f, 0.0f, 1.0f}, {3.0f, 2.0f, 1.0f}};
  const Scene scene = test::make_scene(test::make_triangle(), m);
  for (const Vec3 view : {kDown, -kDown}) {
    SurfacePoint point = test::point_at(scene, {0.25f, 0.5f}, view);
    point.footprint = 0.125f;
    for (const int step : {0, 1, 2}) {
      const BumpShift shift{step, 1.5f};
      const Vec2 b = shifted_barycentric(scene, point, shift);
      const Vec3 world_step = footprint_step(point, shift);
      expect_near(m.point({2.0f * b.x, b.y, 0.0f}), point.position + (point.is_backface ? -world_step : world_step));
      EXPECT_NEAR(length(world_step), step == 0 ? 0.0f : 1.5f * 0.125f, 1e-6f);
      EXPECT_NEAR(dot(world_step, point.ng), 0.0f, 1e-6f);
    }
  }
}

}  // namespace
}  // namespace cistern
