#pragma once

#include <span>

#include "base/lazy_vector.h"
#include "resampling/mis_weight.h"
#include "restir/earlier_world.h"
#include "restir/pixel_reuse.h"

namespace cistern {

/// Largest DirectReuse::spatial_neighbours.
inline constexpr int kMaxSpatialNeighbours = 32;

/// What the reservoir systems for direct light can be told.
struct DirectReuse {
  int light_candidates = 0;       // M, light samples per visible point and frame
  bool temporal_reuse = true;     // from the frame before
  float confidence_cap = 0.0f;    // of history, in units of a frame's own candidates
  bool spatial_reuse = true;      // from other pixels
  int spatial_neighbours = 0;     // k, per round
  float spatial_radius = 0.0f;    // pixels
  int spatial_rounds = 0;         // [Bitterli 2020] §5: 1 unbiased, 2 biased
  bool visibility_reuse = false;  // occluded initial samples are dropped before reuse
  Bias bias = Bias::UNBIASED;
  friend bool operator==(const DirectReuse&, const DirectReuse&) = default;
};

/// What a frame leaves to the next.
struct LightHistory {
  EarlierView view;
  const EarlierWorld* world = nullptr;           // null: light is as it was
  std::span<const VisiblePoint> visible_points;  // by pixel; empty before the first frame
  LazyVector<LightReservoir> reservoirs;
};

/// ReSTIR DI.
///
/// [Bitterli 2020] B. Bitterli, C. Wyman, M. Pharr, P. Shirley, A. Lefohn, W. Jarosz: Spatiotemporal Reservoir
/// Resampling for Real-Time Ray Tracing with Dynamic Direct Lighting. ACM Transactions on Graphics 39(4).
///
/// Each visible point draws M light samples, keeps one, merges it with what its surface kept a frame ago and with what
/// its neighbours kept, and traces one shadow ray. With neither reuse it is plain RIS.
///
/// Departures: weights in the emitters' own coordinates (light_target.h) instead of solid angle; confidence 1 for all
/// M candidates of a frame; UNBIASED weighs merges by pairwise MIS instead of 1/Z (Alg. 6), and with visibility_reuse
/// its targets include visibility, which costs rays; FAST is Alg. 4. Neighbours that differ in normal or distance are
/// left out by both. The path's BSDF sample is added in full instead of entering the reservoir: same weights, no
/// selection noise.
///
/// All members are pure functions of their arguments and may run in any order. `non_finite` counts weights refused,
/// `others` the reservoirs of other points that were merged, null samples too: they count in every weight.
class ReservoirDirectLight {
 public:
  using Image = ImageRegion;
  ReservoirDirectLight(const PathContext& context, const DirectReuse& reuse, const Image& image, uint64_t seed)
      : context_(context), reuse_(reuse), image_(image), seed_(seed) {}

  /// [Bitterli 2020] Alg. 3: RIS over M light samples, with visibility reuse (Alg. 5 l.6-8) where asked for.
  LightReservoir initial_candidates(const VisiblePoint& visible, uint32_t pixel, uint32_t frame,
                                    uint64_t& non_finite) const;

  /// Alg. 5 l.10-12: merged with the history of the same surface point, if it was seen a frame ago.
  LightReservoir reuse_in_time(const VisiblePoint& visible, const LightReservoir& current, const LightHistory& history,
                               uint32_t pixel, uint32_t frame, uint64_t& non_finite, uint32_t& others) const;

  /// Alg. 5 l.15-18: merged with k random neighbours within the radius. `visible_points` and `reservoirs` by pixel.
  LightReservoir reuse_in_space(std::span<const VisiblePoint> visible_points,
                                std::span<const LightReservoir> reservoirs, uint32_t pixel, uint32_t frame, int round,
                                uint64_t& non_finite, uint32_t& others) const;

  /// Alg. 5 l.21: radiance at the camera; traces the shadow ray.
  Rgb shade(const VisiblePoint& visible, const LightReservoir& reservoir) const;
  /// Shares that kinds of scattering have in it.
  KindColors shares(const VisiblePoint& visible, const LightReservoir& reservoir) const {
    return reflected_shares(context_, visible, reservoir.sample);
  }

 private:
  float candidate_count() const { return static_cast<float>(reuse_.light_candidates); }
  struct Candidates;
  LightReservoir merge(const Candidates& candidates, Rng& rng, uint64_t& non_finite) const;

  const PathContext& context_;
  DirectReuse reuse_;
  Image image_;
  uint64_t seed_;
};

}  // namespace cistern
