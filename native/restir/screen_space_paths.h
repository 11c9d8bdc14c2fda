#pragma once

#include <span>

#include "base/lazy_vector.h"
#include "restir/path_merge.h"
#include "restir/pixel_reuse.h"

namespace cistern {

/// What ReSTIR GI can be told. Numbers are those of [Ouyang 2021] §4 and §6, but for the last three: there UNIFORM, 6
/// and 0.25.
struct ScreenPathReuse {
  PathMergeRules rules;
  bool temporal_reuse = true;
  bool spatial_reuse = true;
  float temporal_cap = 30.0f;                  // of the temporal reservoir's history, in frames
  float spatial_cap = 500.0f;                  // of the spatial reservoir's
  int neighbours = 3;                          // merged per frame
  int starved_neighbours = 9;                  // where the spatial reservoir has less than half of its cap
  float largest_radius = 0.1f;                 // where neighbours are looked for, of the picture's larger side
  float smallest_radius = 3.0f;                // pixels
  RoughSampling source = RoughSampling::BSDF;  // of the directions in which visible points look for sample points
  int validation_frames = 0;                   // samples of the history are validated every so many; 0: never
  float multi_bounce_share = 1.0f;             // of tiles, whose paths go on beyond the sample point
  friend bool operator==(const ScreenPathReuse&, const ScreenPathReuse&) = default;
};

/// The path reservoirs of a frame, by pixel.
struct PathFrame {
  EarlierView view;
  std::span<const VisiblePoint> visible_points;  // empty: there is no such frame
  LazyVector<PathReservoir> temporal, spatial;
};

/// ReSTIR GI.
///
/// [Ouyang 2021] Y. Ouyang, S. Liu, M. Kettunen, M. Pharr, J. Pantaleoni: ReSTIR GI: Path Resampling for Real-Time Path
/// Tracing. Computer Graphics Forum 40(8).
///
/// Each visible point finds one sample point. A temporal reservoir merges it with the history of the same surface
/// point; a spatial reservoir, with a history of its own, takes in the temporal reservoirs of neighbours. What it holds
/// is shaded, with a ray to it.
///
/// Departures: weights per area at the sample point (path_target.h), so no Jacobian: Alg. 4 l.11 prints it upside down.
/// Sample points keep what they received, so glossy ones are evaluated towards each receiver (FAST: AS_FOUND, as
/// printed). UNBIASED merges by the balance heuristic and pairwise MIS with a visibility ray in each target instead of
/// 1/Z (Alg. 4 l.15-19, where Q is also intersected instead of united); FAST is 1/M, and takes neighbours' samples that
/// the point does not see (l.12-13), which then bring it nothing. Paths that see nothing are merged as null samples.
/// Validation traces old paths besides the new ones of its frame instead of in their place, so that points that lose
/// their history have a sample.
///
/// Members are pure functions of their arguments. `others` counts the reservoirs that were merged besides the point's
/// own of this frame.
class ScreenSpacePaths {
 public:
  ScreenSpacePaths(const PathContext& context, const ScreenPathReuse& reuse, const ImageRegion& image, uint64_t seed)
      : context_(context), reuse_(reuse), image_(image), seed_(seed) {}

  /// §5: paths beyond the sample point in some of the tiles of 64 x 32 pixels only, Russian roulette for whole tiles.
  bool goes_on(uint32_t full_frame_pixel, uint32_t frame) const;

  /// Alg. 2: a reservoir of confidence 1 from what the path found.
  static PathReservoir initial_sample(const PathLink& link) { return {link.to, link.W, 1.0f}; }

  /// The same once all its light is known, ready to be merged; see path_merge.h.
  PathReservoir keep_one_direction(const VisiblePoint& visible, const PathReservoir& found, uint32_t pixel,
                                   uint32_t frame) const;

  /// Alg. 3.
  PathReservoir reuse_in_time(const VisiblePoint& visible, const PathReservoir& initial, const PathFrame& previous,
                              uint32_t pixel, uint32_t frame, uint64_t& non_finite, uint32_t& others) const;

  /// Alg. 4, from the temporal reservoirs of `current`.
  PathReservoir reuse_in_space(const PathFrame& current, const PathFrame& previous, uint32_t pixel, uint32_t frame,
                               uint64_t& non_finite, uint32_t& others) const;

  /// Eq. 6: radiance at the camera; traces the ray to the sample point.
  Rgb shade(const VisiblePoint& visible, const PathReservoir& reservoir) const;
  /// Shares that kinds of scattering have in it, where it is not black.
  KindColors shares(const VisiblePoint& visible, const PathReservoir& reservoir) const {
    return reflected_shares(context_, visible, reservoir.sample);
  }
  /// Adds `factor` times it to light groups.
  void add_groups(const VisiblePoint& visible, const PathReservoir& reservoir, std::span<const Rgb> continuation,
                  float factor, std::span<Rgb> sums) const {
    add_reflected_groups(context_, visible, reservoir.sample, reuse_.rules.reflection, continuation,
                         Rgb(factor * reservoir.W), sums);
  }

 private:
  std::optional<uint32_t> previous_pixel(const VisiblePoint& visible, const PathFrame& previous, uint32_t pixel) const;

  const PathContext& context_;
  ScreenPathReuse reuse_;
  ImageRegion image_;
  uint64_t seed_;
};

/// §5, sample validation: whether the path that found a sample, traced again from the same random numbers, still ends
/// at the same point with the same light. Without change in the scene it does so to the last bit; tolerances are for
/// what moves a little (texture filtering by another pixel's footprint).
bool still_holds(const PathSample& sample, const PathLink& again);

}  // namespace cistern
