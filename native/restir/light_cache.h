#pragma once

#include <atomic>
#include <optional>
#include <unordered_map>

#include "base/alias_table.h"
#include "base/rng.h"
#include "resampling/mis_weight.h"
#include "restir/light_cache_cells.h"
#include "restir/light_target.h"

namespace cistern {

/// Numbers of the cache; the defaults are those of [Stefanescu 2025] §4.2 where there is one.
struct LightCacheSettings {
  int surface_points = 1 << 20;  ///< on all surfaces, for LightCacheCells
  int reservoirs = 64;           ///< in each cell
  int candidates = 1024;         ///< (surface point, light) pairs behind the reservoirs of a cell
  int merged = 4;                ///< X, reservoirs of its cell that a visible point takes
  int target_points = 2;         ///< UNBIASED: surface points whose mean is the target of a cell
  int refresh_frames = 32;       ///< UNBIASED: frames after which the reservoirs of a cell are made anew
  /// Candidates that this may cost for each pixel and frame: a few per cent of a frame. Small pictures see as many
  /// cells as large ones, and take longer to renew them all.
  float renewals_per_pixel = 1.0f;
  friend bool operator==(const LightCacheSettings&, const LightCacheSettings&) = default;
};

/// A light sample that a cell offers. W in the measure of light_target.h; W = 0: a null sample.
struct CachedReservoir {
  LightSample sample;
  float W = 0.0f;
  float p_hat = 0.0f;  ///< the cell's target at the sample
};

/// Reservoirs of light samples for cells, made when somebody first asks for the cell. [Stefanescu 2025] §3.1
///
/// Departure that makes it affordable: the reservoirs of a cell share their candidates. Each is by itself one sample of
/// RIS over `candidates` pairs, as in the paper; that they have drawn from the same pool correlates them, which is
/// lawful, and costs 1/64 of the evaluations. They take even strata of the pool, so together they hold no sample more
/// often than its share: who takes one should choose it evenly at random.
///
/// FAST, as printed: target and support are those of the surface point of each pair, and what is made once stays.
/// UNBIASED:
/// * The target is one function per cell, the mean over a few of its surface points plus a floor in proportion to the
///   power of lights. It is above zero for every emitter, wherever a receiver of the cell may stand.
/// * A quarter of the candidates come from the floor's own distribution, mixed by the balance heuristic, since those
///   that a surface point proposes exclude what lies behind it.
/// * Every frame a fixed share of the cells make their reservoirs anew from fresh random numbers, in turn and whatever
///   they hold, so that the mean over frames is the mean over caches: a frozen cache would keep its error for ever.
///   Whole cells in turn rather than some reservoirs of each, which costs the same: a large pool covers lights better.
class LightCache {
 public:
  /// `light_candidates`: how many light samples a visible point takes by itself, which decides what part of the light
  /// is theirs (light_sample_share).
  LightCache(const PathContext& context, const LightCacheSettings& settings, float light_candidates, Bias bias,
             uint64_t seed, std::shared_ptr<const LightCacheCells> cells);

  /// Goes on with what another cache has made, if it is one of the same cells; lights must be the same as well.
  bool take_over(LightCache&& earlier);

  /// Adds cells to those that the next `prepare` makes ready; kNoLightCacheKey among them is skipped.
  void request(std::span<const LightCacheKey> keys);
  /// Makes the reservoirs of the cells requested ready for a frame. False when stopped: cells that are not ready then
  /// are made when they are requested again. Frames must be asked for in order.
  bool prepare(uint32_t frame, const WorkMonitor& monitor);

  const LightCacheCells& cells() const { return *cells_; }
  /// Number of a cell that `prepare` has made.
  std::optional<uint32_t> find(LightCacheKey key) const;
  /// By `place`.
  std::span<const CachedReservoir> reservoirs(uint32_t cell) const;
  /// Where a cell keeps the reservoir of a stratum: those that a visible point takes, which are of strata at equal
  /// distances, lie side by side in memory.
  uint32_t place(uint32_t stratum) const;
  /// Target of a cell. UNBIASED: above zero for every emitter.
  float target(uint32_t cell, const LightSample& sample) const;

  size_t cell_count() const { return cells_made_.size(); }
  size_t memory_bytes() const;
  /// Weights that were not finite, so far; they counted as zero.
  uint64_t non_finite_weights() const { return non_finite_weights_; }

 private:
  using SurfacePosition = LightCacheCells::SurfacePosition;
  struct Cell {
    LightCacheKey key;
    uint32_t point_count = 0;
    float floor = 0.0f;      // of the target, times the floor's pmf of the emitter
    bool is_ready = false;   // has reservoirs
    uint32_t made_next = 0;  // frame from which they are to be made anew
  };
  struct Pool;

  std::vector<uint32_t> take_requests();
  uint32_t number_of(LightCacheKey key);
  bool needs_reservoirs(uint32_t cell, uint32_t frame) const;
  void make_room();
  void find_points(uint32_t cell, uint32_t frame);
  uint32_t renewal_period() const;
  void make_reservoirs(uint32_t cell, uint32_t frame, Pool& pool);
  float measure_floor(uint32_t cell, Rng& rng) const;
  void draw_pool(uint32_t cell, Rng& rng, Pool& pool);
  void choose_reservoirs(uint32_t cell, const Pool& pool, Rng& rng);
  float point_target(const SurfacePosition& point, const LightSample& sample) const;
  std::span<const SurfacePosition> points(uint32_t cell) const;

  const PathContext& context_;
  LightCacheSettings settings_;
  float light_candidates_;
  Bias bias_;
  uint64_t seed_;
  std::shared_ptr<const LightCacheCells> cells_;
  AliasTable floor_;                                     // over emitters
  std::unordered_map<LightCacheKey, uint32_t> numbers_;  // of cells
  std::vector<Cell> cells_made_;
  std::vector<SurfacePosition> points_;      // kPointsPerCell for each cell
  std::vector<CachedReservoir> reservoirs_;  // settings_.reservoirs for each cell
  size_t pixel_count_ = 1;
  std::vector<uint64_t> requested_;  // per spatial cell, a bit per normal bin
  std::atomic<uint64_t> non_finite_weights_{0};
};

}  // namespace cistern
