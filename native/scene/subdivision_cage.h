#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "scene/camera.h"

namespace cistern {

/// Of polygons; LINEAR leaves them in place.
enum class SubdivisionScheme : uint8_t { CATMULL_CLARK, LINEAR };

/// Where UV maps stay as they are while polygons become smooth: everywhere, along seams and boundaries, or where the
/// name says.
enum class UvSmoothing : uint8_t {
  NONE,
  CORNERS,
  CORNERS_AND_JUNCTIONS,
  CORNERS_JUNCTIONS_AND_CONCAVE,
  BOUNDARIES,
  ALL,
};

/// What a mesh keeps that is subdivided as finely as a picture shows it: its polygons, and how they become smooth.
struct SubdivisionCage {
  SubdivisionScheme scheme = SubdivisionScheme::CATMULL_CLARK;
  UvSmoothing uv_smoothing = UvSmoothing::BOUNDARIES;
  bool keeps_corners = false;                    // of open boundaries
  uint32_t uv_maps = 0;                          // how many of the mesh's attributes, which come first
  std::vector<uint32_t> encoded_colors;          // attributes of corners that are blended as sRGB has them
  float pixels = 1.0f;                           // longest edge, before DicingView::rate
  float length = 0.0f;                           // the same in object space; 0: `pixels` counts
  std::vector<uint32_t> offsets;                 // of polygons into their corners; one more than there are
  std::vector<uint32_t> vertices;                // by corner
  std::vector<uint16_t> slots;                   // of materials, by polygon; empty: 0
  std::vector<std::array<uint32_t, 2>> creases;  // edges
  std::vector<float> crease_sharpness;           // beside them: levels of subdivision, kSharpest and more: for ever
  std::vector<uint32_t> sharp_vertices;
  std::vector<float> vertex_sharpness;
  friend bool operator==(const SubdivisionCage&, const SubdivisionCage&) = default;

  static constexpr float kSharpest = 10.0f;
  size_t polygon_count() const { return offsets.empty() ? 0 : offsets.size() - 1; }
  uint32_t size(size_t polygon) const { return offsets[polygon + 1] - offsets[polygon]; }
};

/// Who looks at surfaces that are subdivided for a picture.
struct DicingView {
  Camera camera;
  int width = 1, height = 1;     // of the picture
  float rate = 1.0f;             // multiplies the longest edges of all meshes
  float offscreen_scale = 4.0f;  // the same of what the camera does not have in view
  int most_levels = 12;          // edges are halved so often at most
  /// What was diced stays as it is wherever instances and the camera go, until another rate is asked for.
  bool stays_diced = false;
  friend bool operator==(const DicingView&, const DicingView&) = default;
};

}  // namespace cistern
