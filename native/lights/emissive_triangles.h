#pragma once

#include <optional>
#include <vector>

#include "lights/light_bounds.h"
#include "scene/scene.h"

namespace cistern {

/// A triangle that emits, in world space.
struct EmissiveTriangle {
  Vec3 p0, edge_1, edge_2;
  uint32_t instance = 0, triangle = 0;
  int material = -1;
  float clearance = 0.0f;  // see surface_clearance
  int uniform = -1;        // its EmissiveTriangles::uniform_emission; -1: emission varies over the object

  Vec3 point(Vec2 barycentric) const { return p0 + edge_1 * barycentric.x + edge_2 * barycentric.y; }
  /// Normal by the winding, as long as twice the area.
  Vec3 scaled_normal() const { return cross(edge_1, edge_2); }
  float area() const { return 0.5f * length(scaled_normal()); }
};

/// Radiance that a triangle sends from its two sides, by the winding of its corners in the world.
struct SideEmission {
  Rgb along_normal, against_normal;
  /// Magnitude.
  float mean() const { return 0.5f * (magnitude(along_normal) + magnitude(against_normal)); }
  friend bool operator==(const SideEmission&, const SideEmission&) = default;
};

/// Every triangle of every instance whose material may emit, in the order of the scene. 60 bytes per triangle, and 4
/// bytes per triangle of meshes only part of which emits. Of several that lie in one place and are alike, as of an
/// object that was duplicated, the first stands for all, as rays meet one of them alone: the others have no extent.
class EmissiveTriangles {
 public:
  EmissiveTriangles() = default;
  explicit EmissiveTriangles(const Scene& scene);

  size_t size() const { return triangles_.size(); }
  const EmissiveTriangle& operator[](size_t index) const { return triangles_[index]; }
  /// Of a triangle from whose sides light leaves the same everywhere and in all directions; else null.
  const SideEmission* uniform_emission(const EmissiveTriangle& triangle) const {
    return triangle.uniform < 0 ? nullptr : &uniform_[static_cast<size_t>(triangle.uniform)];
  }
  /// Mean radiance (magnitude) over both sides: exact for uniform emission, otherwise from a few evaluations, mixed
  /// with the material's mean so that a texture that is bright between them is still found. Never zero.
  float radiance_estimate(size_t index) const { return radiance_[index]; }
  /// The triangle that stands for that one.
  std::optional<uint32_t> find(uint32_t instance, uint32_t triangle) const;
  LightBounds bounds(size_t index) const;
  size_t memory_bytes() const;

 private:
  /// Emitting triangles of a mesh with certain materials; shared by its instances.
  struct Selection {
    std::vector<uint32_t> triangles;
    std::vector<uint32_t> rank;  // per triangle of the mesh, kNone where it does not emit; empty: all emit
  };
  struct Placement {
    uint32_t first = 0;  // of the instance's emitters
    int selection = -1;  // -1: nothing emits
  };
  static constexpr uint32_t kNone = 0xffffffffu;

  static Selection select(const Scene& scene, const Instance& instance);
  void place(const Scene& scene);
  void fill(const Scene& scene);
  void find_uniform_emission(const Scene& scene);
  void estimate_radiance(const Scene& scene);
  void join_coincident(const Scene& scene);
  std::optional<uint32_t> number(uint32_t instance, uint32_t triangle) const;

  std::vector<Selection> selections_;
  std::vector<Placement> placements_;  // per instance
  std::vector<EmissiveTriangle> triangles_;
  std::vector<SideEmission> uniform_;
  std::vector<float> radiance_;
  std::vector<uint32_t> represented_by_;  // per triangle; empty: each by itself
};

/// Whether a material is worth sampling: it may emit, and not just a constant zero.
bool is_emitter(const Scene& scene, int material);

}  // namespace cistern
