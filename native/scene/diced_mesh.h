#pragma once

#include "scene/mesh.h"

namespace cistern {

/// How a mesh with a cage is diced.
struct Dicing {
  std::shared_ptr<const Mesh> source;  // whose surface is shown
  /// By whose shape it is cut into triangles: its own, but at other moments of a shutter that of the middle.
  std::shared_ptr<const Mesh> cut_as;
  DicingView view;
  Transform object_to_world;
};

/// What it was diced to.
struct DicedMesh {
  Dicing dicing;
  std::shared_ptr<const Mesh> mesh;  // the source itself where it cannot be diced
  std::string warning;               // empty: there is none
};

}  // namespace cistern
