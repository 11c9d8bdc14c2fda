#pragma once

#include <optional>

#include "base/rng.h"
#include "scene/camera.h"
#include "scene/scene_change.h"
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

/// What an earlier frame was seen by.
struct EarlierView {
  Camera camera;
  ImageRegion image{};
  const SceneChange* change = nullptr;  // of the scene since then; null: none but of the camera
};

/// A surface point as it was in an earlier frame.
struct EarlierPlace {
  uint32_t pixel;  // of the earlier region
  uint32_t instance;
  Vec3 n;          // of the receiver
  float distance;  // from the camera, along the path
};

/// Where an earlier frame showed this surface point, which moves with its instance. What is seen in a mirror or through
/// glass is not where its surface is: it is looked for at the same place of the picture. Empty outside of the earlier
/// region, and for instances that were not there. Depends on geometry alone, never on samples: MIS weights allow that.
std::optional<EarlierPlace> reproject(const EarlierView& view, const ImageRegion& region, const Camera& camera,
                                      const VisiblePoint& visible, uint32_t pixel);

/// How far two points may differ to be worth a merge.
struct Similarity {
  float normal_cosine;   // at least
  float distance_ratio;  // of the distances to the camera, at most
};
/// Says nothing about their samples, so leaving a point out for it biases nothing.
bool is_similar(const VisiblePoint& a, const VisiblePoint& b, const Similarity& limits);
/// Whether a point of the earlier frame, which exists, is at the place or near enough.
bool is_at(const EarlierView& view, const EarlierPlace& place, const VisiblePoint& earlier, const Similarity& limits);
/// Whether paths from two points have as many bounces left of each kind: or one could not find what the other does.
bool has_same_bounces(const VisiblePoint& a, const VisiblePoint& b);
/// All that reusing paths asks for: both points exist, have the same bounces and are similar.
bool is_reusable(const VisiblePoint& a, const VisiblePoint& b, const Similarity& limits);

}  // namespace cistern
