#include <gtest/gtest.h>

#include "scene/scene_builder.h"
#include "shading/mesh_interpolation.h"

namespace cistern::test {
namespace {

Transform stretched(float x) {
  Transform matrix;
  matrix.row_x.x = x;
  return matrix;
}

/// Instances of a triangle with another normal at each point.
class BlendNormals : public ::testing::Test {
 protected:
  int add_triangle() {
    const std::vector<Vec3> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
        normals{{0.6f, 0, 0.8f}, {0, 0.6f, 0.8f}, {0, 0, 1}};
    const std::vector<int32_t> corners{0, 1, 2};
    MeshInput input;
    input.name = "triangle";
    input.positions = positions;
    input.corner_vertices = corners;
    input.normals = normals;
    input.normals_domain = Domain::POINT;
    return builder_.add_mesh(input);
  }
  void add_instance(int mesh, const Transform& object_to_world) {
    Instance instance;
    instance.mesh = mesh;
    instance.material_set = builder_.add_material_set({}, "triangle");
    instance.object = builder_.add_object_name("triangle");
    instance.object_to_world = object_to_world;
    builder_.add_instance(instance);
  }
  bool is_in_world(size_t instance) {
    builder_.blend_normals_in_world();
    return builder_.scene().instances[instance].blends_world_normals;
  }

  SceneBuilder builder_;
};

TEST_F(BlendNormals, OfStretchedMeshesWithOneUser) {
  const int alone = add_triangle(), shared = add_triangle(), upright = add_triangle();
  Transform turned;
  turned.row_x = {0, -2, 0}, turned.row_y = {2, 0, 0}, turned.row_z = {0, 0, -2};
  add_instance(alone, stretched(3.0f));
  add_instance(shared, stretched(3.0f));
  add_instance(shared, stretched(2.0f));
  add_instance(upright, turned);
  EXPECT_TRUE(is_in_world(0));
  EXPECT_FALSE(is_in_world(1)) << "two users";
  EXPECT_FALSE(is_in_world(3)) << "angles stay";
  builder_.remove_instance(2);
  EXPECT_TRUE(is_in_world(1)) << "one is left";
}

TEST_F(BlendNormals, AreTransformedBeforeTheyAreInterpolated) {
  add_instance(add_triangle(), stretched(3.0f));
  ASSERT_TRUE(is_in_world(0));
  const Mesh& mesh = *builder_.scene().meshes[0];
  Instance instance = builder_.scene().instances[0];
  const auto at = [&](Vec2 barycentric) { return normalize(blend_world_normals(mesh, instance, 0, barycentric)); };
  const Vec3 corner = at({0, 0}), edge = at({0.5f, 0});
  const Vec3 first = normalize(Vec3{0.2f, 0, 0.8f}), second{0, 0.6f, 0.8f}, middle = normalize(first + second);
  EXPECT_NEAR(dot(corner, first), 1.0f, 1e-4f);
  EXPECT_NEAR(length(edge - middle), 0.0f, 1e-3f);
  instance.blends_world_normals = false;
  EXPECT_NEAR(length(at({0, 0}) - corner), 0.0f, 1e-4f);
  EXPECT_NEAR(length(at({0.5f, 0}) - normalize(Vec3{0.1f, 0.3f, 0.8f})), 0.0f, 1e-3f);
  EXPECT_GT(length(at({0.5f, 0}) - edge), 1e-2f);
}

}  // namespace
}  // namespace cistern::test
