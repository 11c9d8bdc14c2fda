#pragma once

#include "base/vec.h"

namespace cistern {

struct RadialTilingSettings {
  float sides = 5.0f;      // of the polygon; at least 2, and need not be whole: the last side is then shorter
  float roundness = 0.0f;  // of its corners; [0, 1]: 0 none, 1 a circle where the sides are whole
  bool normalize = false;  // the coordinate along a side runs from 0 to 1, not from minus to plus its half width
};

struct RadialTilingResult {
  float along = 0.0f;     // coordinate along the side
  float across = 0.0f;    // size of the polygon through the point; less 1, that of the unit polygon, unless normalised
  float width = 0.0f;     // half of the width of a side of the unit polygon
  float rotation = 0.0f;  // of the middle of the side, counter-clockwise from x, in radians
  float segment = 0.0f;   // number of the side
};

/// Blender's Radial Tiling: coordinates along the sides of polygons with round corners around the origin, of which the
/// unit polygon touches the unit circle with the middles of its whole sides.
RadialTilingResult radial_tiling_node(float x, float y, const RadialTilingSettings& settings);

}  // namespace cistern
