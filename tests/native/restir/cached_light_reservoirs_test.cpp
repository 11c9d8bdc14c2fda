#include "restir/cached_light_reservoirs.h"

#include <gtest/gtest.h>

#include "restir/light_cache_scenes.h"

namespace cistern::test {
namespace {

constexpr Vec3 kUp{0.0f, 0.0f, 1.0f};
constexpr Vec3 kPlace{0.4f, 0.3f, 0.0f};
constexpr ReservoirDirectLight::Image kOnePixel{0, 0, 1, 1, 1, 1};

LightCacheSettings small_cache() {
  LightCacheSettings settings;
  settings.reservoirs = 16;
  settings.candidates = 64;
  return settings;
}

DirectReuse reuse_of(Bias bias) {
  DirectReuse reuse;
  reuse.light_candidates = 8;
  reuse.bias = bias;
  return reuse;
}

/// Moments over caches of the estimate W target of one visible point, and the share that took its own sample.
struct Estimates {
  Moments values;
  double own_share = 0.0;
};
Estimates estimate(const LightBench& bench, Bias bias, const VisiblePoint& visible) {
  constexpr uint64_t kCaches = 300;
  constexpr uint32_t kDraws = 4;
  const auto cells = LightCacheCells::build(*bench.scene, 20000, 1);
  const DirectReuse reuse = reuse_of(bias);
  Estimates estimates;
  uint64_t non_finite = 0;
  for (uint64_t seed = 0; seed < kCaches; ++seed) {
    CachedLightReservoirs cached(bench.context, reuse, small_cache(), kOnePixel, seed, cells);
    const ReservoirDirectLight own(bench.context, reuse, kOnePixel, seed);
    double sum = 0.0;
    for (uint32_t frame = 0; frame < kDraws; ++frame) {
      cached.prepare(std::span(&visible, 1), frame, {});
      uint32_t others = 0;
      const LightReservoir r = cached.initial_candidates(visible, 0, frame, non_finite, others);
      EXPECT_EQ(others, static_cast<uint32_t>(small_cache().merged));
      const LightReservoir mine = own.initial_candidates(visible, 0, frame, non_finite);
      sum += r.W * light_target(bench.context, 8.0f, visible, r.sample);
      estimates.own_share += r.sample.emitter == mine.sample.emitter && r.sample.uv.x == mine.sample.uv.x;
    }
    estimates.values.add(sum / kDraws);
  }
  estimates.own_share /= kCaches * kDraws;
  EXPECT_EQ(non_finite, 0u);
  return estimates;
}

TEST(CachedLightReservoirs, MergesAreRightOnAverage) {
  for (const LightSampling sampling : {LightSampling::UNIFORM, LightSampling::TREE}) {
    const LightBench bench(lit_floor(), sampling);
    for (const Vec3 n : {kUp, kTilted}) {
      const VisiblePoint visible = paint_at(kPlace, n);
      const Estimates estimates = estimate(bench, Bias::UNBIASED, visible);
      EXPECT_GT(mean_p_value(estimates.values, exact_sum(bench, 8.0f, visible)), shared_rate(4));
    }
  }
}

TEST(CachedLightReservoirs, PlantedConstantWeightsWithMixedNormalsAreCaught) {
  const LightBench bench(lit_floor());
  const VisiblePoint visible = paint_at(kPlace, kTilted);
  const Estimates estimates = estimate(bench, Bias::FAST, visible);
  const double exact = exact_sum(bench, 8.0f, visible);
  EXPECT_LT(mean_p_value(estimates.values, exact), kFalseAlarmRate);
  EXPECT_LT(estimates.values.mean(), exact) << "1/M darkens";
}

TEST(CachedLightReservoirs, OwnCandidatesKeepTheirSay) {
  const LightBench bench(lit_floor());
  const VisiblePoint visible = paint_at(kPlace, kUp);
  EXPECT_GT(estimate(bench, Bias::UNBIASED, visible).own_share, 0.1);
  EXPECT_LT(estimate(bench, Bias::FAST, visible).own_share, 0.03)
      << "planted: as printed, cached reservoirs count as many samples as there were candidates";
}

TEST(CachedLightReservoirs, WorkWithoutACell) {
  const LightBench bench(lit_floor());
  const VisiblePoint visible = paint_at({0.4f, 0.3f, 1.5f}, kUp);  // in the air
  const auto cells = LightCacheCells::build(*bench.scene, 20000, 1);
  CachedLightReservoirs cached(bench.context, reuse_of(Bias::UNBIASED), small_cache(), kOnePixel, 1, cells);
  ASSERT_TRUE(cached.prepare(std::span(&visible, 1), 0, {}));
  EXPECT_EQ(cached.key(0), kNoLightCacheKey);
  uint64_t non_finite = 0;
  uint32_t others = 0;
  const LightReservoir r = cached.initial_candidates(visible, 0, 0, non_finite, others);
  EXPECT_EQ(r.c, 1.0f);
  EXPECT_EQ(others, 0u);
  EXPECT_GT(r.W, 0.0f);
  EXPECT_EQ(cached.cache().cell_count(), 0u);
}

TEST(CachedLightReservoirs, NoLightsNoCache) {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.diffuse(0.5f));
  const LightBench bench(scene.builder.snapshot());
  const VisiblePoint visible = paint_at(kPlace, kUp);
  const auto cells = LightCacheCells::build(*bench.scene, 20000, 1);
  CachedLightReservoirs cached(bench.context, reuse_of(Bias::UNBIASED), small_cache(), kOnePixel, 1, cells);
  ASSERT_TRUE(cached.prepare(std::span(&visible, 1), 0, {}));
  uint64_t non_finite = 0;
  uint32_t others = 0;
  EXPECT_EQ(cached.initial_candidates(visible, 0, 0, non_finite, others).W, 0.0f);
}

}  // namespace
}  // namespace cistern::test
