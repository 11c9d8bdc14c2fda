#pragma once

#include "accel/embree_device.h"
#include "scene/mesh.h"

namespace cistern {

/// Strands of `mesh` (in object space) as round curves that are seen from outside alone, as Cycles has its 3D curves: a
/// ray that starts inside leaves without a hit, so that light passes a transparent strand once.
EmbreeGeometry strand_geometry(const EmbreeDevice& device, const Mesh& mesh);

}  // namespace cistern
