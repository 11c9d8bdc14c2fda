#pragma once

#include "scene/mesh.h"

namespace cistern {

/// Unit normals of all vertices of a triangle mesh, each triangle weighed by its angle there, as Blender has them; +z
/// where that is nothing.
std::vector<Vec3> smooth_normals(const Mesh& mesh);

}  // namespace cistern
