#include "transport/light_by_group.h"

#include <gtest/gtest.h>

#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

constexpr LightGroup kLamps = 0, kPane = 1, kSky = 2;
constexpr size_t kGroups = 3;

/// One path, with and without its light by groups.
struct GroupedPath {
  PathRecord record, plain;
  LightByGroup light;
  PathCapture capture;
};

GroupedPath trace_grouped(const PathContext& context, const Ray& ray, uint32_t path,
                          const PathCapture* asked = nullptr) {
  GroupedPath result;
  PathScratch scratch;
  const auto trace = [&](const PathContext& c) {
    if (asked) result.capture = *asked;
    PathSampler sampler(3, 0, path, SampleSequence::RANDOM);
    return trace_path(c, ray, sampler, scratch, asked ? &result.capture : nullptr);
  };
  result.plain = trace(context);
  PathContext grouping = context;
  grouping.light_groups = kGroups;
  result.record = trace(grouping);
  result.light = scratch.light_by_group;
  return result;
}

Rgb sum(std::span<const Rgb> light) {
  Rgb all;
  for (const Rgb& one : light) all += one;
  return all;
}

void glowing_pane(PathScene& scene, Vec3 center, Vec3 u, Vec3 v, LightGroup group) {
  Instance pane = scene.quad(center, u, v, scene.emission({2, 3, 4}));
  pane.light_group = group;
  scene.replace_last(pane);
}

void set_sky(PathScene& scene) {
  Environment sky;
  sky.material = scene.emission({0.3f, 0.4f, 0.5f});
  sky.light_group = kSky;
  scene.builder.set_environment(sky);
}

/// Mixed and mirror-like walls, lamps that rays meet and do not, a glowing pane and a sky.
PathScene make_room() {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.mixed(0.7f, 0.4f, 0.5f));
  scene.quad({2, 0, 1}, {0, 0, 2}, {0, 4, 0}, scene.glossy(0.0f));
  scene.quad({0, 2, 1}, {4, 0, 0}, {0, 0, 2}, scene.mixed(0.5f, 0.1f, 0.3f));
  Light bulb = scene.area_lamp({-0.4f, 0, 1.9f}, 1.0f, -1.0f, 3.0f);
  bulb.light_group = kLamps;
  scene.builder.add_light(bulb);
  bulb.shape = PointLight{{0.5f, 0.6f, 1.2f}, 0.0f, Rgb(3.0f), false};
  scene.builder.add_light(bulb);
  glowing_pane(scene, {-1.0f, 1.2f, 0.8f}, {0.5f, 0, 0}, {0, 0, 0.5f}, kPane);
  set_sky(scene);
  return scene;
}

const Ray kIntoTheRoom{{-1.0f, -0.7f, 1.5f}, normalize(Vec3{1.0f, 0.6f, -1.4f})};

/// Exactly, but for rounding, in each path: clamped ones too, and those that leave light to others.
TEST(LightByGroup, AddsUpToAllThatAPathFindsAndChangesNothing) {
  PathLimits clamped;
  clamped.clamp_direct = 0.2f, clamped.clamp_indirect = 0.05f;
  PathCapture links, light;
  links.link_count = 2, links.leaves_deep_link = true;
  light.direct_candidates = light.secondary_candidates = 4.0f;
  const PathScene room = make_room();
  for (const PathLimits& limits : {PathLimits(), clamped}) {
    const Tracer tracer(room, limits);
    const std::array<const PathCapture*, 3> all_asked{nullptr, &links, &light};
    for (const PathCapture* asked : all_asked) {
      LightByGroup found(kGroups);
      for (uint32_t path = 0; path < 2000; ++path) {
        const GroupedPath split = trace_grouped(tracer.context(), kIntoTheRoom, path, asked);
        const Rgb all = split.record.combined();
        ASSERT_EQ(all, split.plain.combined());
        ASSERT_NEAR(sum(split.light).r, all.r, 1e-5f * all.r + 1e-7f);
        ASSERT_NEAR(sum(split.light).g, all.g, 1e-5f * all.g + 1e-7f);
        add_to_groups(found, split.light, Rgb(1.0f));
      }
      for (const Rgb& group : found) EXPECT_GT(group.g, 0.0f);
    }
  }
}

/// What is left to others as well: radiance that sample points send, as it was found.
TEST(LightByGroup, OfContinuationsAddsUpToThem) {
  PathCapture links;
  links.link_count = 2;
  const PathScene room = make_room();
  const Tracer tracer(room);
  int found = 0;
  for (uint32_t path = 0; path < 2000; ++path) {
    const PathCapture capture = trace_grouped(tracer.context(), kIntoTheRoom, path, &links).capture;
    for (size_t i = 0; i < kMaxPathLinks; ++i) {
      if (!(capture.links[i].W > 0.0f)) continue;
      const PathSample& sample = capture.links[i].to;
      const Rgb all = sample.continuation.radiance, parts = sum(capture.continuation_by_group[i]);
      ASSERT_NEAR(parts.g, all.g, 1e-5f * all.g + 1e-7f);
      ASSERT_TRUE(is_black(sample.light.radiance) || sample.light_group != kNoLightGroup);
      found += !is_black(all) && !is_black(capture.continuation_by_group[i][kSky]);
    }
  }
  EXPECT_GT(found, 10);
}

TEST(LightByGroup, IsOfTheEmitterThatIsMet) {
  PathScene scene;
  glowing_pane(scene, {0, 0, 3}, {1, 0, 0}, {0, 1, 0}, kPane);
  glowing_pane(scene, {5, 0, 3}, {1, 0, 0}, {0, 1, 0}, kNoLightGroup);
  set_sky(scene);
  const Tracer tracer(scene);
  const auto seen = [&](Vec3 from) { return trace_grouped(tracer.context(), {from, {0, 0, 1}}, 0).light; };
  EXPECT_EQ(seen({0, 0, 0}), (LightByGroup{Rgb(), {2, 3, 4}, Rgb()}));
  EXPECT_EQ(seen({9, 0, 0}), (LightByGroup{Rgb(), Rgb(), {0.3f, 0.4f, 0.5f}}));
  EXPECT_EQ(seen({5, 0, 0}), LightByGroup(kGroups)) << "of no group";
}

TEST(LightByGroup, OfGroupsThatNobodyAsksForIsNowhere) {
  LightByGroup sums(2);
  add_to_group(sums, 1, Rgb(2.0f));
  add_to_group(sums, 2, Rgb(4.0f));
  add_to_group(sums, kNoLightGroup, Rgb(8.0f));
  add_to_group({}, 0, Rgb(16.0f));
  EXPECT_EQ(sums, (LightByGroup{Rgb(), Rgb(2.0f)}));
}

/// The sky behind a transparent film: in its group only where that is asked for, and never in Combined.
TEST(LightByGroup, HoldsTheSkyBehindAFilmWhereAsked) {
  PathScene scene;
  set_sky(scene);
  PathLimits limits;
  limits.film_transparent = true;
  const Tracer tracer(scene, limits);
  PathContext context = tracer.context();
  const Ray up{{0, 0, 0}, {0, 0, 1}};
  EXPECT_TRUE(is_black(trace_grouped(context, up, 0).light[kSky]));
  context.groups_behind_film = true;
  const GroupedPath split = trace_grouped(context, up, 0);
  EXPECT_FLOAT_EQ(split.light[kSky].g, 0.4f);
  EXPECT_TRUE(is_black(split.record.combined()));
}

}  // namespace
}  // namespace cistern::test
