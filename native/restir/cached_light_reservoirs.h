#pragma once

#include "restir/light_cache.h"
#include "restir/reservoir_direct_light.h"

namespace cistern {

/// ReSTIR DI whose first samples come from a precomputed cache as well.
///
/// [Stefanescu 2025] V. T. Stefanescu: Worldspace ReSTIR for Direct Illumination: Storing Precomputed Reservoir Values
/// with a Normal-Aware Hashgrid. Bachelor's thesis, TU Delft, §3.2 and §4.
///
/// A visible point merges X reservoirs of its cell of the cache (light_cache.h) with its own light candidates; reuse in
/// time and space and shading are those of ReservoirDirectLight.
///
/// FAST is the thesis: the cache is made once, merges count candidates (1/M), a cached reservoir with all of its
/// `candidates`. Biased where a cell holds points that a light cannot reach, and for ever by the cache's own error.
/// UNBIASED: every cached reservoir has the confidence of the point's own batch (the pairs behind it are not that many
/// independent finds), merges go by the balance heuristic with the target of the cell, the cache is renewed in turn,
/// and each point looks its cell up from a random place beside it, so that the borders of cells do not show.
class CachedLightReservoirs {
 public:
  using Image = ReservoirDirectLight::Image;
  CachedLightReservoirs(const PathContext& context, const DirectReuse& reuse, const LightCacheSettings& settings,
                        const Image& image, uint64_t seed, std::shared_ptr<const LightCacheCells> cells);

  /// Goes on with the cache of another render, of whose scene nothing but the camera has changed.
  void take_over(CachedLightReservoirs&& earlier);

  /// Makes ready what the visible points of a frame need; most of the work is in the first frame, which makes all cells
  /// that its points may look up in any. False when stopped.
  bool prepare(std::span<const VisiblePoint> visible_points, uint32_t frame, const WorkMonitor& monitor);

  /// In place of ReservoirDirectLight::initial_candidates, after `prepare` for the same points and frame. Adds the
  /// number of reservoirs that it took from the cell to `others`.
  LightReservoir initial_candidates(const VisiblePoint& visible, uint32_t pixel, uint32_t frame, uint64_t& non_finite,
                                    uint32_t& others) const;

  /// Cell that a pixel took its reservoirs from in the frame last prepared.
  LightCacheKey key(uint32_t pixel) const { return keys_[pixel]; }
  const LightCache& cache() const { return cache_; }
  size_t memory_bytes() const { return cache_.memory_bytes() + keys_.capacity() * sizeof(LightCacheKey); }

 private:
  void request_surroundings(std::span<const VisiblePoint> visible_points);
  LightCacheKey key_beside(const VisiblePoint& visible, Vec3 u) const;
  LightCacheKey choose_cell(const VisiblePoint& visible, uint32_t pixel, uint32_t frame) const;
  LightReservoir merge(const VisiblePoint& visible, const LightReservoir& own, uint32_t cell, Rng& rng,
                       uint64_t& non_finite, uint32_t& others) const;

  const PathContext& context_;
  DirectReuse reuse_;
  LightCacheSettings settings_;
  Image image_;
  uint64_t seed_;
  ReservoirDirectLight own_;  // makes a point's own candidates, visible or not
  LightCache cache_;
  std::vector<LightCacheKey> keys_;  // by pixel
};

}  // namespace cistern
