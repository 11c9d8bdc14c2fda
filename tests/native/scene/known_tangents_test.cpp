#include "scene/known_tangents.h"

#include <gtest/gtest.h>

#include "scene/shutter.h"
#include "shading/displaced_scene.h"
#include "shading/nodes_scene.h"
#include "shading/program_builder.h"

namespace cistern {
namespace {

/// Reads the tangents of a UV map; "" is the first.
MaterialProgram reader(const std::string& map, bool is_displaced = false) {
  test::ProgramBuilder b;
  b.program.attribute_names = {map};
  const Operand tangent = b.add(Op::TANGENT, {}, {0});
  if (is_displaced)
    b.add(Op::CLOSURE_DISPLACEMENT, {b.constant(1.0f), tangent}, {0});
  else
    b.add(Op::CLOSURE_EMISSION, {b.constant(1.0f), tangent, b.constant(1.0f)});
  return b.program;
}

struct Shown {
  SceneBuilder builder;
  int mesh = builder.add_mesh(std::shared_ptr<const Mesh>(test::make_triangle()));
  int instance = -1;

  /// Places the mesh, with one material.
  void show(const MaterialProgram& program) {
    Instance placed;
    placed.mesh = mesh;
    placed.material_set = builder.add_material_set({builder.add_material(program)}, "set");
    placed.object = builder.add_object_name("object");
    placed.key = 7;
    instance = builder.add_instance(placed, instance < 0 ? std::nullopt : std::optional(instance));
  }
  /// Of the shown mesh.
  const CornerTangents* tangents(const Scene& scene, int attribute) const {
    return scene.find_tangents(scene.instances[0].mesh, attribute, false);
  }
};

TEST(KnownTangents, AreOfTheMapsThatMaterialsRead) {
  Shown shown;
  shown.show(MaterialProgram{});
  EXPECT_TRUE(shown.builder.snapshot()->tangents.empty());
  shown.show(reader("Mirrored"));
  const auto scene = shown.builder.snapshot();
  EXPECT_EQ(shown.tangents(*scene, 0), nullptr);
  ASSERT_NE(shown.tangents(*scene, 1), nullptr);
  EXPECT_EQ(*shown.tangents(*scene, 1), corner_tangents(*test::make_triangle(), 1));
  shown.show(reader(""));
  EXPECT_NE(shown.tangents(*shown.builder.snapshot(), 0), nullptr);
  for (const char* name : {"Missing", "Tint"}) {  // a colour has four components: its first two are taken
    shown.show(reader(name));
    EXPECT_EQ(shown.tangents(*shown.builder.snapshot(), 2) != nullptr, name == std::string("Tint"));
  }
}

TEST(KnownTangents, AreFoundOnceForAMesh) {
  Shown shown;
  shown.show(reader(""));
  const auto first = shown.builder.snapshot();
  EXPECT_EQ(shown.tangents(*shown.builder.snapshot(), 0), shown.tangents(*first, 0));
  EXPECT_EQ(shown.tangents(*SceneBuilder(*first).snapshot(), 0), shown.tangents(*first, 0));
  auto other = test::make_triangle();
  other->positions[1].x = 3.0f;
  shown.mesh = shown.builder.add_mesh(std::shared_ptr<const Mesh>(other));
  shown.show(reader(""));
  EXPECT_NE(shown.tangents(*shown.builder.snapshot(), 0), shown.tangents(*first, 0));
}

TEST(KnownTangents, DisplacementReadsThoseBeforeIt) {
  Shown shown;
  shown.show(reader("", true));
  const auto scene = displaced_snapshot(shown.builder).scene;
  const Mesh& moved = *scene->meshes[static_cast<size_t>(scene->instances[0].mesh)];
  for (size_t v = 0; v < 3; ++v)
    EXPECT_NEAR(moved.positions[v].x, test::make_triangle()->positions[v].x + 1.0f, 1e-4f) << v;
  EXPECT_NE(shown.tangents(*scene, 0), nullptr);
}

TEST(KnownTangents, OfBentMeshesAreThoseOfTheMiddle) {
  const auto bent = [](float height) {
    auto mesh = test::make_triangle();
    mesh->positions[1].z = height;
    Shown shown;
    shown.mesh = shown.builder.add_mesh(std::shared_ptr<const Mesh>(mesh));
    shown.show(reader(""));
    return shown.builder.snapshot();
  };
  const auto middle = bent(1.0f);
  const std::array<std::shared_ptr<const Scene>, 2> ends{bent(0.0f), bent(2.0f)};
  const auto opened = Shutter(middle, ends).at(0.1f);
  const int mesh = middle->instances[0].mesh;
  EXPECT_NE(opened->meshes[static_cast<size_t>(mesh)], middle->meshes[static_cast<size_t>(mesh)]);
  ASSERT_NE(middle->find_tangents(mesh, 0, false), nullptr);
  EXPECT_EQ(opened->find_tangents(mesh, 0, false), middle->find_tangents(mesh, 0, false));
}

}  // namespace
}  // namespace cistern
