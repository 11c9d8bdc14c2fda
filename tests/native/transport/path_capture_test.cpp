#include "transport/path_capture.h"

#include <gtest/gtest.h>

#include "restir/light_target.h"
#include "restir/path_target.h"
#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

/// A painted or polished floor under a half-glossy wall that a hidden point lamp lights, with more walls around: light
/// that no scattered ray can meet, so paths with and without capture use the same random numbers for the same things.
struct Corner {
  float floor_roughness = -1.0f;  // below 0: paint
  float wall_roughness = -1.0f;
  bool has_pane = false;   // half transparent, between floor and wall
  bool has_panel = false;  // a lamp that scattered rays meet
};

PathScene make(const Corner& corner) {
  PathScene scene;
  const auto material = [&](float roughness) {
    return roughness < 0.0f ? scene.diffuse(0.7f) : scene.glossy(roughness);
  };
  const int paint = scene.diffuse(0.6f);
  scene.floor(0.0f, 4.0f, material(corner.floor_roughness));
  scene.quad({2, 0, 1}, {0, 0, 2}, {0, 4, 0}, material(corner.wall_roughness));
  scene.quad({-2, 0, 1}, {0, 4, 0}, {0, 0, 2}, paint);
  scene.quad({0, 2, 1}, {4, 0, 0}, {0, 0, 2}, material(corner.wall_roughness));
  scene.quad({0, -2, 1}, {0, 0, 2}, {4, 0, 0}, paint);
  scene.quad({0, 0, 2}, {0, 4, 0}, {4, 0, 0}, paint);
  if (corner.has_pane)
    scene.quad({0.8f, 0, 0.7f}, {0, 0, 1}, {0, 3, 0}, scene.transparent({0.9f, 0.5f, 0.7f}, 0.5f, 0.5f));
  scene.point_lamp({0.5f, 0.6f, 1.2f}, 3.0f);
  if (corner.has_panel) scene.builder.add_light(scene.area_lamp({-0.4f, 0, 1.9f}, 1.0f, -1.0f, 3.0f));
  return scene;
}

constexpr Vec3 kEye{-1.0f, -0.7f, 1.5f};
constexpr Vec3 kView{1.0f, 0.6f, -1.4f};

/// One path, alone and captured, from the same random numbers.
struct PathPair {
  PathRecord whole, rest;
  PathCapture capture;
};

PathPair trace_both(const Tracer& tracer, uint32_t path, const PathCapture& asked) {
  PathPair pair;
  pair.capture = asked;
  PathScratch scratch;
  const Ray ray{kEye, normalize(kView)};
  PathSampler once(7, 0, path, SampleSequence::RANDOM), again(7, 0, path, SampleSequence::RANDOM);
  pair.whole = trace_path(tracer.context(), ray, once, scratch);
  pair.rest = trace_path(tracer.context(), ray, again, scratch, &pair.capture);
  return pair;
}

Rgb left_indirect(const PathContext& context, const PathLink& link) {
  if (!(link.W > 0.0f)) return {};
  return reflected_path(context, link.from, link.to, Reflection::EVALUATED) * link.W;
}

PathCapture asking_for(int links, float direct = 0.0f, float secondary = 0.0f) {
  PathCapture asked;
  asked.link_count = links;
  asked.direct_candidates = direct;
  asked.secondary_candidates = secondary;
  return asked;
}

constexpr double kRounding = 2e-3;  // of positions and the distance between them
constexpr float kShortest = 0.05f;  // closer points, in corners, round more
constexpr float kFlattest = 0.02f;  // so do links that leave or arrive at a smaller angle
constexpr double kGrazing = 1e-2;   // the same between walls that see each other from the side

/// Whether evaluating a link anew rounds so little that it must agree with the path.
bool is_well_conditioned(const PathLink& link) {
  const Vec3 way = link.to.point.receiver.position - link.from.receiver.position;
  const auto is_flat = [&](Vec3 n) { return std::abs(dot(n, normalize(way))) < kFlattest; };
  return length(way) >= kShortest && !is_flat(link.from.ng) && !is_flat(link.to.point.ng);
}

/// Largest difference between the captured estimate with `scale` times what was left and the estimate without capture,
/// over many paths, relative to the mean; and how many paths had a link.
struct Agreement {
  double worst = 0.0, mean = 0.0;
  int links = 0;
};

template <class Left>
Agreement compare_paths(const Tracer& tracer, int link_count, const Left& left) {
  constexpr uint32_t kPaths = 4000;
  Agreement agreement;
  for (uint32_t path = 0; path < kPaths; ++path) {
    const PathPair pair = trace_both(tracer, path, asking_for(link_count));
    if (pair.capture.links[0].W > 0.0f && !is_well_conditioned(pair.capture.links[0])) continue;
    const double whole = pair.whole.indirect.g;
    const double joined = pair.rest.indirect.g + left(pair.capture.links[0]);
    EXPECT_EQ(pair.whole.direct.g, pair.rest.direct.g);
    agreement.mean += whole / kPaths;
    agreement.worst = std::max(agreement.worst, std::abs(joined - whole) / (1e-2 + whole));
    agreement.links += pair.capture.links[0].W > 0.0f;
  }
  return agreement;
}

// --- the path's own receiver gets what it would have had, path by path ----------------------------------------------

TEST(PathCapture, WhatIsLeftMakesEachPathWhole) {
  for (const Corner& corner : {Corner{-1, -1}, Corner{-1, 0.4f}, Corner{0.5f, -1}, Corner{0.4f, 0.6f}, Corner{-1, 0.0f},
                               Corner{0.0f, -1}, Corner{-1, 0.1f}}) {
    const Tracer tracer(make(corner));
    for (const int links : {1, 2}) {
      const Agreement a =
          compare_paths(tracer, links, [&](const PathLink& l) { return left_indirect(tracer.context(), l).g; });
      EXPECT_LT(a.worst, kRounding) << corner.floor_roughness << " " << corner.wall_roughness;
      EXPECT_GT(a.mean, 0.01);
      EXPECT_GT(a.links, 100);
    }
  }
}

/// Largest relative difference between what links left and another way to say it, over many paths.
template <class Said>
double worst_difference(const Tracer& tracer, const Said& said) {
  double worst = 0.0;
  int links = 0;
  for (uint32_t path = 0; path < 4000; ++path) {
    const PathLink link = trace_both(tracer, path, asking_for(2)).capture.links[0];
    const double left = left_indirect(tracer.context(), link).g;
    if (!(left > 0.0) || !is_well_conditioned(link)) continue;
    ++links;
    worst = std::max(worst, std::abs(said(link) - left) / (1e-2 + left));
  }
  EXPECT_GT(links, 100);
  return worst;
}

TEST(PathCapture, ResponseTimesRadianceIsWhatThePathFound) {
  const auto found = [](const PathLink& l) { return (l.response * l.to.radiance_as_found()).g; };
  for (const Corner& corner : {Corner{-1, -1}, Corner{0.5f, 0.4f}, Corner{0.4f, -1}, Corner{-1, -1, true}})
    EXPECT_LT(worst_difference(Tracer(make(corner)), found), kRounding) << corner.floor_roughness;
  const auto without_response = [](const PathLink& l) { return l.to.radiance_as_found().g; };
  PathLimits no_roulette;  // which would make the response of gray surfaces one
  no_roulette.min_bounces = 8;
  EXPECT_LT(worst_difference(Tracer(make({-1, -1}), no_roulette), found), kRounding);
  EXPECT_GT(worst_difference(Tracer(make({-1, -1}), no_roulette), without_response), 0.1) << "a planted bug";
}

TEST(PathCapture, PlantedMeasuresAreCaught) {
  const Tracer tracer(make({-1, 0.4f}));
  const auto geometry = [](const PathLink& link) {
    const Vec3 way = link.to.point.receiver.position - link.from.receiver.position;
    return std::abs(dot(link.to.point.ng, normalize(way))) / length_squared(way);
  };
  const auto whole = [&](const PathLink& l) { return left_indirect(tracer.context(), l).g; };
  EXPECT_LT(compare_paths(tracer, 1, whole).worst, kRounding);
  const auto per_solid_angle = [&](const PathLink& l) { return l.W > 0.0f ? whole(l) * geometry(l) : 0.0f; };
  EXPECT_GT(compare_paths(tracer, 1, per_solid_angle).worst, 0.5);
  EXPECT_GT(compare_paths(tracer, 1, [](const PathLink&) { return 0.0f; }).worst, 0.5) << "left out";
}

TEST(PathCapture, BounceLimitsHoldForWhatIsLeft) {
  for (const int bounces : {0, 1, 2}) {
    PathLimits limits;
    limits.max_bounces = bounces;
    const Tracer tracer(make({-1, 0.4f}), limits);
    const Agreement a =
        compare_paths(tracer, 2, [&](const PathLink& l) { return left_indirect(tracer.context(), l).g; });
    EXPECT_LT(a.worst, kRounding);
    EXPECT_EQ(a.mean > 0.0, bounces > 0);
    EXPECT_EQ(a.links > 0, bounces > 0) << "one that can reflect nothing is no sample point";
  }
}

// --- the second link ------------------------------------------------------------------------------------------------

/// Radiance that the first sample point sends on from beyond it, by its continuation and by the second link.
TEST(PathCapture, TheSecondLinkIsTheFirstsContinuation) {
  PathLimits limits;  // the second link may bounce once more: neither must reach them
  limits.max_bounces = limits.max_diffuse_bounces = limits.max_glossy_bounces = 1000;
  const Tracer tracer(make({-1, 0.5f}), limits);
  int links = 0;
  for (uint32_t path = 0; path < 4000; ++path) {
    const PathPair pair = trace_both(tracer, path, asking_for(2));
    const auto& [first, second] = pair.capture.links;
    if (!(second.W > 0.0f)) continue;
    if (!is_well_conditioned(second)) continue;
    ++links;
    VisiblePoint from = second.from;
    from.throughput = Rgb(1.0f);
    const float sent = reflected_path(tracer.context(), from, second.to, Reflection::EVALUATED).g * second.W;
    const float continued = first.to.continuation.f_cos.g * first.to.continuation.radiance.g;
    EXPECT_NEAR(sent, continued, kGrazing * (1e-2f + continued));
  }
  EXPECT_GT(links, 500);
}

/// It stands for a link that starts at a visible point and may go on as long, which costs the first nothing.
TEST(PathCapture, TheSecondLinkMayBounceOnceMore) {
  PathLimits limits;
  limits.max_bounces = 1;
  const Tracer tracer(make({-1, -1}), limits);
  int lit = 0;
  for (uint32_t path = 0; path < 500; ++path) {
    const PathPair pair = trace_both(tracer, path, asking_for(2));
    const auto& [first, second] = pair.capture.links;
    EXPECT_TRUE(is_black(first.to.continuation.radiance));
    lit += second.W > 0.0f && !is_black(second.to.light.radiance);
    EXPECT_TRUE(is_black(second.to.continuation.radiance));
  }
  EXPECT_GT(lit, 50);
}

// --- sample points --------------------------------------------------------------------------------------------------

TEST(PathCapture, SamplePointsKeepWhatTheyReceived) {
  const Tracer tracer(make({-1, 0.4f}));
  int links = 0;
  for (uint32_t path = 0; path < 2000; ++path) {
    const PathLink link = trace_both(tracer, path, asking_for(1)).capture.links[0];
    if (!(link.W > 0.0f)) continue;
    ++links;
    // Towards its own finder: evaluated anew, or as found.
    const Rgb anew = reflected_path(tracer.context(), link.from, link.to, Reflection::EVALUATED);
    const Rgb found = reflected_path(tracer.context(), link.from, link.to, Reflection::AS_FOUND);
    EXPECT_NEAR(anew.g, found.g, 1e-3f * (1e-3f + found.g));
  }
  EXPECT_GT(links, 500);
}

TEST(PathCapture, PathsThatFindNothingAreNullSamples) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.diffuse(0.5f));
  scene.quad({1, 0, 1}, {0, 4, 0}, {0, 0, 2}, scene.diffuse(0.5f));  // seen by less than half of the floor's hemisphere
  const Tracer tracer(scene);
  int null = 0;
  for (uint32_t path = 0; path < 1000; ++path) {
    const PathPair pair = trace_both(tracer, path, asking_for(2));
    EXPECT_TRUE(pair.capture.visible.exists);
    null += !(pair.capture.links[0].W > 0.0f);
  }
  EXPECT_GT(null, 500);
  EXPECT_LT(null, 950);
}

/// What is asked for one path must not be answered by the one before.
TEST(PathCapture, CapturesAreClearedForTheNextPath) {
  const Tracer tracer(make({}));
  PathCapture capture = asking_for(2, 0.0f, 4.0f);
  PathScratch scratch;
  PathSampler sampler(1, 0, 0, SampleSequence::RANDOM);
  trace_path(tracer.context(), {kEye, normalize(kView)}, sampler, scratch, &capture);
  EXPECT_TRUE(capture.visible.exists);
  trace_path(tracer.context(), {Vec3{0, 0, 9}, Vec3{0, 0, 1}}, sampler, scratch, &capture);
  EXPECT_FALSE(capture.visible.exists);
  EXPECT_TRUE(capture.vertices.empty());
  EXPECT_EQ(capture.links[0].W + capture.links[1].W, 0.0f);
}

// --- in the mean ----------------------------------------------------------------------------------------------------

constexpr float kCandidates = 4.0f;

/// W of one light sample, drawn by the context's sampler, times what it brings to the point; black for none.
struct DrawnLight {
  std::optional<ArrivingLight> light;
  float W = 0.0f;
};
DrawnLight draw_light(const PathContext& context, const VisiblePoint& point, Rng& rng) {
  const double u = rng.next_double();
  const auto choice = context.lights.choose(point.receiver.position, point.receiver.side, u, rng.next_vec2());
  if (!choice) return {};
  return {arriving_light(context, kCandidates, point, choice->sample), 1.0f / choice->pmf};
}

/// The captured estimate, with all that was left to others found by one light sample each. `share_of_light` planted
/// as other than one: reservoirs that are too bright.
float completed(const PathContext& context, PathPair& pair, Rng& rng, float share_of_light) {
  PathCapture& capture = pair.capture;
  float sum = pair.rest.direct.g + pair.rest.indirect.g;
  if (capture.direct_candidates > 0.0f && capture.visible.exists) {
    const auto [light, W] = draw_light(context, capture.visible, rng);
    if (light) sum += (capture.visible.throughput * light->f_cos * light->radiance).g * W * share_of_light;
  }
  for (const LightVertex& vertex : capture.vertices) {
    const auto [light, W] = draw_light(context, vertex.point, rng);
    if (!light) continue;
    const Rgb radiance = light->radiance * (W * share_of_light), reflected = light->f_cos * radiance;
    sum += ((vertex.to_direct + vertex.to_indirect) * reflected).g;
    PathSample& sample = capture.links[0].to;
    if (vertex.sample_point_of == 0) {
      sample.light = {light->wi, radiance, light->f_cos};
    } else {
      sample.continuation.radiance += vertex.to_continuation[0] * reflected;
    }
  }
  if (capture.link_count > 0) sum += left_indirect(context, capture.links[0]).g;
  return sum;
}

struct Means {
  Moments whole, completed;
};
Means compare_means(const Corner& corner, const PathCapture& asked, float share_of_light = 1.0f) {
  const Tracer tracer(make(corner));
  Means means;
  Rng rng(11, 0, 0, 0);
  for (uint32_t path = 0; path < 12000; ++path) {
    // Other paths for the other mean: equal random numbers would correlate what the test takes as independent.
    const PathRecord whole = trace_both(tracer, 1000000 + path, {}).whole;
    PathPair pair = trace_both(tracer, path, asked);
    means.whole.add(whole.direct.g + whole.indirect.g);
    means.completed.add(completed(tracer.context(), pair, rng, share_of_light));
  }
  return means;
}

const std::vector<Corner> kCorners{{-1, 0.4f, false, true}, {0.5f, 0.1f, true, true}, {-1, -1, true, false}};

TEST(PathCapture, AllThatIsLeftMakesTheMeanWhole) {
  const std::vector<PathCapture> asked{asking_for(1), asking_for(0, 0, kCandidates), asking_for(0, kCandidates),
                                       asking_for(2, kCandidates, kCandidates)};
  const double rate = shared_rate(static_cast<int>(kCorners.size() * asked.size()));
  for (const Corner& corner : kCorners)
    for (const PathCapture& a : asked) {
      const Means means = compare_means(corner, a);
      EXPECT_GT(same_mean_p_value(means.whole, means.completed), rate)
          << corner.wall_roughness << " links " << a.link_count << " direct " << a.direct_candidates << " secondary "
          << a.secondary_candidates << ": " << means.completed.mean() << " for " << means.whole.mean();
    }
}

TEST(PathCapture, PlantedExcessOfLightIsCaught) {
  const Means means = compare_means(kCorners[0], asking_for(1, kCandidates, kCandidates), 1.25f);
  EXPECT_LT(same_mean_p_value(means.whole, means.completed), kFalseAlarmRate);
}

}  // namespace
}  // namespace cistern::test
