#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scene/mesh.h"

namespace cistern {

struct Scene;

/// A pixel of a sheet, as a point of a triangle: weights of its vertices 1 and 2 in the middle, and by how much these
/// grow from one pixel to the next.
struct SheetPixel {
  int32_t triangle = -1;  // -1: the pixel shows nothing
  Vec2 weights, along_x, along_y;
};

/// The surface of an instance, laid out flat: what baking renders into the image of a UV map.
struct SurfaceSheet {
  int width = 0, height = 0;
  uint32_t instance = 0;
  float pixel_size = 0.0f;  // metres, of a pixel on the surface, on average
  std::vector<SheetPixel> pixels;
};

/// Rows from the bottom up; every span has an entry for each pixel, and is read during the call only. Points and steps
/// are in object space.
struct SheetInput {
  int width = 0, height = 0;
  int instance = -1;
  std::span<const int32_t> polygons;       // of the mesh as it was given to the builder; -1: the pixel shows nothing
  std::span<const Vec3> points;            // in the middle of the pixel, on that polygon
  std::span<const Vec3> steps_x, steps_y;  // along the polygon to the middle of the next pixel
};

/// Pixels whose polygon has no triangle show nothing. Throws Error naming `name` where an index, a point or the length
/// of a span is wrong.
SurfaceSheet make_surface_sheet(const Scene& scene, const SheetInput& input, const std::string& name);

/// Weights of vertices 1 and 2, brought into the triangle where they lie beyond an edge of it.
Vec2 inside_triangle(Vec2 weights);

}  // namespace cistern
