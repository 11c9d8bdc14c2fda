#pragma once

#include <memory>
#include <span>

#include "scene/mesh.h"

namespace cistern {

/// A place on a polygon of a cage. Quads are one part, (0, 0) to (1, 1), along their first and before their last edge;
/// other polygons have as many parts as corners, each from its corner (0, 0) to the middle (1, 1).
struct CagePlace {
  uint32_t polygon = 0, part = 0;
  Vec2 uv;
};

/// The surface that a mesh with a cage becomes when its polygons are subdivided for ever [Catmull and Clark 1978]: the
/// only part of the project that knows OpenSubdiv. Everything is const and thread-safe; the mesh must outlive it.
class LimitSurface {
 public:
  explicit LimitSurface(const Mesh& mesh);
  ~LimitSurface();
  LimitSurface(const LimitSurface&) = delete;
  LimitSurface& operator=(const LimitSurface&) = delete;

  /// False where OpenSubdiv refuses the polygons.
  bool exists() const;

  struct Point {
    Vec3 position, normal;  // unit, on the side the polygon faces
  };

  /// One polygon at a time; not for several threads.
  class Patch {
   public:
    explicit Patch(const LimitSurface& surface);
    ~Patch();
    Point at(const CagePlace& place);

   private:
    struct Data;
    std::unique_ptr<Data> data_;
  };

  std::vector<Point> points(std::span<const CagePlace> places) const;
  /// An attribute of the mesh there, of the same domain. As in Cycles and in Blender itself, Generated coordinates and
  /// UV maps are smooth, and others straight between the corners of polygons. `places` are those of the diced mesh's
  /// points or corners.
  MeshAttribute attribute(size_t index, std::span<const CagePlace> places) const;
  /// Another one, straight.
  MeshAttribute interpolate(const MeshAttribute& attribute, std::span<const CagePlace> places) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace cistern
