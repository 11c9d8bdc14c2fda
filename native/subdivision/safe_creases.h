#pragma once

#include "scene/subdivision_cage.h"

namespace cistern {

/// Indices of the creases that OpenSubdiv can be given. Its versions before 3.5.1 write beyond their memory where a
/// crease touches a polygon that has a point between two polygons alone, and another on an open boundary: those are
/// left out.
std::vector<size_t> safe_creases(const SubdivisionCage& cage);

}  // namespace cistern
