#pragma once

#include <functional>

#include "scene/diced_mesh.h"

namespace cistern {

inline constexpr size_t kMostDicedTriangles = size_t{1} << 25;  // of one mesh; 5 GB with what traces them

/// Fills `mesh` and `warning`. Meshes that are cut as the same one have the same points and corners.
///
/// Triangles on the limit surface of the cage whose edges are no longer than the view asks for. They begin as halves of
/// quads, and of the parts of other polygons; edges that are too long are halved, and triangles with one, two or three
/// such edges cut into two, three or four, until none is. Whether an edge is too long depends on its ends alone: what
/// shares it agrees, and nothing comes apart. Where that gives more than `most_triangles`, lengths are doubled.
///
/// `mesh` is null once `is_stopped` was true, if there is such a question: it is asked from any thread, all the time.
void dice_mesh(DicedMesh& diced, const std::function<bool()>& is_stopped = {},
               size_t most_triangles = kMostDicedTriangles);

}  // namespace cistern
