#include "restir/cached_light_reservoirs.h"

#include <array>

#include "base/parallel.h"
#include "grid/stride_selection.h"
#include "resampling/resample.h"

namespace cistern {
namespace {

constexpr size_t kPixelBlock = 4096;
constexpr uint32_t kCellStream = 0x63656c6c, kMergeStream = 0x6d657267;
constexpr size_t kMaxMerged = 32;

DirectReuse without_visibility(DirectReuse reuse) {
  reuse.visibility_reuse = false;
  return reuse;
}

bool is_same(const LightSample& a, const LightSample& b) {
  return a.emitter == b.emitter && a.uv.x == b.uv.x && a.uv.y == b.uv.y;
}

/// Brings the target of a cell, which is for white paint, to the scale of a receiver's.
float albedo_of(const Receiver& receiver) {
  return luminance(receiver.diffuse) + luminance(receiver.glossy) + receiver.transmission;
}

}  // namespace

CachedLightReservoirs::CachedLightReservoirs(const PathContext& context, const DirectReuse& reuse,
                                             const LightCacheSettings& settings, const Image& image, uint64_t seed,
                                             std::shared_ptr<const LightCacheCells> cells)
    : context_(context),
      reuse_(reuse),
      settings_(settings),
      image_(image),
      seed_(seed),
      own_(context, without_visibility(reuse), image, seed),
      cache_(context, settings, static_cast<float>(reuse.light_candidates), reuse.bias, seed, std::move(cells)) {}

void CachedLightReservoirs::take_over(CachedLightReservoirs&& earlier) {
  if (cache_.take_over(std::move(earlier.cache_))) std::swap(keys_, earlier.keys_);
}

/// The cell of a place in the tangent plane, up to half a cell away for u in [0, 1]^3.
LightCacheKey CachedLightReservoirs::key_beside(const VisiblePoint& visible, Vec3 u) const {
  const Vec3 offset = cache_.cells().cell_size() * (u - Vec3{0.5f, 0.5f, 0.5f});
  return cache_.cells().key_of(visible.receiver.position + offset - visible.ng * dot(visible.ng, offset), visible.ng);
}

/// UNBIASED: the cell of a random place beside the point, where there is one.
LightCacheKey CachedLightReservoirs::choose_cell(const VisiblePoint& visible, uint32_t pixel, uint32_t frame) const {
  if (!visible.exists) return kNoLightCacheKey;
  if (reuse_.bias == Bias::UNBIASED) {
    Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, kCellStream);
    const Vec2 xy = rng.next_vec2();
    const LightCacheKey beside = key_beside(visible, {xy.x, xy.y, rng.next_float()});
    if (beside != kNoLightCacheKey) return beside;
  }
  return cache_.cells().key_of(visible.receiver.position, visible.ng);
}

/// Cells that choose_cell may come upon in later frames.
void CachedLightReservoirs::request_surroundings(std::span<const VisiblePoint> visible_points) {
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 u{corner & 1 ? 1.0f : 0.0f, corner & 2 ? 1.0f : 0.0f, corner & 4 ? 1.0f : 0.0f};
    parallel_blocks(visible_points.size(), kPixelBlock, [&](size_t, size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i)
        keys_[i] = visible_points[i].exists ? key_beside(visible_points[i], u) : kNoLightCacheKey;
    });
    cache_.request(keys_);
  }
}

bool CachedLightReservoirs::prepare(std::span<const VisiblePoint> visible_points, uint32_t frame,
                                    const WorkMonitor& monitor) {
  const bool is_first = keys_.empty();
  keys_.resize(visible_points.size());
  if (is_first && reuse_.bias == Bias::UNBIASED) request_surroundings(visible_points);
  parallel_blocks(visible_points.size(), kPixelBlock, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) keys_[i] = choose_cell(visible_points[i], static_cast<uint32_t>(i), frame);
  });
  cache_.request(keys_);
  return cache_.prepare(frame, monitor);
}

LightReservoir CachedLightReservoirs::initial_candidates(const VisiblePoint& visible, uint32_t pixel, uint32_t frame,
                                                         uint64_t& non_finite, uint32_t& others) const {
  LightReservoir reservoir = own_.initial_candidates(visible, pixel, frame, non_finite);
  if (const std::optional<uint32_t> cell = cache_.find(keys_[pixel])) {
    Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, kMergeStream);
    reservoir = merge(visible, reservoir, *cell, rng, non_finite, others);
  }
  if (reuse_.visibility_reuse && reservoir.W > 0.0f && !is_visible(context_, visible, reservoir.sample))
    reservoir.W = 0.0f;
  return reservoir;
}

/// [Stefanescu 2025] §3.2.
LightReservoir CachedLightReservoirs::merge(const VisiblePoint& visible, const LightReservoir& own, uint32_t cell,
                                            Rng& rng, uint64_t& non_finite, uint32_t& others) const {
  const std::span<const CachedReservoir> cached = cache_.reservoirs(cell);
  const bool is_fast = reuse_.bias == Bias::FAST;
  const auto light_candidates = static_cast<float>(reuse_.light_candidates);
  const float confidence = is_fast ? static_cast<float>(settings_.candidates) / light_candidates : 1.0f;
  std::array<LightReservoir, kMaxMerged + 1> candidates;
  std::array<float, kMaxMerged + 1> cell_targets;  // of the candidates' samples
  candidates[0] = own;
  cell_targets[0] = is_fast || own.W == 0.0f ? 0.0f : cache_.target(cell, own.sample);
  const auto most = static_cast<uint32_t>(std::min(static_cast<size_t>(settings_.merged), kMaxMerged));
  const StrideSelection chosen = select_by_stride(static_cast<uint32_t>(cached.size()), most, rng.next_double());
  for (uint32_t i = 0; i < chosen.count; ++i) {
    const CachedReservoir& reservoir = cached[cache_.place(chosen[i])];
    candidates[i + 1] = {reservoir.sample, reservoir.W, confidence};
    cell_targets[i + 1] = reservoir.p_hat;
  }
  others += chosen.count;
  const std::span all(candidates.data(), chosen.count + 1);
  const float albedo = albedo_of(visible.receiver);
  size_t known = 0;
  const auto target = [&](size_t i, const LightSample& sample) {
    if (i == 0) return light_target(context_, light_candidates, visible, sample);
    // All cached reservoirs are of one cell, whose target is known for every sample there is. They ask in turn.
    if (!is_same(all[known].sample, sample)) {
      known = 0;
      while (known + 1 < all.size() && !is_same(all[known].sample, sample)) ++known;
    }
    return albedo * cell_targets[known];
  };
  return resample<LightSample>(all, target, is_fast ? MisWeight::CONSTANT : MisWeight::BALANCE, rng, non_finite);
}

}  // namespace cistern
