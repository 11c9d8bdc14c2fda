#include "lights/emitter_clusters.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "base/rng.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

/// `objects` scattered things of `size` emitters each, within 0.1 m, and a distant one.
struct Emitters {
  std::vector<EmitterPlace> places;
  std::vector<float> powers;

  Emitters(uint32_t objects, uint32_t size) {
    Rng rng(1, 0, 0, 0);
    for (uint32_t object = 0; object < objects; ++object) {
      const Vec3 center{10 * rng.next_float(), 10 * rng.next_float(), 3 * rng.next_float()};
      for (uint32_t i = 0; i < size; ++i) {
        const Vec3 offset{0.1f * rng.next_float(), 0.1f * rng.next_float(), 0.0f};
        places.push_back({center + offset, object, false});
        powers.push_back(rng.next_float() < 0.2f ? 0.0f : rng.next_float());
      }
    }
    places.push_back({{}, objects, true});
    powers.push_back(5.0f);
  }
  EmitterClusters clusters(size_t most) const { return EmitterClusters(places, powers, most); }
};

TEST(EmitterClusters, FewEmittersStandAlone) {
  const EmitterClusters clusters = Emitters(5, 3).clusters(16);
  EXPECT_EQ(clusters.count(), 16u);
  for (uint32_t e = 0; e < 16; ++e) {
    EXPECT_EQ(clusters.cluster_of(e), e);
    EXPECT_EQ(clusters.pmf(e), 1.0f);
    EXPECT_EQ(clusters.choose(e, 0.7f), e);
  }
}

TEST(EmitterClusters, KeepObjectsTogetherWhileTheyFit) {
  const Emitters emitters(20, 7);
  const EmitterClusters clusters = emitters.clusters(21);
  std::map<uint32_t, uint32_t> object_of_cluster;
  for (uint32_t e = 0; e < emitters.places.size(); ++e) {
    const auto [it, is_new] = object_of_cluster.emplace(clusters.cluster_of(e), emitters.places[e].object);
    EXPECT_EQ(it->second, emitters.places[e].object);
  }
  EXPECT_EQ(object_of_cluster.size(), 21u);
}

TEST(EmitterClusters, CutLargeObjectsAndJoinSmallOnes) {
  for (const auto& [objects, size] : {std::pair(1u, 5000u), std::pair(3000u, 1u), std::pair(100u, 40u)}) {
    const Emitters emitters(objects, size);
    const EmitterClusters clusters = emitters.clusters(200);
    EXPECT_LE(clusters.count(), 200u);
    EXPECT_GE(clusters.count(), 100u);
    std::map<uint32_t, Bounds3> boxes;
    for (uint32_t e = 0; e < emitters.places.size(); ++e)
      if (!emitters.places[e].is_distant) boxes[clusters.cluster_of(e)].extend(emitters.places[e].center);
    double mean = 0.0;
    for (const auto& [cluster, box] : boxes) mean += length(box.diagonal()) / static_cast<double>(boxes.size());
    EXPECT_LT(mean, 4.0) << "of 14 m: members are neighbours";
  }
}

TEST(EmitterClusters, ChooseByPowerWithin) {
  const Emitters emitters(4, 50);
  const EmitterClusters clusters = emitters.clusters(5);
  const double rate = shared_rate(5);
  for (uint32_t cluster = 0; cluster < clusters.count(); ++cluster) {
    constexpr int kDraws = 20000;
    std::vector<double> observed(emitters.places.size()), expected(emitters.places.size()), planted;
    Rng rng(2, cluster, 0, 0);
    for (int i = 0; i < kDraws; ++i) ++observed[clusters.choose(cluster, rng.next_float())];
    double sum = 0.0;
    for (uint32_t e = 0; e < emitters.places.size(); ++e) {
      if (clusters.cluster_of(e) == cluster) sum += clusters.pmf(e), expected[e] = kDraws * double{clusters.pmf(e)};
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
    EXPECT_GT(chi_square_p_value(observed, expected), rate);
    if (clusters.has_one_emitter(cluster)) continue;
    planted.assign(expected.size(), 0.0);  // planted: alike instead of by power
    for (uint32_t e = 0; e < planted.size(); ++e)
      if (expected[e] > 0.0) planted[e] = kDraws / 40.0;
    EXPECT_LT(chi_square_p_value(observed, planted), rate);
  }
}

TEST(EmitterClusters, FaintOnesAreChosenAsOftenAsTheirProbability) {
  constexpr uint32_t kFaint = 1000;
  constexpr double kPower = 1e-8;
  const std::vector<EmitterPlace> places(1 + kFaint, EmitterPlace{{}, 0, false});
  std::vector<float> powers(places.size(), static_cast<float>(kPower));
  powers[0] = 1.0f;
  const EmitterClusters clusters(places, powers, 1);
  uint32_t found = 0, found_by_float = 0;
  for (uint32_t e = 1; e <= kFaint; ++e) {
    const double middle = (1.0 + (e - 0.5) * kPower) / (1.0 + kFaint * kPower);  // of its share of [0, 1)
    found += clusters.choose(0, middle) == e;
    found_by_float += clusters.choose(0, static_cast<float>(middle)) == e;  // planted bug
  }
  EXPECT_EQ(found, kFaint);
  EXPECT_LT(found_by_float, 500u);
}

TEST(EmitterClusters, NeverChooseWithoutPower) {
  const std::vector<EmitterPlace> places(4, EmitterPlace{{}, 0, false});
  const EmitterClusters clusters(places, std::vector<float>{0.0f, 1.0f, 2.0f, 0.0f}, 1);
  for (const float u : {0.0f, 0.3f, 0.9f, kOneMinusEpsilon}) {
    const uint32_t e = clusters.choose(0, u);
    EXPECT_TRUE(e == 1 || e == 2);
  }
}

}  // namespace
}  // namespace cistern::test
