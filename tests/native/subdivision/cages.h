#pragma once

#include "scene/scene_builder.h"

namespace cistern::test {

/// Polygons to be subdivided, each corner with a UV of its own.
struct Cage {
  std::vector<Vec3> points;
  std::vector<std::vector<int32_t>> polygons;

  /// As a mesh of a builder; `change` may set more.
  template <class Change>
  std::shared_ptr<const Mesh> mesh(const Change& change) const {
    std::vector<int32_t> corners, offsets{0}, fans, owners;
    for (const std::vector<int32_t>& polygon : polygons) {
      const int32_t first = offsets.back(), size = static_cast<int32_t>(polygon.size());
      for (int32_t i = 1; i + 1 < size; ++i) {
        fans.insert(fans.end(), {first, first + i, first + i + 1});
        owners.push_back(static_cast<int32_t>(offsets.size() - 1));
      }
      corners.insert(corners.end(), polygon.begin(), polygon.end());
      offsets.push_back(static_cast<int32_t>(corners.size()));
    }
    const std::vector<Vec3> normals(points.size(), {0.0f, 0.0f, 1.0f});
    MeshInput input;
    input.name = "cage";
    input.positions = points;
    input.corner_vertices = corners;
    input.polygon_offsets = offsets;
    input.triangle_corners = fans;
    input.triangle_polygons = owners;
    input.normals_domain = Domain::POINT;
    input.normals = normals;
    input.subdivision.emplace();
    change(input);
    SceneBuilder builder;
    builder.add_mesh(input);
    return builder.scene().meshes[0];
  }
  std::shared_ptr<const Mesh> mesh() const {
    return mesh([](MeshInput&) {});
  }
};

inline Cage cube() {
  Cage cage;
  for (const float z : {-1.0f, 1.0f})
    for (const float y : {-1.0f, 1.0f})
      for (const float x : {-1.0f, 1.0f}) cage.points.push_back({x, y, z});
  cage.polygons = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return cage;
}

/// Two pentagons, two triangles that share an edge, and quads: closed.
inline Cage house() {
  Cage cage;
  for (const float y : {-1.0f, 1.0f})
    for (const auto& [x, z] : {std::pair(-1.0f, -1.0f), {1.0f, -1.0f}, {1.0f, 0.5f}, {0.0f, 1.3f}, {-1.0f, 0.5f}})
      cage.points.push_back({x, y, z});
  cage.polygons = {{0, 1, 2, 3, 4}, {9, 8, 7, 6, 5}, {0, 5, 6, 1}, {1, 6, 7, 2},
                   {4, 3, 8, 9},    {0, 4, 9, 5},    {2, 7, 3},    {3, 7, 8}};
  return cage;
}

/// A square of side 2 about the origin.
inline Cage square() {
  return {{{-1.0f, -1.0f, 0.0f}, {1.0f, -1.0f, 0.0f}, {1.0f, 1.0f, 0.0f}, {-1.0f, 1.0f, 0.0f}}, {{0, 1, 2, 3}}};
}

/// Looks along -z from above, close enough that the picture's pixels differ much in size.
inline DicingView close_view(int pixels = 200) {
  DicingView view;
  view.camera.camera_to_world.translation = {0.7f, 0.5f, 2.0f};
  view.camera.clip_start = 0.01f;
  view.width = view.height = pixels;
  return view;
}

}  // namespace cistern::test
