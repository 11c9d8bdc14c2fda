#pragma once

#include "grid/nested_cells.h"

namespace cistern {

/// What a light sample brought to a point: one term of an estimate of what its cluster sends there. Magnitude of what
/// is reflected, over albedo and the density of the sample.
struct LightRecord {
  NestedCellKey cell;  // the point's own
  uint32_t cluster;
  float visible;     // 0 in shadow
  float unshadowed;  // as if nothing were in between; above 0
  // Squares of what the sample brought to its pixel, and what they would be on average had the light set chosen.
  float square = 0.0f, square_without = 0.0f;
};

}  // namespace cistern
