#pragma once

#include <optional>

#include "base/rng.h"
#include "scene/camera.h"
#include "transport/visible_points.h"

namespace cistern {

/// The pixels of a frame: a width x height region at (x, y) of a full frame. A pixel is numbered row by row within the
/// region.
struct ImageRegion {
  int x, y, width, height, full_width, full_height;
};

/// Random numbers of a pixel by its place in the full frame: pictures of a part equal that part of the whole.
Rng pixel_random_numbers(const ImageRegion& region, uint64_t seed, uint32_t pixel, uint32_t frame, uint32_t stream);

/// Another pixel, displaced by `offset` pixels; empty outside the region and for no displacement.
std::optional<uint32_t> displaced_pixel(const ImageRegion& region, uint32_t pixel, Vec2 offset);

/// Pixel that showed this surface point to `camera`; the same pixel for what is seen in a mirror or through glass,
/// which is not where its surface is.
std::optional<uint32_t> reproject(const ImageRegion& region, const Camera& camera, const VisiblePoint& visible,
                                  uint32_t pixel);

/// How far two points may differ to be worth a merge.
struct Similarity {
  float normal_cosine;   // at least
  float distance_ratio;  // of the distances to the camera, at most
};
/// Says nothing about their samples, so leaving a point out for it biases nothing.
bool is_similar(const VisiblePoint& a, const VisiblePoint& b, const Similarity& limits);
/// Whether paths from two points have as many bounces left of each kind: or one could not find what the other does.
bool has_same_bounces(const VisiblePoint& a, const VisiblePoint& b);
/// All that reusing paths asks for: both points exist, have the same bounces and are similar.
bool is_reusable(const VisiblePoint& a, const VisiblePoint& b, const Similarity& limits);

}  // namespace cistern
