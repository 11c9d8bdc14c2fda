#include "restir/light_cache.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "base/parallel.h"

namespace cistern {
namespace {

constexpr size_t kPointsPerCell = 16;     // that propose light samples
constexpr size_t kKeyBlock = 16384;       // keys
constexpr size_t kCellBlock = 8;          // cells; a few milliseconds of work
constexpr float kFloorShare = 0.05f;      // of the floor in the whole target, roughly
constexpr int kFloorCandidatePeriod = 4;  // one candidate in four comes from the floor's distribution
constexpr int kFloorMeasurements = 32;
constexpr uint32_t kFillStream = 0x66696c6c, kFloorStream = 0x666c6f6f;

/// How light that a cell passes on will arrive: on a rough surface seen by the camera.
PathState state_of_receiver() {
  PathState state;
  state.ray_kind = kVisibleToDiffuse;
  state.depth = state.diffuse_depth = 1;
  return state;
}

std::vector<float> floor_weights(const LightSet& lights) {
  // Half by power, half evenly: power is an estimate, and no emitter may be left out.
  const size_t count = lights.emitter_count();
  std::vector<float> weights(count);
  for (uint32_t e = 0; e < count; ++e)
    weights[e] = 0.5f * (lights.receiver_free_pmf(e) + 1.0f / static_cast<float>(count));
  return weights;
}

}  // namespace

/// Candidates of one cell with the running sum of their resampling weights.
struct LightCache::Pool {
  std::vector<LightSample> samples;
  std::vector<float> p_hat;
  std::vector<double> w_sum;
};

LightCache::LightCache(const PathContext& context, const LightCacheSettings& settings, float light_candidates,
                       Bias bias, uint64_t seed, std::shared_ptr<const LightCacheCells> cells)
    : context_(context),
      settings_(settings),
      light_candidates_(light_candidates),
      bias_(bias),
      seed_(seed),
      cells_(std::move(cells)),
      floor_(floor_weights(context.lights)) {}

bool LightCache::take_over(LightCache&& earlier) {
  if (cells_ != earlier.cells_) return false;
  std::swap(numbers_, earlier.numbers_);
  std::swap(cells_made_, earlier.cells_made_);
  std::swap(points_, earlier.points_);
  std::swap(reservoirs_, earlier.reservoirs_);
  return true;
}

void LightCache::request(std::span<const LightCacheKey> keys) {
  requested_.resize(LightCacheCells::kSpatialCells);
  pixel_count_ = keys.size();
  parallel_blocks(keys.size(), kKeyBlock, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      if (keys[i] == kNoLightCacheKey) continue;
      const std::atomic_ref word(requested_[keys[i] / LightCacheCells::kNormalBins]);
      const uint64_t bit = uint64_t{1} << (keys[i] % LightCacheCells::kNormalBins);
      if ((word.load(std::memory_order_relaxed) & bit) == 0) word.fetch_or(bit, std::memory_order_relaxed);
    }
  });
}

/// The cells requested, each once, in the order of keys; new ones get a number.
std::vector<uint32_t> LightCache::take_requests() {
  std::vector<uint32_t> wanted;
  if (requested_.empty()) return wanted;
  for (const uint32_t spatial : cells_->occupied_spatial_cells())
    for (uint64_t bins = std::exchange(requested_[spatial], 0); bins != 0; bins &= bins - 1)
      wanted.push_back(
          number_of(spatial * LightCacheCells::kNormalBins + static_cast<uint32_t>(std::countr_zero(bins))));
  return wanted;
}

uint32_t LightCache::number_of(LightCacheKey key) {
  const auto [found, is_new] = numbers_.try_emplace(key, static_cast<uint32_t>(cells_made_.size()));
  if (is_new) cells_made_.push_back({key});
  return found->second;
}

bool LightCache::prepare(uint32_t frame, const WorkMonitor& monitor) {
  if (context_.lights.is_empty()) return true;
  const std::vector<uint32_t> wanted = take_requests();
  make_room();
  std::atomic<bool> stopped{false};
  std::atomic<size_t> done{0};
  parallel_blocks(wanted.size(), kCellBlock, [&](size_t, size_t begin, size_t end) {
    const FlushDenormals flush;
    Pool pool;
    for (size_t i = begin; i < end; ++i) {
      if (stopped || monitor.stopped()) {
        stopped = true;
        return;
      }
      if (needs_reservoirs(wanted[i], frame)) make_reservoirs(wanted[i], frame, pool);
    }
    const size_t n = done += end - begin;
    if (monitor.report) monitor.report(static_cast<float>(n) / static_cast<float>(wanted.size()));
  });
  return !stopped;
}

/// Later frames add few cells to those of the first: doubling would waste half of the memory.
void LightCache::make_room() {
  constexpr size_t kSpare = 8;  // one cell more for each of so many
  const auto reservoirs_per_cell = static_cast<size_t>(settings_.reservoirs);
  const size_t count = cells_made_.size();
  if (reservoirs_.capacity() < count * reservoirs_per_cell) {
    points_.reserve((count + count / kSpare) * kPointsPerCell);
    reservoirs_.reserve((count + count / kSpare) * reservoirs_per_cell);
  }
  points_.resize(count * kPointsPerCell);
  reservoirs_.resize(count * reservoirs_per_cell);
}

bool LightCache::needs_reservoirs(uint32_t cell, uint32_t frame) const {
  const Cell& made = cells_made_[cell];
  return !made.is_ready || (bias_ == Bias::UNBIASED && frame >= made.made_next);
}

uint32_t LightCache::renewal_period() const {
  const double candidates = static_cast<double>(cells_made_.size()) * settings_.candidates;
  const double affordable = double{settings_.renewals_per_pixel} * static_cast<double>(pixel_count_);
  return std::max(static_cast<uint32_t>(settings_.refresh_frames), static_cast<uint32_t>(candidates / affordable));
}

void LightCache::find_points(uint32_t cell, uint32_t frame) {
  Cell& made = cells_made_[cell];
  std::vector<SurfacePosition> found;
  cells_->points_of(made.key, kPointsPerCell, found);
  made.point_count = static_cast<uint32_t>(found.size());
  std::copy(found.begin(), found.end(), points_.begin() + static_cast<std::ptrdiff_t>(cell * kPointsPerCell));
  // Of its own numbers: a target that knew the candidates would be right on average no more.
  Rng rng(seed_, made.key, frame, kFloorStream);
  made.floor = bias_ == Bias::UNBIASED ? measure_floor(cell, rng) : 0.0f;
}

void LightCache::make_reservoirs(uint32_t cell, uint32_t frame, Pool& pool) {
  Cell& made = cells_made_[cell];
  if (!made.is_ready) find_points(cell, frame);
  Rng rng(seed_, made.key, frame, kFillStream);
  draw_pool(cell, rng, pool);
  choose_reservoirs(cell, pool, rng);
  made.is_ready = true;
  // Each cell has its own turn, so that every frame has as much to do.
  const auto period = renewal_period();
  made.made_next = frame + period - static_cast<uint32_t>((frame + mix_bits(made.key)) % period);
}

std::span<const LightCache::SurfacePosition> LightCache::points(uint32_t cell) const {
  return {points_.data() + cell * kPointsPerCell, cells_made_[cell].point_count};
}

/// The floor as a part of what the target sums to over all lights, estimated. Any value above zero is lawful.
float LightCache::measure_floor(uint32_t cell, Rng& rng) const {
  const std::span<const SurfacePosition> all = points(cell);
  double sum = 0.0;
  for (int i = 0; i < kFloorMeasurements; ++i) {
    const SurfacePosition& point = all[rng.next_uint32() % all.size()];
    const double u = (i + rng.next_double()) / kFloorMeasurements;
    const auto choice = context_.lights.choose(point.position, point.normal, u, rng.next_vec2());
    if (!choice) continue;
    const double w = point_target(point, choice->sample) / double{choice->pmf};
    if (is_weight(w)) sum += w;
  }
  const auto floor = static_cast<float>(kFloorShare * sum / kFloorMeasurements);
  return std::isnormal(floor) ? floor : 1.0f;  // cells that no light was seen to reach have nothing but the floor
}

/// Fills the pool with (surface point, light) pairs, spread over lights by strata.
void LightCache::draw_pool(uint32_t cell, Rng& rng, Pool& pool) {
  const int count = settings_.candidates;
  const std::span<const SurfacePosition> all = points(cell);
  const int from_floor = bias_ == Bias::UNBIASED ? (count + kFloorCandidatePeriod - 1) / kFloorCandidatePeriod : 0;
  pool.samples.clear(), pool.p_hat.clear(), pool.w_sum.clear();
  double w_sum = 0.0;
  for (int i = 0; i < count; ++i) {
    const SurfacePosition& point = all[rng.next_uint32() % all.size()];
    const bool is_from_floor = i < from_floor;
    const int strata = is_from_floor ? from_floor : count - from_floor;
    const double u = ((is_from_floor ? i : i - from_floor) + rng.next_double()) / strata;
    const Vec2 uv = rng.next_vec2();
    LightSample sample;
    float pmf = 0.0f;
    if (is_from_floor) {
      sample = {floor_.sample(u), uv};
      pmf = floor_.pmf(sample.emitter);
    } else if (const auto choice = context_.lights.choose(point.position, point.normal, u, uv)) {
      sample = choice->sample;
      pmf = choice->pmf;
    } else {
      continue;  // a null candidate: it adds nothing to the sum
    }
    float p_hat = 0.0f;
    double density = count * double{pmf};  // of all candidates together
    if (bias_ == Bias::FAST) {
      p_hat = point_target(point, sample);
    } else {
      const double own = strata * double{pmf};
      const double other = is_from_floor ? (count - from_floor) *
                                               double{context_.lights.pmf(sample.emitter, point.position, point.normal)}
                                         : from_floor * double{floor_.pmf(sample.emitter)};
      p_hat = target(cell, sample);
      density = own + other;
    }
    const double w = p_hat / density;
    if (!is_weight(w)) {
      non_finite_weights_.fetch_add(1, std::memory_order_relaxed);
      continue;
    }
    if (w == 0.0) continue;
    pool.samples.push_back(sample);
    pool.p_hat.push_back(p_hat);
    pool.w_sum.push_back(w_sum += w);
  }
}

/// Each reservoir is a sample of the pool in proportion to its weights, from one of even strata of their sum.
void LightCache::choose_reservoirs(uint32_t cell, const Pool& pool, Rng& rng) {
  const int count = settings_.reservoirs;
  const auto first = static_cast<size_t>(cell) * static_cast<size_t>(count);
  const double w_sum = pool.w_sum.empty() ? 0.0 : pool.w_sum.back();
  for (int i = 0; i < count; ++i) {
    CachedReservoir& slot = reservoirs_[first + place(static_cast<uint32_t>(i))];
    slot = {};
    if (w_sum == 0.0) continue;
    const double u = (i + rng.next_double()) / count * w_sum;
    const auto found = std::upper_bound(pool.w_sum.begin(), pool.w_sum.end() - 1, u);
    const auto chosen = static_cast<size_t>(found - pool.w_sum.begin());
    const auto W = static_cast<float>(w_sum / pool.p_hat[chosen]);
    if (is_weight(W)) {
      slot = {pool.samples[chosen], W, pool.p_hat[chosen]};
    } else {
      non_finite_weights_.fetch_add(1, std::memory_order_relaxed);
    }
  }
}

uint32_t LightCache::place(uint32_t stratum) const {
  const auto count = static_cast<uint32_t>(settings_.reservoirs), merged = static_cast<uint32_t>(settings_.merged);
  if (count % merged != 0) return stratum;
  const uint32_t groups = count / merged;
  return stratum % groups * merged + stratum / groups;
}

/// Magnitude of the sample's light that white paint at the point reflects, in the measure of light_target.h.
float LightCache::point_target(const SurfacePosition& point, const LightSample& sample) const {
  static const PathState state = state_of_receiver();
  const auto light = context_.lights.evaluate(sample, point.position, state, {}, &context_.accel);
  if (!light) return 0.0f;
  const float f_cos = kInvPi * dot(point.normal, light->wi);
  if (!(f_cos > 0.0f)) return 0.0f;
  const bool needs_share = !light->is_delta && light->use_mis;
  const float share =
      needs_share ? light_sample_share(context_, light_candidates_, sample.emitter, light->pdf, f_cos) : 1.0f;
  return magnitude(light->radiance) * f_cos / light->pdf * share;
}

float LightCache::target(uint32_t cell, const LightSample& sample) const {
  const std::span<const SurfacePosition> all = points(cell);
  const size_t count = std::min(all.size(), static_cast<size_t>(settings_.target_points));
  float sum = 0.0f;
  for (size_t i = 0; i < count; ++i) sum += point_target(all[(2 * i + 1) * all.size() / (2 * count)], sample);
  return sum / static_cast<float>(count) + cells_made_[cell].floor * floor_.pmf(sample.emitter);
}

std::optional<uint32_t> LightCache::find(LightCacheKey key) const {
  const auto found = numbers_.find(key);
  if (found == numbers_.end() || !cells_made_[found->second].is_ready) return std::nullopt;
  return found->second;
}

std::span<const CachedReservoir> LightCache::reservoirs(uint32_t cell) const {
  const auto count = static_cast<size_t>(settings_.reservoirs);
  return {reservoirs_.data() + cell * count, count};
}

size_t LightCache::memory_bytes() const {
  constexpr size_t kBytesPerNumber = sizeof(std::pair<LightCacheKey, uint32_t>) + 3 * sizeof(void*);  // about
  return cells_made_.capacity() * sizeof(Cell) + points_.capacity() * sizeof(SurfacePosition) +
         reservoirs_.capacity() * sizeof(CachedReservoir) + requested_.capacity() * sizeof(uint64_t) +
         numbers_.size() * kBytesPerNumber + floor_.memory_bytes();
}

}  // namespace cistern
