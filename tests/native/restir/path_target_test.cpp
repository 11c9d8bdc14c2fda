#include "restir/path_target.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "restir/path_merge.h"
#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

// --- area measure ---------------------------------------------------------------------------------------------------

/// A square on the wall x = 1, all points of which send the same radiance by a light from straight ahead.
constexpr float kSide = 0.8f;
const Vec3 kMiddle{1.0f, 0.0f, 0.7f}, kTowards{-1.0f, 0.0f, 0.0f};

VisiblePoint paint(Vec3 position, Vec3 n) {
  VisiblePoint point;
  point.receiver = {position, n, n, n, Rgb(0.6f), Rgb(), 1.0f, 0.0f};
  point.ng = point.ns = n;
  point.exists = true;
  point.scattered_kinds = kVisibleToDiffuse;
  point.throughput = Rgb(1.0f);
  return point;
}

PathSample on_square(Vec2 u) {
  PathSample sample;
  sample.point = paint(kMiddle + Vec3{0.0f, kSide * (u.x - 0.5f), kSide * (u.y - 0.5f)}, kTowards);
  sample.light = {kTowards, Rgb(2.0f), {}};
  return sample;
}

const VisiblePoint kNear = paint({0.6f, 0.1f, 0.0f}, {0.0f, 0.0f, 1.0f});
const VisiblePoint kFar = paint({-0.7f, 0.3f, 0.0f}, {0.0f, 0.0f, 1.0f});

/// Radiance that `receiver` reflects from the square, by the cosine of its form factor. [Lambert 1760; Baum et al.
/// 1989]
double exact_reflection(const VisiblePoint& receiver) {
  constexpr int kSteps = 400;
  double sum = 0.0;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const Vec2 u{(static_cast<float>(i % kSteps) + 0.5f) / kSteps, (static_cast<float>(i / kSteps) + 0.5f) / kSteps};
    const Vec3 y = on_square(u).point.receiver.position, way = y - receiver.receiver.position;
    const double d = length(way);
    const double cosines = dot(receiver.ng, way) / d * -dot(kTowards, way) / d;
    sum += 0.6 / M_PI * cosines / (d * d) * (0.6 / M_PI * 2.0) * (kSide * kSide) / (kSteps * kSteps);
  }
  return sum;
}

float target(const VisiblePoint& at, const PathSample& sample) {
  return path_target(at, sample, PathTarget::REFLECTED, Reflection::EVALUATED);
}

/// Sample points found from `finder` by cosine-distributed directions, used at `receiver` with W changed by `jacobian`
/// (geometry of finder, geometry of receiver).
template <class Jacobian>
Moments found_elsewhere(const VisiblePoint& finder, const VisiblePoint& receiver, const Jacobian& jacobian) {
  const auto geometry = [](const VisiblePoint& from, Vec3 y) {
    const Vec3 way = y - from.receiver.position;
    return -dot(kTowards, way) / std::pow(length_squared(way), 1.5f);
  };
  Rng rng(3, 0, 0, 0);
  Moments moments;
  for (int i = 0; i < 200000; ++i) {
    const Vec2 u = rng.next_vec2();
    const float phi = 2.0f * kPi * u.x, sine = std::sqrt(u.y);
    const Vec3 wi{sine * std::cos(phi), sine * std::sin(phi), std::sqrt(1.0f - u.y)};
    const float t = wi.x > 0.0f ? (kMiddle.x - finder.receiver.position.x) / wi.x : -1.0f;
    const Vec3 at = finder.receiver.position + t * wi - kMiddle;
    if (t < 0.0f || std::abs(at.y) > 0.5f * kSide || std::abs(at.z) > 0.5f * kSide) {
      moments.add(0.0);  // a null sample
      continue;
    }
    const PathSample sample = on_square({at.y / kSide + 0.5f, at.z / kSide + 0.5f});
    const Vec3 y = sample.point.receiver.position;
    const float own = geometry(finder, y), others = geometry(receiver, y);
    const float W = 1.0f / (wi.z * kInvPi * own);
    moments.add(target(receiver, sample) * W * jacobian(own, others));
  }
  return moments;
}

TEST(PathTarget, WeightsPerAreaNeedNoJacobian) {
  const auto none = [](float, float) { return 1.0f; };
  for (const auto& [finder, receiver] : {std::pair(kNear, kNear), std::pair(kNear, kFar), std::pair(kFar, kNear)})
    EXPECT_GT(mean_p_value(found_elsewhere(finder, receiver, none), exact_reflection(receiver)), shared_rate(3));
}

TEST(PathTarget, PlantedJacobiansAreCaught) {
  // Weights per solid angle: the Jacobian left out, and divided by instead of multiplied with.
  const auto dropped = [](float own, float others) { return own / others; };
  const auto inverted = [](float own, float others) { return sqr(own / others); };
  EXPECT_LT(mean_p_value(found_elsewhere(kNear, kFar, dropped), exact_reflection(kFar)), kFalseAlarmRate);
  EXPECT_LT(mean_p_value(found_elsewhere(kNear, kFar, inverted), exact_reflection(kFar)), kFalseAlarmRate);
}

TEST(PathTarget, NothingIsSentAcrossASurface) {
  const PathSample sample = on_square({0.5f, 0.5f});
  EXPECT_GT(target(kNear, sample), 0.0f);
  EXPECT_EQ(target(paint({1.4f, 0.1f, 0.0f}, {0, 0, 1}), sample), 0.0f) << "behind the sample point";
  EXPECT_EQ(target(paint({0.6f, 0.1f, 0.0f}, {0, 0, -1}), sample), 0.0f) << "behind the receiver";
  EXPECT_EQ(target(paint(sample.point.receiver.position, {0, 0, 1}), sample), 0.0f) << "at the sample point";
}

TEST(PathTarget, RadianceAloneIsATargetToo) {
  const PathSample sample = on_square({0.2f, 0.7f});
  const auto radiance = [&](const VisiblePoint& at) {
    return path_target(at, sample, PathTarget::RADIANCE, Reflection::EVALUATED);
  };
  VisiblePoint dark = kNear;
  dark.receiver.diffuse = Rgb(0.06f);
  EXPECT_FLOAT_EQ(radiance(dark), radiance(kNear));
  EXPECT_NEAR(target(dark, sample), 0.1f * target(kNear, sample), 1e-6f);
}

TEST(PathTarget, SharesOfPointsDoNotDependOnTheColourOfTheLight) {
  // Roulette makes a red path of a white one for a finder that is red.
  VisiblePoint red = kNear, blue = kFar;
  red.receiver.diffuse = {0.5f, 0.02f, 0.02f};
  blue.receiver.diffuse = {0.05f, 0.05f, 0.6f};
  PathSample white = on_square({0.2f, 0.7f}), reddish = white;
  reddish.light.radiance *= Rgb(1.0f, 0.01f, 0.01f);
  reddish.continuation.radiance *= Rgb(1.0f, 0.01f, 0.01f);
  EXPECT_LT(target(red, reddish), 0.5f * target(red, white));
  EXPECT_FLOAT_EQ(target(red, reddish) / target(blue, reddish), target(red, white) / target(blue, white));
}

// --- two receivers of traced paths ----------------------------------------------------------------------------------

/// A box with a lamp that scattered rays meet and one that they do not. Walls of this roughness, or paint below 0.
PathScene box(float roughness) {
  PathScene scene;
  const int paint = scene.diffuse(0.6f), wall = roughness < 0.0f ? scene.diffuse(0.6f) : scene.glossy(roughness);
  scene.floor(0.0f, 4.0f, paint);
  scene.quad({2, 0, 1}, {0, 0, 2}, {0, 4, 0}, wall);
  scene.quad({-2, 0, 1}, {0, 4, 0}, {0, 0, 2}, wall);
  scene.quad({0, 2, 1}, {4, 0, 0}, {0, 0, 2}, wall);
  scene.quad({0, -2, 1}, {0, 0, 2}, {4, 0, 0}, paint);
  scene.quad({0, 0, 2}, {0, 4, 0}, {4, 0, 0}, paint);
  scene.point_lamp({0.5f, 0.6f, 1.2f}, 2.0f);
  scene.builder.add_light(scene.area_lamp({-0.4f, 0, 1.9f}, 2.0f, -1.0f, 2.0f));
  return scene;
}

const Ray kHere{{-1.0f, -0.7f, 1.5f}, normalize(Vec3{1.0f, 0.9f, -1.5f})};
const Ray kThere{{-1.0f, -0.7f, 1.5f}, normalize(Vec3{2.3f, 0.1f, -1.5f})};
const Ray kElsewhere{{-1.0f, -0.7f, 1.5f}, normalize(Vec3{0.0f, 2.3f, -1.5f})};

struct Traced {
  float rest;  // of indirect light
  PathLink link;
};

class PathBench {
 public:
  PathBench(const PathScene& scene, const PathLimits& limits = {}) : tracer(scene, limits) {}

  /// A path's indirect light at its visible point is left to its link.
  Traced trace(const Ray& ray, uint32_t path) {
    PathCapture capture;
    capture.link_count = 1;
    PathSampler sampler(5, 0, path, SampleSequence::RANDOM);
    const PathRecord rest = trace_path(tracer.context(), ray, sampler, scratch_, &capture);
    return {rest.indirect.g, capture.links[0]};
  }
  float reflected(const VisiblePoint& at, const PathSample& sample) const {
    return reflected_path(tracer.context(), at, sample, Reflection::EVALUATED).g;
  }

  Tracer tracer;

 private:
  PathScratch scratch_;
};

constexpr uint32_t kPaths = 20000;

TEST(PathTarget, ASamplePointServesAnotherReceiver) {
  for (const float roughness : {-1.0f, 0.7f}) {
    PathBench bench(box(roughness));
    const VisiblePoint receiver = bench.trace(kThere, 0).link.from;
    Moments own, by_others;
    for (uint32_t path = 0; path < kPaths; ++path) {
      const PathLink there = bench.trace(kThere, path).link, here = bench.trace(kHere, kPaths + path).link;
      own.add(there.W > 0.0f ? bench.reflected(receiver, there.to) * there.W : 0.0f);
      by_others.add(here.W > 0.0f ? bench.reflected(receiver, here.to) * here.W : 0.0f);
    }
    EXPECT_GT(same_mean_p_value(own, by_others), shared_rate(2)) << own.mean() << " " << by_others.mean();
    EXPECT_GT(own.mean(), 0.01);
  }
}

// --- merges ---------------------------------------------------------------------------------------------------------

/// What merges change of the indirect light at the first of these rays' visible points, and that light.
struct MergeMeans {
  Moments change, own;
  /// False-alarm rate of "on average nothing".
  double p_value() const { return mean_p_value(change, 0.0); }
};

float one(const PathLink&) { return 1.0f; }

/// Merged samples hold one direction of light as they should, or both.
enum class Directions { ONE, BOTH };

/// Merges the path of each ray, whose reservoirs have confidence(link). Light by sample points with x below `from_x` is
/// not counted.
template <class Confidence>
MergeMeans merge_paths(PathBench&& bench, std::span<const Ray> rays, uint32_t paths, const PathMergeRules& rules,
                       const Confidence& confidence, Directions directions = Directions::ONE, float from_x = -INFINITY,
                       void (*plant)(PathLink&) = nullptr) {
  MergeMeans means;
  Rng rng(9, 0, 0, 0);
  uint64_t non_finite = 0;
  for (uint32_t path = 0; path < paths; ++path) {
    std::vector<PathLink> links;
    std::vector<PathReservoir> reservoirs;
    for (uint32_t k = 0; k < rays.size(); ++k) links.push_back(bench.trace(rays[k], k * paths + path).link);
    if (plant) std::ranges::for_each(links, plant);
    for (const PathLink& link : links) {
      reservoirs.push_back({link.to, link.W, confidence(link)});
      if (directions == Directions::ONE)
        reservoirs.back() = keep_one_direction(link.from, reservoirs.back(), rules, rng);
    }
    PathCandidates candidates;
    for (size_t k = 0; k < links.size(); ++k) candidates.add(links[k].from, reservoirs[k], INFINITY);
    const PathReference merged = candidates.merge(bench.tracer.context(), rules, rng, non_finite);
    const auto light = [&](const PathSample& sample, float W) {
      return W > 0.0f && sample.point.receiver.position.x > from_x ? bench.reflected(links[0].from, sample) * W : 0.0f;
    };
    const float own = light(links[0].to, links[0].W);
    means.own.add(own);
    means.change.add((merged.W > 0.0f ? light(*merged.sample, merged.W) : 0.0f) - own);
  }
  EXPECT_EQ(non_finite, 0u);
  EXPECT_GT(means.own.mean(), 1e-3);
  return means;
}

constexpr uint32_t kMerges = 15000;
const std::vector<Ray> kTwo{kThere, kHere}, kFour{kThere, kHere, kHere, kElsewhere};

TEST(PathMerge, UnbiasedMergesAreRightOnAverage) {
  for (const float roughness : {-1.0f, 0.7f})
    for (const auto& rays : {kTwo, kFour})
      EXPECT_GT(merge_paths(box(roughness), rays, kMerges, {}, one).p_value(), shared_rate(4)) << roughness;
}

/// A floor before two walls: paths from the far ray mostly find nothing.
PathScene open_corner() {
  PathScene scene;
  const int paint = scene.diffuse(0.6f);
  scene.floor(0.0f, 4.0f, paint);
  scene.quad({2, 0, 0.4f}, {0, 0, 0.8f}, {0, 4, 0}, paint);
  scene.point_lamp({0.5f, 0.6f, 1.2f}, 2.0f);
  return scene;
}

TEST(PathMerge, NullSamplesCount) {
  EXPECT_GT(merge_paths(open_corner(), kTwo, kMerges, {}, one).p_value(), kFalseAlarmRate);
  const auto if_found = [](const PathLink& link) { return link.W > 0.0f ? 1.0f : 0.0f; };
  const MergeMeans planted = merge_paths(open_corner(), kTwo, kMerges, {}, if_found);
  EXPECT_LT(planted.p_value(), kFalseAlarmRate) << "null samples left out";
  EXPECT_GT(planted.change.mean(), 0.0);
}

TEST(PathMerge, FastMergesAreSeenToBeBiased) {
  PathMergeRules fast;
  fast.bias = Bias::FAST;
  fast.reflection = Reflection::AS_FOUND;
  // A wall between the rays' points: of what the other finds, some is hidden.
  PathScene scene = box(0.5f);
  scene.quad({0.7f, 0, 0.5f}, {0, 0, 1}, {0, 2, 0}, scene.diffuse(0.6f));
  EXPECT_GT(merge_paths(scene, kTwo, kMerges, {}, one).p_value(), kFalseAlarmRate);
  EXPECT_LT(merge_paths(scene, kTwo, kMerges, fast, one).p_value(), kFalseAlarmRate);
}

/// A polished plate before a floor. From one ray's point it mirrors a lamp, from the other's a bright ceiling; only
/// continuations meet the ceiling, and by densities that depend on who looks at the plate.
constexpr float kPlateX = 2.0f;
PathScene two_glints() {
  PathScene scene;
  scene.floor(0.0f, 6.0f, scene.diffuse(0.6f));
  scene.quad({kPlateX, 0, 1}, {0, 0, 1.4f}, {0, 1.4f, 0}, scene.glossy(0.25f));
  scene.quad({0.5f, -0.9f, 2.3f}, {0, 2, 0}, {2, 0, 0}, scene.diffuse(0.8f));
  scene.point_lamp({0.8f, 0.8f, 1.8f}, 1.0f);
  scene.builder.add_light(scene.area_lamp({0.8f, -0.8f, 1.8f}, 0.6f, 1.0f, 5.0f));
  return scene;
}
const Ray kSeesLamp{{-1.0f, -0.7f, 1.5f}, normalize(Vec3{1.5f, -0.3f, -1.5f})};
const Ray kSeesCeiling{{-1.0f, -0.7f, 1.5f}, normalize(Vec3{1.5f, 1.7f, -1.5f})};

TEST(PathMerge, GlossySamplePointsAreRightOnAverage) {
  const std::vector<Ray> rays{kSeesLamp, kSeesCeiling, kSeesCeiling, kSeesCeiling, kSeesCeiling};
  const auto merge = [&](Directions directions) {
    return merge_paths(two_glints(), rays, 40000, {}, one, directions, 0.95f * kPlateX);
  };
  EXPECT_GT(merge(Directions::ONE).p_value(), kFalseAlarmRate);
  const MergeMeans planted = merge(Directions::BOTH);
  EXPECT_LT(planted.p_value(), kFalseAlarmRate) << "shares that depend on who found the sample";
}

/// A wall between the rays' points that diffuse rays do not see, another that glossy ones do not, neither there for
/// shadow rays.
PathScene walls_of_kinds() {
  PathScene scene = box(-1.0f);
  scene.floor(0.001f, 3.9f, scene.mixed(0.7f, 0.5f, 0.5f));
  const int paint = scene.diffuse(0.6f);
  scene.quad({0.7f, 0, 0.5f}, {0, 0, 1}, {0, 3, 0}, paint, kVisibleToGlossy);
  scene.quad({0.2f, 0.5f, 0.5f}, {0, 0, 1}, {0, 3, 0}, paint, kVisibleToDiffuse);
  return scene;
}

TEST(PathMerge, SamplesAreSeenByTheRaysThatFindThem) {
  const auto merge = [](bool forgets_kinds) {
    PathBench bench(walls_of_kinds());
    if (forgets_kinds) bench.tracer.forget_kinds();
    return merge_paths(std::move(bench), kFour, 3 * kMerges, {}, one);
  };
  EXPECT_GT(merge(false).p_value(), kFalseAlarmRate);
  EXPECT_LT(merge(true).p_value(), kFalseAlarmRate) << "planted: kinds taken for each other";
}

TEST(PathMerge, PlantedShadowVisibilityIsCaught) {
  PathScene scene = box(-1.0f);
  scene.quad({0.7f, 0, 0.5f}, {0, 0, 1}, {0, 3, 0}, scene.diffuse(0.6f), kVisibleToDiffuse);
  const auto merge = [&](void (*plant)(PathLink&)) {
    return merge_paths(scene, kTwo, kMerges, {}, one, Directions::ONE, -INFINITY, plant);
  };
  EXPECT_GT(merge(nullptr).p_value(), kFalseAlarmRate);
  EXPECT_LT(merge([](PathLink& link) { link.to.point.state.ray_kind = kVisibleToShadow; }).p_value(), kFalseAlarmRate);
}

/// Paint under the first ray's point, a polish that may not bounce beside it.
TEST(PathMerge, LimitsOfAKindHoldForWhatOthersFound) {
  PathScene scene = box(-1.0f);
  scene.quad({-0.7f, 0, 0.001f}, {2.6f, 0, 0}, {0, 3.9f, 0}, scene.mixed(0.7f, 0.6f, 0.7f));
  PathLimits limits;
  limits.max_bounces = 2;
  limits.max_glossy_bounces = 0;
  const auto merge = [&](bool forgets_kinds) {
    PathBench bench(scene, limits);
    if (forgets_kinds) bench.tracer.forget_kinds();
    return merge_paths(std::move(bench), kTwo, kMerges, {}, one);
  };
  EXPECT_GT(merge(false).p_value(), kFalseAlarmRate);
  EXPECT_LT(merge(true).p_value(), kFalseAlarmRate) << "planted: kinds taken for each other";
}

/// The direction is picked before merging, which changes no mean.
TEST(PathMerge, OneDirectionStandsForBoth) {
  PathBench bench(two_glints());
  Rng rng(4, 0, 0, 0);
  Moments change;
  int both = 0;
  for (uint32_t path = 0; path < kPaths; ++path) {
    const PathLink link = bench.trace(kSeesCeiling, path).link;
    if (!(link.W > 0.0f)) continue;
    const PathReservoir one_of = keep_one_direction(link.from, {link.to, link.W, 1.0f}, {}, rng);
    both += !is_black(link.to.light.radiance) && !is_black(link.to.continuation.radiance);
    EXPECT_TRUE(is_black(one_of.sample.light.radiance) || is_black(one_of.sample.continuation.radiance));
    change.add(bench.reflected(link.from, one_of.sample) * one_of.W - bench.reflected(link.from, link.to) * link.W);
  }
  EXPECT_GT(both, 100);
  EXPECT_GT(mean_p_value(change, 0.0), kFalseAlarmRate);
}

}  // namespace
}  // namespace cistern::test
