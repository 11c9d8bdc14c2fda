#include "restir/cell_shared_paths.h"

#include <gtest/gtest.h>

#include <numeric>

#include "base/sphere_map.h"
#include "restir/pixel_reuse.h"
#include "shading/material.h"
#include "transport/path_guide.h"
#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

/// A box with a wall in the middle, which a lamp lights on one side; and light that comes over the wall to the other.
PathScene divided_box() {
  PathScene scene;
  const int paint = scene.diffuse(0.6f), coat = scene.mixed(0.6f, 0.6f, 0.4f);
  scene.floor(0.0f, 4.0f, coat);
  scene.quad({2, 0, 1}, {0, 0, 2}, {0, 4, 0}, paint);
  scene.quad({-2, 0, 1}, {0, 4, 0}, {0, 0, 2}, coat);
  scene.quad({0, 2, 1}, {4, 0, 0}, {0, 0, 2}, paint);
  scene.quad({0, -2, 1}, {0, 0, 2}, {4, 0, 0}, paint);
  scene.quad({0, 0, 2}, {0, 4, 0}, {4, 0, 0}, paint);
  scene.quad({0, 0, 0.6f}, {0, 4, 0}, {0, 0, 1.2f}, paint);
  scene.quad({-0.01f, 0, 0.6f}, {0, 0, 1.2f}, {0, 4, 0}, paint);
  scene.point_lamp({0.8f, 0.6f, 1.6f}, 3.0f);
  return scene;
}

/// On the floor, on either side of the wall.
const Ray kLit{{0.5f, -0.7f, 1.5f}, normalize(Vec3{0.1f, 0.3f, -1.5f})};
const Ray kShaded{{-0.5f, -0.7f, 1.5f}, normalize(Vec3{-0.1f, 0.3f, -1.5f})};
const Ray kCorner{{-0.5f, -0.7f, 1.5f}, normalize(Vec3{-0.9f, 0.5f, -1.5f})};

constexpr uint32_t kPaths = 20000;

/// What sharing changes of the light that each of three points reflects, on average nothing if it is unbiased; and that
/// light.
struct SharedMeans {
  std::array<Moments, 3> change, own;
  /// Smallest of the three, each at `shared_rate(3)`.
  double p_value() const {
    double smallest = 1.0;
    for (const Moments& m : change) smallest = std::min(smallest, mean_p_value(m, 0.0));
    return smallest;
  }
};

/// Roulette among the three samples of a group; none is played by default.
struct Roulette {
  size_t handed_on = 3;
  bool has_fresh_numbers = true;
};

SharedMeans share_paths(PairWeights weights, Roulette roulette = {}) {
  const Tracer tracer(divided_box());
  const CellSharedPaths paths(tracer.context());
  const std::array<Ray, 3> rays{kLit, kShaded, kCorner};
  PathScratch path_scratch;
  CellSharedPaths::Scratch scratch;
  SharedMeans means;
  for (uint32_t path = 0; path < kPaths; ++path) {
    std::array<PathCapture, 3> captures;
    std::array<ReflectedPaths, 3> reflected;
    CellSharedPaths::Group group;
    group.weights = weights;
    group.handed_on = roulette.handed_on;
    if (roulette.has_fresh_numbers) group.u_choice = Rng(11, 0, path, 0).next_double();
    for (uint32_t k = 0; k < 3; ++k) {
      captures[k].link_count = 1;
      PathSampler sampler(7, k, path, SampleSequence::RANDOM);
      trace_path(tracer.context(), rays[k], sampler, path_scratch, &captures[k]);
      CellSharedPaths::divide(captures[k].links[0], {}, reflected[k]);
      group.links.push_back(&captures[k].links[0]);
      group.confidences.push_back(1.0f + static_cast<float>(k));  // made up: any that do not look at samples
      group.reflected.push_back(&reflected[k]);
    }
    paths.share(group, scratch);
    for (uint32_t k = 0; k < 3; ++k) {
      means.change[k].add(reflected[k].sum.g - reflected[k].own.g);
      means.own[k].add(reflected[k].own.g);
    }
  }
  return means;
}

TEST(CellSharedPaths, SharedLightIsOnAverageThatOfThePointsOwnPaths) {
  const SharedMeans means = share_paths(PairWeights::BALANCE);
  EXPECT_GT(means.p_value(), shared_rate(3));
  for (const Moments& own : means.own) EXPECT_GT(own.mean(), 0.005);
}

TEST(CellSharedPaths, TargetsInPlaceOfDensitiesAreLawfulWeights) {
  EXPECT_GT(share_paths(PairWeights::TARGETS).p_value(), shared_rate(3));
}

/// Planted bugs: densities without visibility, and 1/n.
TEST(CellSharedPaths, OtherWeightsAreSeenToBeBiased) {
  EXPECT_LT(share_paths(PairWeights::UNSHADOWED).p_value(), kFalseAlarmRate);
  EXPECT_LT(share_paths(PairWeights::EQUAL).p_value(), kFalseAlarmRate);
}

/// What the points' own paths bring is no matter of chance, but for rounding.
TEST(CellSharedPaths, RouletteAmongSamplesChangesNoExpectation) {
  const SharedMeans means = share_paths(PairWeights::BALANCE, {.handed_on = 1});
  EXPECT_GT(means.p_value(), shared_rate(3));
  const SharedMeans all = share_paths(PairWeights::BALANCE);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(means.own[k].mean(), all.own[k].mean(), 1e-5 * all.own[k].mean());
    EXPECT_NE(means.change[k].mean(), all.change[k].mean());
  }
}

/// Planted bug: the same number for all groups.
TEST(CellSharedPaths, RouletteWithoutFreshNumbersIsSeenToBeBiased) {
  EXPECT_LT(share_paths(PairWeights::BALANCE, {.handed_on = 1, .has_fresh_numbers = false}).p_value(), kFalseAlarmRate);
}

/// Also where nearly all light is that of one sample, which is handed on certainly.
TEST(CellSharedPaths, AsManySamplesAreHandedOnAsAreAskedFor) {
  constexpr size_t kVertices = 64, kAsked = 8;
  const Tracer tracer(divided_box());
  const CellSharedPaths paths(tracer.context());
  PathScratch path_scratch;
  CellSharedPaths::Scratch scratch;
  for (const float brightest : {1.0f, 1e4f}) {
    for (uint32_t path = 0; path < 20; ++path) {
      std::vector<PathCapture> captures(kVertices);
      std::vector<ReflectedPaths> reflected(kVertices);
      CellSharedPaths::Group group;
      group.handed_on = kAsked;
      group.u_choice = Rng(11, 0, path, 0).next_double();
      for (uint32_t k = 0; k < kVertices; ++k) {
        captures[k].link_count = 1;
        PathSampler sampler(7, k, path, SampleSequence::RANDOM);
        trace_path(tracer.context(), kLit, sampler, path_scratch, &captures[k]);
        CellSharedPaths::divide(captures[k].links[0], {}, reflected[k]);
        group.links.push_back(&captures[k].links[0]);
        group.reflected.push_back(&reflected[k]);
      }
      const auto light = [](const PathCapture& c) { return magnitude(c.links[0].to.continuation.radiance); };
      PathLink& first = std::ranges::max_element(captures, {}, light)->links[0];
      first.to.continuation.radiance *= brightest;
      EXPECT_NEAR(static_cast<double>(paths.share(group, scratch)), kAsked, 1.0);
      if (brightest > 1.0f) {
        const auto it = std::ranges::find(group.links, &first);
        EXPECT_EQ(scratch.factors[static_cast<size_t>(it - group.links.begin())], 1.0f);
      }
    }
  }
}

/// How many of a hundred pairs of paths, changed by `alter`, leave either point something else than its own.
template <class Alter>
int pairs_that_share(const Alter& alter) {
  const Tracer tracer(divided_box());
  const CellSharedPaths paths(tracer.context());
  PathScratch path_scratch;
  CellSharedPaths::Scratch scratch;
  int changed = 0;
  for (uint32_t path = 0; path < 100; ++path) {
    std::array<PathCapture, 2> captures;
    std::array<ReflectedPaths, 2> reflected;
    CellSharedPaths::Group group;
    for (uint32_t k = 0; k < 2; ++k) {
      captures[k].link_count = 1;
      PathSampler sampler(7, k, path, SampleSequence::RANDOM);
      trace_path(tracer.context(), k == 0 ? kLit : kCorner, sampler, path_scratch, &captures[k]);
      alter(captures[k].links[0], k);
      CellSharedPaths::divide(captures[k].links[0], {}, reflected[k]);
      group.links.push_back(&captures[k].links[0]);
      group.confidences.push_back(1.0f);
      group.reflected.push_back(&reflected[k]);
    }
    paths.share(group, scratch);
    changed += std::ranges::any_of(
        reflected, [](const ReflectedPaths& r) { return std::abs(r.sum.g - r.own.g) > 1e-5f * (r.sum.g + r.own.g); });
  }
  return changed;
}

/// Groups keep them apart by hashes, which may collide.
TEST(CellSharedPaths, PathsWithOtherBouncesLeftStayApart) {
  EXPECT_GT(pairs_that_share([](PathLink&, uint32_t) {}), 8);
  const auto set_back = [](PathLink& link, uint32_t k) { link.from.state.diffuse_depth += static_cast<uint16_t>(k); };
  EXPECT_EQ(pairs_that_share(set_back), 0);
}

TEST(CellSharedPaths, SamplesWithoutAnEvenPartStayWithTheirFinders) {
  const auto make_uneven = [](PathLink& link, uint32_t) {
    link.to.light.even_cos = link.to.continuation.even_cos = Rgb();
  };
  EXPECT_EQ(pairs_that_share(make_uneven), 0);
}

TEST(CellSharedPaths, AloneAPointKeepsItsOwn) {
  const Tracer tracer(divided_box());
  const CellSharedPaths paths(tracer.context());
  PathScratch path_scratch;
  CellSharedPaths::Scratch scratch;
  int found = 0;
  for (uint32_t path = 0; path < 100; ++path) {
    PathCapture capture;
    capture.link_count = 1;
    PathSampler sampler(7, 0, path, SampleSequence::RANDOM);
    trace_path(tracer.context(), kLit, sampler, path_scratch, &capture);
    ReflectedPaths reflected;
    CellSharedPaths::divide(capture.links[0], {}, reflected);
    CellSharedPaths::Group group{.links = {&capture.links[0]}, .confidences = {1.0f}, .reflected = {&reflected}};
    paths.share(group, scratch);
    EXPECT_NEAR(reflected.sum.g, reflected.own.g, 1e-5f * reflected.own.g);
    found += reflected.own.g > 0.0f;
  }
  EXPECT_GT(found, 20);
}

/// What vertices reflect of each other's divided samples, pair by pair.
std::vector<Rgb> shared_pair_by_pair(const PathContext& context, const std::vector<const PathLink*>& links) {
  std::vector<Rgb> reflected(links.size());
  for (size_t finder = 0; finder < links.size(); ++finder) {
    const PathSample& sample = links[finder]->to;
    if (links[finder]->W == 0.0f) continue;
    std::vector<Rgb> responses(links.size());
    std::vector<float> densities(links.size());
    const Rgb own_way = path_transmittance(context, links[finder]->from, sample);
    for (size_t k = 0; k < links.size(); ++k) {
      const VisiblePoint& from = links[k]->from;
      const std::optional<PathConnection> way = connect(from, sample);
      if (!way || !has_same_bounces(from, links[finder]->from)) continue;
      Bsdf bsdf = evaluate_material(context.scene, surface_point(from), from.state);
      guide_bounce(context, guide_cells(context, surface_point(from)), bsdf);
      const BsdfEvaluation f = evaluate_kind(context, bsdf, way->wi, sample.kind);
      const Rgb transmittance = path_transmittance(context, from, sample);
      // The veil takes half: what is left tells how often it was passed.
      if (is_black(f.rough_cos) || transmittance.g != own_way.g) continue;
      densities[k] = f.pdf * way->geometry;
      responses[k] = f.rough_cos * transmittance * way->geometry;
    }
    const float sum = std::accumulate(densities.begin(), densities.end(), 0.0f);
    if (!(densities[finder] > 0.0f)) continue;
    const float weight = links[finder]->W * densities[finder] / sum;
    for (size_t k = 0; k < links.size(); ++k) reflected[k] += responses[k] * sample.continuation.radiance * weight;
  }
  return reflected;
}

/// Vertices that are compared, those that reflect another light, and those that have theirs from others alone.
struct ComparedPairs {
  int compared = 0, different = 0, handed_on = 0;
};

/// Groups of up to eleven: more than vector instructions take at once, and not a multiple of it.
ComparedPairs compare_pairs(const PathContext& context, const PathContext& of_reference) {
  const CellSharedPaths paths(context);
  PathScratch path_scratch;
  CellSharedPaths::Scratch scratch;
  ComparedPairs result;
  for (uint32_t path = 0; path < 300; ++path) {
    const uint32_t size = 1 + path % 11;
    std::vector<PathCapture> captures(size);
    std::vector<ReflectedPaths> reflected(size);
    std::vector<Rgb> before(size);
    CellSharedPaths::Group group;
    for (uint32_t k = 0; k < size; ++k) {
      const Ray ray{{0.5f, -0.7f, 1.5f}, normalize(Vec3{-0.1f * static_cast<float>(k), 0.3f, -1.5f})};
      captures[k].link_count = 1;
      PathSampler sampler(7, k, path, SampleSequence::RANDOM);
      trace_path(context, ray, sampler, path_scratch, &captures[k]);
      CellSharedPaths::divide(captures[k].links[0], {}, reflected[k]);
      before[k] = reflected[k].sum;
      group.links.push_back(&captures[k].links[0]);
      group.confidences.push_back(1.0f);
      group.reflected.push_back(&reflected[k]);
    }
    paths.share(group, scratch);
    const std::vector<Rgb> expected = shared_pair_by_pair(of_reference, group.links);
    for (uint32_t k = 0; k < size; ++k, ++result.compared) {
      const float found = (reflected[k].sum - before[k]).g;
      result.different += std::abs(found - expected[k].g) > 1e-4f * expected[k].g + 1e-6f;
      result.handed_on += group.links[k]->W == 0.0f && found > 0.0f;
    }
  }
  return result;
}

/// The box with a veil above its floor, of which parts are paint and parts let light through: vertices of a group are
/// evaluated in all ways there are.
PathScene mixed_floor() {
  PathScene scene = divided_box();
  scene.floor(0.3f, 1.5f, scene.transparent({0.5f, 0.5f, 0.5f}));
  scene.quad({0.3f, -0.4f, 0.01f}, {0.2f, 0, 0}, {0, 0.2f, 0}, scene.diffuse(0.5f));
  scene.quad({0.05f, -0.4f, 0.01f}, {0.2f, 0, 0}, {0, 0.2f, 0}, scene.clear_glass(1.5f, 0.7f, {}, 0.5f));
  return scene;
}

/// Shadow rays may miss or meet an edge by rounding, which once in a thousand is allowed.
TEST(CellSharedPaths, PairsTakenTogetherAreWhatTheyAreAlone) {
  const Tracer tracer(mixed_floor());
  const ComparedPairs pairs = compare_pairs(tracer.context(), tracer.context());
  EXPECT_LE(pairs.different, pairs.compared / 1000);
  EXPECT_GT(pairs.handed_on, 20);
}

TEST(CellSharedPaths, PairsThatAreGuidedAreWhatTheyAreAlone) {
  const Tracer tracer(mixed_floor());
  const NestedCells cells({}, tracer.context().accel.bounds(), {0.5f, -0.7f, 1.5f}, 1e-2f, 0.0f);
  std::vector<CausticPhoton> photons;
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 position{rng.next_float() - 0.5f, 0.4f * rng.next_float() - 0.6f, i % 2 == 0 ? 0.0f : 0.01f};
    const Vec3 direction = normalize(Vec3{0.4f, 0.5f, 0.8f} + 0.3f * equal_area_direction(rng.next_vec2()));
    photons.push_back({cells.key(position, {0, 0, 1}), position, direction, 1.0f, 0.3f, 0.2f, 0.05f});
  }
  const CausticGuide guide(cells, photons);
  PathContext guided = tracer.context();
  guided.caustics = &guide;
  const ComparedPairs pairs = compare_pairs(guided, guided);
  EXPECT_LE(pairs.different, pairs.compared / 1000);
  const ComparedPairs planted = compare_pairs(guided, tracer.context());  // planted bug: as if nothing was guided
  EXPECT_GT(planted.different, planted.compared / 10);
}

/// Before, a product of infinity and zero took all of a group along.
TEST(CellSharedPaths, LightBeyondTheRangeOfNumbersReachesThoseAloneThatSeeIt) {
  const Tracer tracer(divided_box());
  const CellSharedPaths paths(tracer.context());
  PathScratch path_scratch;
  CellSharedPaths::Scratch scratch;
  int reached = 0, spared = 0;
  for (uint32_t path = 0; path < 400; ++path) {
    const std::array<Ray, 3> rays{kLit, kShaded, kCorner};
    std::array<PathCapture, 3> captures;
    std::array<ReflectedPaths, 3> reflected;
    CellSharedPaths::Group group;
    for (uint32_t k = 0; k < 3; ++k) {
      captures[k].link_count = 1;
      PathSampler sampler(7, k, path, SampleSequence::RANDOM);
      trace_path(tracer.context(), rays[k], sampler, path_scratch, &captures[k]);
      CellSharedPaths::divide(captures[k].links[0], {}, reflected[k]);
      group.links.push_back(&captures[k].links[0]);
      group.confidences.push_back(1.0f);
      group.reflected.push_back(&reflected[k]);
    }
    std::array<bool, 3> is_reached;
    reflected = {};
    paths.share(group, scratch);
    for (uint32_t k = 0; k < 3; ++k) is_reached[k] = !is_black(reflected[k].sum);
    for (PathCapture& capture : captures)
      if (Rgb& light = capture.links[0].to.continuation.radiance; !is_black(light)) light = Rgb(INFINITY);
    reflected = {};
    paths.share(group, scratch);
    for (uint32_t k = 0; k < 3; ++k) {
      EXPECT_EQ(std::isfinite(reflected[k].sum.g), !is_reached[k]);
      (is_reached[k] ? reached : spared) += 1;
    }
  }
  EXPECT_GT(reached, 20);
  EXPECT_GT(spared, 10);
}

}  // namespace
}  // namespace cistern::test
