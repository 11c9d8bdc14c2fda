#pragma once

#include <memory>
#include <vector>

#include "accel/accel.h"
#include "base/rng.h"
#include "base/warp.h"
#include "scene/scene_builder.h"

namespace cistern::test {

inline Vec3 random_point(Rng& rng, float scale) {
  const Vec2 xy = rng.next_vec2();
  return scale * Vec3{2.0f * xy.x - 1.0f, 2.0f * xy.y - 1.0f, 2.0f * rng.next_float() - 1.0f};
}

inline Vec3 random_direction(Rng& rng) { return square_to_sphere(rng.next_vec2()); }

/// A turn about a slanted axis, a stretch per axis and a shift; a negative stretch mirrors.
inline Transform random_transform(Rng& rng, Vec3 stretch, float shift) {
  const Vec3 z = random_direction(rng);
  const Vec3 x = normalize(cross(z, random_direction(rng)));
  const Vec3 y = cross(z, x);
  const Vec3 shift_by = random_point(rng, shift);
  return {Vec3{x.x, y.x, z.x} * stretch, Vec3{x.y, y.y, z.y} * stretch, Vec3{x.z, y.z, z.z} * stretch, shift_by};
}

/// Triangles with positions of their own, as a mesh.
inline std::shared_ptr<Mesh> make_mesh(std::vector<Vec3> positions) {
  const auto mesh = std::make_shared<Mesh>();
  mesh->name = "triangles";
  positions.reserve(positions.size() + 1);
  mesh->positions = std::move(positions);
  for (uint32_t i = 0; i + 2 < mesh->positions.size(); i += 3) mesh->vertices.push_back({i, i + 1, i + 2});
  for (const Vec3 p : mesh->positions) mesh->bounds.extend(p);
  return mesh;
}

inline std::shared_ptr<Mesh> random_triangles(Rng& rng, int count, float spread, float size) {
  std::vector<Vec3> positions;
  for (int i = 0; i < count; ++i) {
    const Vec3 center = random_point(rng, spread);
    for (int k = 0; k < 3; ++k) positions.push_back(center + random_point(rng, size));
  }
  return make_mesh(std::move(positions));
}

/// A scene with an opaque material set 0 and one that may be transparent, 1.
inline std::shared_ptr<Scene> make_scene() {
  const auto scene = std::make_shared<Scene>();
  const auto opaque = std::make_shared<MaterialProgram>();
  const auto transparent = std::make_shared<MaterialProgram>();
  transparent->may_be_transparent = true;
  scene->materials = {opaque, transparent};
  scene->material_sets = {{0}, {0, 1}};
  scene->object_names = {"object"};
  return scene;
}

inline void place(Scene& scene, int mesh, const Transform& object_to_world, uint8_t visibility = kVisibleToAll,
                  int material_set = 0) {
  Instance instance;
  instance.mesh = mesh;
  instance.material_set = material_set;
  instance.object = 0;
  instance.visibility = visibility;
  instance.object_to_world = object_to_world;
  scene.instances.push_back(instance);
}

}  // namespace cistern::test
