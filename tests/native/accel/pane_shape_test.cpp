#include "accel/pane_shape.h"

#include <gtest/gtest.h>

#include "accel/accel_scenes.h"

namespace cistern::test {
namespace {

/// The sides of a prism about the z axis.
std::shared_ptr<Mesh> prism(int sides) {
  std::vector<Vec3> positions;
  const auto corner = [&](int i, float z) {
    const float turn = 2.0f * kPi * static_cast<float>(i) / static_cast<float>(sides);
    return Vec3{std::cos(turn), std::sin(turn), z};
  };
  for (int i = 0; i < sides; ++i) {
    const Vec3 a = corner(i, 0), b = corner(i + 1, 0), c = corner(i + 1, 1), d = corner(i, 1);
    positions.insert(positions.end(), {a, b, c, a, c, d});
  }
  return make_mesh(std::move(positions));
}

/// Of glass, in the second slot of its set; the first is opaque.
bool is_pane(const std::shared_ptr<Mesh>& mesh, int set = 0) {
  const auto scene = std::make_shared<Scene>();
  const auto glass = std::make_shared<MaterialProgram>();
  glass->may_be_pane = true;
  scene->materials = {glass, std::make_shared<MaterialProgram>()};
  scene->material_sets = {{0}, {1, 0}};
  scene->object_names = {"object"};
  scene->meshes = {mesh};
  Instance instance;
  instance.mesh = instance.object = 0;
  instance.material_set = set;
  scene->instances = {instance};
  return has_pane_shape(*scene, instance) && Accel::build(scene)->may_be_pane(0);
}

void smooth(Mesh& mesh) {
  mesh.normals_domain = Domain::POINT;
  for (const Vec3 p : mesh.positions) mesh.normals.push_back(encode_octahedral(normalize({p.x, p.y, 0})));
}

TEST(PaneShape, BoxesAreAndRoundGlassIsNot) {
  EXPECT_TRUE(is_pane(prism(4)));
  EXPECT_TRUE(is_pane(prism(24)));
  EXPECT_FALSE(is_pane(prism(64)));
  EXPECT_FALSE(is_pane(prism(20000)));
}

TEST(PaneShape, SmoothShadingBendsWhatItShades) {
  const auto bent = prism(4), sharp = prism(4), flat = prism(4);
  for (Mesh* mesh : {bent.get(), sharp.get()}) smooth(*mesh);
  sharp->sharp_polygons.assign(sharp->triangle_count(), 1);
  flat->normals_domain = Domain::POINT;
  for (size_t i = 0; i < flat->triangle_count(); ++i) {
    const auto [a, b, c] = flat->triangle_positions(i);
    flat->normals.insert(flat->normals.end(), 3, encode_octahedral(normalize(cross(b - a, c - a))));
  }
  EXPECT_FALSE(is_pane(bent));
  EXPECT_TRUE(is_pane(sharp));
  EXPECT_TRUE(is_pane(flat)) << "normals of its own that are those of its faces";
}

TEST(PaneShape, GlassAloneCounts) {
  const auto car = prism(64);
  car->material_slots.assign(car->triangle_count(), 0);
  for (size_t i = 0; i < 4; ++i) car->material_slots[i] = 1;  // two windows
  EXPECT_TRUE(is_pane(car, 1));
  car->material_slots.assign(car->triangle_count(), 1);
  EXPECT_FALSE(is_pane(car, 1));
  car->material_slots.assign(car->triangle_count(), 0);
  EXPECT_FALSE(is_pane(car, 1)) << "no glass at all";
}

}  // namespace
}  // namespace cistern::test
