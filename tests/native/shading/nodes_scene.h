#pragma once

#include <memory>

#include "scene/scene.h"
#include "shading/surface_point.h"

namespace cistern::test {

inline MeshAttribute make_attribute(const std::string& name, int components, const std::vector<float>& values) {
  const auto kept = std::make_shared<std::vector<float>>(values);
  return {name, Domain::POINT, components, std::shared_ptr<const float[]>(kept, kept->data()),
          attribute_name_hash(name)};
}

/// The triangle (0,0,0) (2,0,0) (0,1,0) with a UV map u = x / 2, v = y ("UV"), its mirror image ("Mirrored", u = -x /
/// 2) and a colour ("Tint", red = u, green = v, blue 0, alpha 0.5).
inline std::shared_ptr<Mesh> make_triangle() {
  auto mesh = std::make_shared<Mesh>();
  mesh->name = "triangle";
  mesh->positions = {{0.0f, 0.0f, 0.0f}, {2.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}};
  mesh->vertices = {{0, 1, 2}};
  mesh->attributes = {make_attribute("UV", 2, {0, 0, 1, 0, 0, 1}), make_attribute("Mirrored", 2, {0, 0, -1, 0, 0, 1}),
                      make_attribute("Tint", 4, {0, 0, 0, 0.5f, 1, 0, 0, 0.5f, 0, 1, 0, 0.5f})};
  for (const Vec3 p : mesh->positions) mesh->bounds.extend(p);
  return mesh;
}

/// One instance of `mesh` with one material.
inline Scene make_scene(std::shared_ptr<const Mesh> mesh, const Transform& object_to_world = {},
                        MaterialProgram program = {}) {
  Scene scene;
  scene.meshes = {std::move(mesh)};
  scene.materials = {std::make_shared<const MaterialProgram>(std::move(program))};
  scene.material_sets = {{0}};
  Instance instance;
  instance.mesh = 0;
  instance.material_set = 0;
  instance.random = 0.25f;
  instance.object_to_world = object_to_world;
  scene.instances = {instance};
  scene.tangents.resize(1);
  const Mesh& shown = *scene.meshes[0];
  for (int i = 0; i < static_cast<int>(shown.attributes.size()); ++i)
    if (shown.attributes[static_cast<size_t>(i)].components == 2)
      scene.tangents[0].push_back({i, false, std::make_shared<const CornerTangents>(corner_tangents(shown, i))});
  return scene;
}

/// The point of triangle 0 with these weights, seen along `direction`.
inline SurfacePoint point_at(const Scene& scene, Vec2 barycentric, Vec3 direction) {
  Ray ray;
  ray.direction = normalize(direction);
  Hit hit{};
  hit.u = barycentric.x;
  hit.v = barycentric.y;
  const Mesh& mesh = *scene.meshes[0];
  const TriangleIndices& v = mesh.vertices[0];
  const Vec3 p0 = mesh.positions[v[0]];
  const Vec3 normal = cross(mesh.positions[v[1]] - p0, mesh.positions[v[2]] - p0);
  hit.normal = inverse(scene.instances[0].object_to_world).transposed_vector(normal);
  return make_surface_point(scene, ray, hit);
}

}  // namespace cistern::test
