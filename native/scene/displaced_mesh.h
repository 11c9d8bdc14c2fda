#pragma once

#include "scene/scene.h"

namespace cistern {

/// A mesh whose vertices displacement moved, and what it was made of.
struct DisplacedMesh {
  std::shared_ptr<const Mesh> mesh;
  std::string warning;  // of vertices that could not be moved; empty: there are none

  std::shared_ptr<const Mesh> source;
  std::vector<std::shared_ptr<const MaterialProgram>> programs;  // by slot of the material set; null: moves nothing
  std::vector<std::shared_ptr<const Image>> images;              // of the programs, one after the other
  Instance
      placement;  // of the first instance that shows it: the displacement of all is that of this one (as in Cycles)
  std::shared_ptr<const InstanceValues> values;
  Camera camera;
};

}  // namespace cistern
