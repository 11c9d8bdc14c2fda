#pragma once

#include <functional>

#include "scene/displaced_mesh.h"

namespace cistern {

/// Fills `displaced.mesh` and `displaced.warning` from what it is to be made of. `scene` has the instance `instance`,
/// which shows the mesh as it was before.
///
/// As in Cycles (scene/mesh_displace.cpp): each vertex moves once, by the material and the corner of the first triangle
/// around it that moves anything, along the smooth normal even where faces are flat. Smooth normals are made anew of
/// those triangles whose material does not keep them: the sum of the unit normals of the triangles around a vertex.
/// Flat faces stay flat in a mesh of them; among smooth ones they become smooth. A mesh comes apart where the normals
/// of a point differ from one smooth corner to another (Cycles up to 5.0). A vertex whose displacement is not finite or
/// leads beyond kFarthestCoordinate stays where it is, and is warned of.
///
/// The mesh is null once `is_stopped` was true, if there is such a question: it is asked from any thread, all the time.
void displace_mesh(DisplacedMesh& displaced, const Scene& scene, uint32_t instance,
                   const std::function<bool()>& is_stopped = {});

inline constexpr float kFarthestCoordinate = 1e18f;  // in object space; rays reach a little further

}  // namespace cistern
