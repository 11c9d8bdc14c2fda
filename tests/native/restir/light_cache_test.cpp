#include "restir/light_cache.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "restir/light_cache_scenes.h"

namespace cistern::test {
namespace {

constexpr float kOwnCandidates = 8.0f;
constexpr Vec3 kUp{0.0f, 0.0f, 1.0f};
constexpr Vec3 kPlace{0.4f, 0.3f, 0.0f};

LightCacheSettings small_cache() {
  LightCacheSettings settings;
  settings.surface_points = 20000;
  settings.reservoirs = 16;
  settings.candidates = 64;
  settings.refresh_frames = 4;
  settings.renewals_per_pixel = 1e9f;
  return settings;
}

std::shared_ptr<const LightCacheCells> cells_of(const LightBench& bench) {
  return LightCacheCells::build(*bench.scene, static_cast<uint32_t>(small_cache().surface_points), 1);
}

bool prepare(LightCache& cache, std::span<const LightCacheKey> keys, uint32_t frame, const WorkMonitor& monitor) {
  cache.request(keys);
  return cache.prepare(frame, monitor);
}

double mean_of(const LightBench& bench, std::span<const CachedReservoir> reservoirs, const VisiblePoint& visible) {
  double sum = 0.0;
  for (const CachedReservoir& r : reservoirs)
    if (r.W > 0.0f) sum += r.W * light_target(bench.context, kOwnCandidates, visible, r.sample);
  return sum / static_cast<double>(reservoirs.size());
}

/// p-value of the mean of W g over caches of different seeds being the exact sum of g, the receiver's target. After
/// `frame` 0 the reservoirs are those made first; from refresh_frames on they have been made anew.
double p_value_of(const LightBench& bench, Bias bias, const VisiblePoint& visible, uint32_t frame = 0) {
  constexpr uint64_t kCaches = 300;
  const auto cells = cells_of(bench);
  const LightCacheKey key = cells->key_of(visible.receiver.position, visible.ng);
  Moments means;
  for (uint64_t seed = 0; seed < kCaches; ++seed) {
    LightCache cache(bench.context, small_cache(), kOwnCandidates, bias, seed, cells);
    for (const uint32_t f : {uint32_t{0}, frame}) prepare(cache, std::span(&key, 1), f, {});
    means.add(mean_of(bench, cache.reservoirs(*cache.find(key)), visible));
    EXPECT_EQ(cache.non_finite_weights(), 0u);
  }
  return mean_p_value(means, exact_sum(bench, kOwnCandidates, visible));
}

TEST(LightCache, WeightsAreRightForEveryReceiverOfACell) {
  for (const LightSampling sampling : {LightSampling::UNIFORM, LightSampling::POWER, LightSampling::TREE}) {
    const LightBench bench(lit_floor(), sampling);
    EXPECT_GT(p_value_of(bench, Bias::UNBIASED, paint_at(kPlace, kUp)), shared_rate(7));
    EXPECT_GT(p_value_of(bench, Bias::UNBIASED, paint_at(kPlace, kTilted)), shared_rate(7));
  }
  const LightBench bench(lit_floor());
  EXPECT_GT(p_value_of(bench, Bias::UNBIASED, paint_at(kPlace, kTilted), 4), shared_rate(7)) << "made anew";
}

TEST(LightCache, PlantedSupportOfSurfacePointsIsCaught) {
  const LightBench bench(lit_floor());
  EXPECT_GT(p_value_of(bench, Bias::FAST, paint_at(kPlace, kUp)), kFalseAlarmRate);
  EXPECT_LT(p_value_of(bench, Bias::FAST, paint_at(kPlace, kTilted)), kFalseAlarmRate)
      << "as printed: no point of the floor proposes the lamp below it";
}

TEST(LightCache, TargetsArePositiveForEveryEmitter) {
  const LightBench bench(lit_floor());
  const auto cells = cells_of(bench);
  const LightCacheKey key = cells->key_of(kPlace, kUp);
  for (const Bias bias : {Bias::UNBIASED, Bias::FAST}) {
    LightCache cache(bench.context, small_cache(), kOwnCandidates, bias, 1, cells);
    prepare(cache, std::span(&key, 1), 0, {});
    size_t zeros = 0;
    for (uint32_t e = 0; e < bench.lights.emitter_count(); ++e)
      for (const float u : {0.0f, 0.3f, kOneMinusEpsilon}) zeros += !(cache.target(0, {e, {u, u}}) > 0.0f);
    EXPECT_EQ(zeros, bias == Bias::UNBIASED ? 0u : 3u) << "planted: without the floor the lamp below has none";
  }
}

TEST(LightCache, StoredTargetsAreThoseOfTheCell) {
  const LightBench bench(lit_floor());
  const auto cells = cells_of(bench);
  const LightCacheKey key = cells->key_of(kPlace, kUp);
  LightCache cache(bench.context, small_cache(), kOwnCandidates, Bias::UNBIASED, 1, cells);
  for (uint32_t frame = 0; frame < 3; ++frame) prepare(cache, std::span(&key, 1), frame, {});
  for (const CachedReservoir& r : cache.reservoirs(0)) {
    ASSERT_GT(r.W, 0.0f);
    ASSERT_EQ(r.p_hat, cache.target(0, r.sample));
  }
}

std::vector<CachedReservoir> copy_of(const LightCache& cache, uint32_t cell) {
  return {cache.reservoirs(cell).begin(), cache.reservoirs(cell).end()};
}

bool is_same(const CachedReservoir& a, const CachedReservoir& b) {
  return a.sample.emitter == b.sample.emitter && a.sample.uv.x == b.sample.uv.x && a.sample.uv.y == b.sample.uv.y &&
         a.W == b.W;
}

/// How often each of many cells has been made anew in a number of frames, and how many at most in one frame. A cell is
/// made as a whole; `seed` decides what it holds.
struct Renewals {
  std::vector<int> of_cell;
  int most_at_once = 0;
};
Renewals renewals(Bias bias, uint64_t seed, uint32_t frames) {
  const LightBench bench(lit_floor());
  const auto cells = cells_of(bench);
  std::vector<LightCacheKey> keys;
  for (int i = 0; i < 40; ++i) keys.push_back(cells->key_of({0.09f * static_cast<float>(i) - 1.8f, 0.0f, 0.0f}, kUp));
  LightCache cache(bench.context, small_cache(), kOwnCandidates, bias, seed, cells);
  prepare(cache, keys, 0, {});
  Renewals result{std::vector<int>(cache.cell_count())};
  for (uint32_t frame = 1; frame <= frames; ++frame) {
    std::vector<std::vector<CachedReservoir>> before;
    for (uint32_t cell = 0; cell < cache.cell_count(); ++cell) before.push_back(copy_of(cache, cell));
    prepare(cache, keys, frame, {});
    int at_once = 0;
    for (uint32_t cell = 0; cell < cache.cell_count(); ++cell) {
      const bool is_new = !is_same(before[cell][0], cache.reservoirs(cell)[0]);
      for (size_t i = 0; i < before[cell].size(); ++i)
        EXPECT_EQ(is_new, !is_same(before[cell][i], cache.reservoirs(cell)[i]));
      result.of_cell[cell] += is_new;
      at_once += is_new;
    }
    result.most_at_once = std::max(result.most_at_once, at_once);
  }
  return result;
}

TEST(LightCache, MakesAllCellsAnewInTurn) {
  const Renewals first = renewals(Bias::UNBIASED, 1, 12);
  ASSERT_GT(first.of_cell.size(), 20u);
  for (const int count : first.of_cell) EXPECT_EQ(count, 3);
  EXPECT_LT(first.most_at_once, static_cast<int>(first.of_cell.size()) / 2) << "the work is spread over frames";
  EXPECT_EQ(first.most_at_once, renewals(Bias::UNBIASED, 2, 12).most_at_once) << "whatever they hold";
  for (const int count : renewals(Bias::FAST, 1, 5).of_cell) EXPECT_EQ(count, 0) << "as printed: made once";
}

/// Mean square of the relative error that is left when a cache's estimate is averaged over frames, over seeds.
double error_of_long_run(Bias bias) {
  constexpr uint32_t kFrames = 96;
  const LightBench bench(lit_floor());
  const auto cells = cells_of(bench);
  const VisiblePoint visible = paint_at(kPlace, kUp);
  const LightCacheKey key = cells->key_of(kPlace, kUp);
  const double exact = exact_sum(bench, kOwnCandidates, visible);
  Moments squares;
  for (uint64_t seed = 0; seed < 40; ++seed) {
    LightCache cache(bench.context, small_cache(), kOwnCandidates, bias, seed, cells);
    double sum = 0.0;
    for (uint32_t frame = 0; frame < kFrames; ++frame) {
      prepare(cache, std::span(&key, 1), frame, {});
      sum += mean_of(bench, cache.reservoirs(0), visible);
    }
    squares.add(sqr(static_cast<float>(sum / kFrames / exact - 1.0)));
  }
  return squares.mean();
}

TEST(LightCache, LongRunsForgetTheFirstCache) {
  // Made 24 times, so that about 1/24 of the variance is left; a frozen cache keeps all. Two means of 40 squares whose
  // true ratio that is are 0.3 apart at a rate far below 1e-4.
  EXPECT_LT(error_of_long_run(Bias::UNBIASED), 0.3 * error_of_long_run(Bias::FAST));
}

TEST(LightCache, StopsAndGoesOn) {
  const LightBench bench(lit_floor());
  const auto cells = cells_of(bench);
  const LightCacheKey keys[] = {cells->key_of(kPlace, kUp), kNoLightCacheKey, cells->key_of({1, 1, 0}, kUp)};
  LightCache cache(bench.context, small_cache(), kOwnCandidates, Bias::UNBIASED, 1, cells);
  EXPECT_FALSE(prepare(cache, keys, 0, {[] { return true; }}));
  EXPECT_FALSE(cache.find(keys[0]));
  float last = 0.0f;
  EXPECT_TRUE(prepare(cache, keys, 0, {[] { return false; }, [&](float done) { last = done; }}));
  EXPECT_EQ(last, 1.0f);
  EXPECT_TRUE(cache.find(keys[0]) && cache.find(keys[2]));
  EXPECT_FALSE(cache.find(kNoLightCacheKey));
  EXPECT_EQ(cache.cell_count(), 2u);
}

TEST(LightCache, DoesNotDependOnThreads) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 7);
  const LightBench bench(lit_floor());
  const auto cells = cells_of(bench);
  std::vector<LightCacheKey> keys;
  for (int i = 0; i < 400; ++i)
    keys.push_back(cells->key_of({0.2f * static_cast<float>(i % 20) - 1.9f, 0.01f * static_cast<float>(i), 0.0f}, kUp));
  std::vector<CachedReservoir> expected;
  for (const int threads : {1, 2, 7}) {
    LightCache cache(bench.context, small_cache(), kOwnCandidates, Bias::UNBIASED, 1, cells);
    tbb::task_arena(threads).execute([&] {
      for (uint32_t frame = 0; frame < 2; ++frame) prepare(cache, keys, frame, {});
    });
    std::vector<CachedReservoir> all;
    for (uint32_t cell = 0; cell < cache.cell_count(); ++cell)
      for (const CachedReservoir& r : cache.reservoirs(cell)) all.push_back(r);
    if (expected.empty()) expected = all;
    ASSERT_EQ(all.size(), expected.size());
    for (size_t i = 0; i < all.size(); ++i) ASSERT_TRUE(is_same(all[i], expected[i])) << threads << " threads";
  }
}

}  // namespace
}  // namespace cistern::test
