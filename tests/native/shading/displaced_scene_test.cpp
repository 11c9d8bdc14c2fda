#include "shading/displaced_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "shading/displace_mesh.h"
#include "shading/program_builder.h"

namespace cistern {
namespace {

constexpr int kSide = 4;  // vertices along a side of the grid

/// Moves vertices by `vector` in world space.
MaterialProgram mover(const char* name, Vec3 vector, bool keeps_normals = false) {
  test::ProgramBuilder b;
  b.program.name = name;
  b.add(Op::CLOSURE_DISPLACEMENT, {b.constant(1.0f), b.constant(vector)}, {keeps_normals ? 1 : 0});
  return b.program;
}

/// Moves vertices up by their Object coordinate x squared, which bends a flat grid.
MaterialProgram bender(float scale = 1.0f) {
  test::ProgramBuilder b;
  b.program.name = "Bender";
  const Operand place = b.add(Op::OBJECT_COORDINATE, {}, {0});
  const Operand x = b.add(Op::SEPARATE_X, {place});
  const Operand square = b.add(Op::MATH, {x, x, b.constant(0.0f)}, {2, 0});
  const Operand scaled = b.add(Op::MATH, {square, b.constant(scale), b.constant(0.0f)}, {2, 0});
  const Operand vector = b.add(Op::COMBINE_XYZ, {b.constant(0.0f), b.constant(0.0f), scaled});
  b.add(Op::CLOSURE_DISPLACEMENT, {b.constant(1.0f), vector}, {0});
  return b.program;
}

/// A grid of quads in the xy plane from 0 to kSide - 1; polygons of odd number in slot 1 if there are `two_slots`.
int add_grid(SceneBuilder& builder, Domain domain, bool two_slots = false) {
  std::vector<Vec3> points;
  std::vector<int32_t> corners, offsets{0}, slots;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) points.push_back({static_cast<float>(x), static_cast<float>(y), 0.0f});
  for (int y = 0; y + 1 < kSide; ++y) {
    for (int x = 0; x + 1 < kSide; ++x) {
      const int first = x + y * kSide;
      for (const int corner : {first, first + 1, first + 1 + kSide, first + kSide}) corners.push_back(corner);
      slots.push_back(two_slots ? x : 0);
      offsets.push_back(static_cast<int32_t>(corners.size()));
    }
  }
  const std::vector<Vec3> normals(domain == Domain::POINT ? points.size() : corners.size(), {0.0f, 0.0f, 1.0f});
  MeshInput input;
  input.name = "grid";
  input.positions = points;
  input.corner_vertices = corners;
  input.polygon_offsets = offsets;
  input.material_indices = slots;
  input.normals_domain = domain;
  if (domain != Domain::FACE) input.normals = normals;
  return builder.add_mesh(input);
}

int add_instance(SceneBuilder& builder, int mesh, const std::vector<int>& materials, const Transform& place = {}) {
  Instance instance;
  instance.mesh = mesh;
  instance.material_set = builder.add_material_set(materials, "Object");
  instance.object = builder.add_object_name("Object");
  instance.object_to_world = place;
  return builder.add_instance(instance);
}

const Mesh& shown(const Scene& scene, size_t instance) {
  return *scene.meshes[static_cast<size_t>(scene.instances[instance].mesh)];
}

TEST(DisplacedScene, WithoutDisplacementSharesEverything) {
  SceneBuilder builder;
  const int mesh = add_grid(builder, Domain::POINT);
  add_instance(builder, mesh, {});
  const DisplacedScene displaced = displaced_snapshot(builder);
  EXPECT_EQ(displaced.scene->meshes, builder.scene().meshes);
  EXPECT_TRUE(displaced.scene->displaced_from.empty());
}

TEST(DisplacedScene, MovesInWorldSpace) {
  SceneBuilder builder;
  const int mesh = add_grid(builder, Domain::POINT);
  const Transform turned{{0.0f, -2.0f, 0.0f}, {2.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, {5.0f, 6.0f, 7.0f}};
  add_instance(builder, mesh, {builder.add_material(mover("Up", {0.0f, 4.0f, 3.0f}))}, turned);
  const Mesh& moved = shown(*displaced_snapshot(builder).scene, 0);
  for (size_t v = 0; v < moved.positions.size(); ++v) {
    const Vec3 by = turned.vector(moved.positions[v] - builder.scene().meshes[0]->positions[v]);
    EXPECT_LT(length(by - Vec3{0.0f, 4.0f, 3.0f}), 1e-5f);
  }
  EXPECT_EQ(moved.undisplaced, builder.scene().meshes[0]);
  EXPECT_NEAR(moved.bounds.lower.z, 3.0f, 1e-5f);
}

TEST(DisplacedScene, MakesSmoothNormalsAnewUnlessTheyAreKept) {
  for (const bool keeps : {false, true}) {
    SceneBuilder builder;
    const int mesh = add_grid(builder, Domain::POINT);
    MaterialProgram program = bender();
    program.instructions.back().parameters[0] = keeps ? 1 : 0;
    add_instance(builder, mesh, {builder.add_material(program)});
    const Mesh& moved = shown(*displaced_snapshot(builder).scene, 0);
    const Vec3 normal = decode_octahedral(moved.normals[kSide + 1]);  // at x = 1: slopes are 1 and 3 around it
    const Vec3 left = normalize({-1.0f, 0.0f, 1.0f}), right = normalize({-3.0f, 0.0f, 1.0f});
    if (keeps) {
      EXPECT_EQ(normal, (Vec3{0.0f, 0.0f, 1.0f}));
    } else {
      // Quads are cut along one diagonal: three triangles on each side at inner vertices.
      EXPECT_LT(length(normal - normalize(left + right)), 1e-3f);
    }
  }
}

TEST(DisplacedScene, FlatFacesStayFlatAndKeepTheirNormalsForBump) {
  SceneBuilder builder;
  const int mesh = add_grid(builder, Domain::FACE);
  add_instance(builder, mesh, {builder.add_material(mover("Both", {0.0f, 0.0f, 1.0f}, true))});
  const Mesh& moved = shown(*displaced_snapshot(builder).scene, 0);
  EXPECT_EQ(moved.normals_domain, Domain::FACE);
  EXPECT_EQ(moved.positions.size(), size_t{kSide * kSide});
  ASSERT_EQ(moved.undisplaced_normals.size(), size_t{kSide * kSide});
  for (const uint32_t normal : moved.undisplaced_normals)
    EXPECT_EQ(decode_octahedral(normal), (Vec3{0.0f, 0.0f, 1.0f}));
}

TEST(DisplacedScene, TheFirstTriangleThatMovesAVertexDecides) {
  SceneBuilder builder;
  const int mesh = add_grid(builder, Domain::POINT, true);
  const int up = builder.add_material(mover("Up", {0.0f, 0.0f, 1.0f}));
  const int still = builder.add_material(MaterialProgram{});
  const int down = builder.add_material(mover("Down", {0.0f, 0.0f, -1.0f}));
  add_instance(builder, mesh, {up, still, down});
  const Mesh& moved = shown(*displaced_snapshot(builder).scene, 0);
  for (size_t v = 0; v < moved.positions.size(); ++v)  // columns of quads: up, still, down
    EXPECT_EQ(moved.positions[v].z, v % kSide < 2 ? 1.0f : -1.0f);
}

TEST(DisplacedScene, InstancesShareOneMeshForEachSetOfMaterials) {
  SceneBuilder builder;
  const int mesh = add_grid(builder, Domain::POINT);
  const int up = builder.add_material(mover("Up", {0.0f, 0.0f, 1.0f}));
  const int down = builder.add_material(mover("Down", {0.0f, 0.0f, -1.0f}));
  for (const int material : {up, up, down, -1}) add_instance(builder, mesh, {material});
  const std::shared_ptr<const Scene> scene = displaced_snapshot(builder).scene;
  EXPECT_EQ(scene->instances[0].mesh, scene->instances[1].mesh);
  EXPECT_EQ(shown(*scene, 2).positions[0].z, -1.0f);
  EXPECT_EQ(&shown(*scene, 3), builder.scene().meshes[0].get());
  SceneBuilder later(*scene);  // goes on from the meshes as they were
  EXPECT_EQ(later.scene().meshes, builder.scene().meshes);
  EXPECT_EQ(later.scene().instances, builder.scene().instances);
}

TEST(DisplacedScene, IsMadeAgainOnlyWhenWhatItDependsOnChanges) {
  SceneBuilder builder;
  const int mesh = add_grid(builder, Domain::POINT);
  const int material = builder.add_material(bender());
  const int instance = add_instance(builder, mesh, {material});
  const auto snapshot = [&] { return displaced_snapshot(builder).scene; };
  const std::shared_ptr<const Scene> first = snapshot();

  MaterialProgram painted = bender();  // looks different, moves alike
  painted.pass_index = 7.0f;
  builder.add_material(painted, material);
  Instance moved = builder.scene().instances[0];
  moved.object_to_world.translation.x = 3.0f;
  builder.add_instance(moved, instance);
  EXPECT_EQ(&shown(*snapshot(), 0), &shown(*first, 0));

  builder.add_material(bender(2.0f), material);
  EXPECT_FLOAT_EQ(shown(*snapshot(), 0).positions[2].z, 8.0f);
  moved.object_to_world.row_z.z = 2.0f;
  builder.add_instance(moved, instance);
  EXPECT_FLOAT_EQ(shown(*snapshot(), 0).positions[2].z, 4.0f);
  builder.add_material(MaterialProgram{}, material);
  EXPECT_EQ(&shown(*snapshot(), 0), builder.scene().meshes[0].get());
  EXPECT_TRUE(builder.displaced_meshes().empty());
}

TEST(DisplacedScene, ComesApartWhereNormalsOfAPointDiffer) {
  SceneBuilder builder;
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<int32_t> corners{0, 1, 2, 0, 3, 1};  // two triangles at an edge of 90 degrees
  const Vec3 up{0, 0, 1}, back{0, 1, 0};
  const std::vector<Vec3> normals{up, up, up, back, back, back};
  MeshInput input;
  input.name = "edge";
  input.positions = points;
  input.corner_vertices = corners;
  input.normals_domain = Domain::CORNER;
  input.normals = normals;
  test::ProgramBuilder b;
  b.add(Op::CLOSURE_DISPLACEMENT, {b.constant(1.0f), b.add(Op::NORMAL, {})}, {0});
  add_instance(builder, builder.add_mesh(input), {builder.add_material(b.program)});
  const Mesh& moved = shown(*displaced_snapshot(builder).scene, 0);
  EXPECT_EQ(moved.positions.size(), 6u);
  for (const uint32_t v : moved.vertices[0]) EXPECT_NEAR(moved.positions[v].z, 1.0f, 1e-4f);
  for (const uint32_t v : moved.vertices[1]) EXPECT_NEAR(moved.positions[v].y, 1.0f, 1e-4f);
}

TEST(DisplacedScene, VerticesThatWouldLeaveStayAndAreCounted) {
  for (const float factor : {1e15f, 1e30f}) {  // squared: too far, not finite
    test::ProgramBuilder b;
    const Operand place = b.add(Op::OBJECT_COORDINATE, {}, {0});
    const Operand far = b.add(Op::VECTOR_MATH, {place, b.constant(factor), b.constant(0), b.constant(1)}, {2});
    const Operand beyond = b.add(Op::VECTOR_MATH, {far, far, b.constant(0), b.constant(1)}, {2});
    const Operand x = b.add(Op::SEPARATE_X, {beyond});
    const Operand vector = b.add(Op::COMBINE_XYZ, {b.constant(0), b.constant(0), x});
    b.add(Op::CLOSURE_DISPLACEMENT, {b.constant(1), vector}, {0});
    SceneBuilder builder;
    const int mesh = add_grid(builder, Domain::POINT);
    add_instance(builder, mesh, {builder.add_material(b.program)});
    for (int again = 0; again < 2; ++again) {  // also where it is kept
      const DisplacedScene displaced = displaced_snapshot(builder);
      for (const Vec3 p : shown(*displaced.scene, 0).positions) EXPECT_EQ(p.z, 0.0f);
      ASSERT_EQ(displaced.warnings.size(), 1u);
      EXPECT_EQ(displaced.warnings[0],
                "Object 'Object': displacement by material 'Clay' is not finite or too far at 12 vertices, which stay "
                "in place");
    }
  }
}

}  // namespace
}  // namespace cistern
