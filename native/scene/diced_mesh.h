#pragma once

#include "scene/mesh.h"

namespace cistern {

/// What a mesh with a cage was diced to, and for what.
struct DicedMesh {
  std::shared_ptr<const Mesh> mesh;  // the source itself where it cannot be diced
  std::string warning;               // empty: there is none

  std::shared_ptr<const Mesh> source;
  DicingView view;
  Transform object_to_world;
};

}  // namespace cistern
