#include "transport/light_by_kind.h"

#include <gtest/gtest.h>

#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

constexpr size_t kDiffuse = 0, kGlossy = 1;

/// One path, with and without its light by kinds.
struct SplitPath {
  PathRecord record, plain;
  LightByKind light;
};

SplitPath trace_split(const PathContext& context, const Ray& ray, uint32_t path, const PathCapture* asked = nullptr) {
  SplitPath result;
  PathScratch scratch;
  PathCapture capture;
  const auto trace = [&](const PathContext& c) {
    if (asked) capture = *asked;
    PathSampler sampler(3, 0, path, SampleSequence::RANDOM);
    return trace_path(c, ray, sampler, scratch, asked ? &capture : nullptr);
  };
  result.plain = trace(context);
  PathContext splitting = context;
  splitting.splits_kinds = true;
  result.record = trace(splitting);
  result.light = scratch.light_by_kind;
  return result;
}

Rgb sum(const LightByKind& light) {
  Rgb all = light.emission + light.environment;
  for (size_t kind = 0; kind < kLightKinds; ++kind) all += light.direct[kind] + light.indirect[kind];
  return all;
}

/// Mixed and mirror-like walls, a veil, a lamp that rays meet and one that they do not, and a sky.
PathScene make_room() {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.mixed(0.7f, 0.4f, 0.5f));
  scene.quad({2, 0, 1}, {0, 0, 2}, {0, 4, 0}, scene.glossy(0.0f));
  scene.quad({0, 2, 1}, {4, 0, 0}, {0, 0, 2}, scene.mixed(0.5f, 0.1f, 0.3f));
  scene.quad({0.8f, 0, 0.7f}, {0, 0, 1}, {0, 3, 0}, scene.transparent({0.9f, 0.5f, 0.7f}, 0.5f, 0.5f));
  scene.point_lamp({0.5f, 0.6f, 1.2f}, 3.0f);
  scene.builder.add_light(scene.area_lamp({-0.4f, 0, 1.9f}, 1.0f, -1.0f, 3.0f));
  return scene;
}

const Ray kIntoTheRoom{{-1.0f, -0.7f, 1.5f}, normalize(Vec3{1.0f, 0.6f, -1.4f})};

/// Exactly, but for rounding, in each path: clamped ones too, and those that leave light to others.
TEST(LightByKind, AddsUpToAllThatAPathFindsAndChangesNothing) {
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
      float found = 0.0f;
      for (uint32_t path = 0; path < 2000; ++path) {
        const SplitPath split = trace_split(tracer.context(), kIntoTheRoom, path, asked);
        const Rgb all = split.record.combined();
        ASSERT_EQ(all, split.plain.combined());
        ASSERT_NEAR(sum(split.light).r, all.r, 1e-5f * all.r + 1e-7f);
        ASSERT_NEAR(sum(split.light).g, all.g, 1e-5f * all.g + 1e-7f);
        found += split.light.direct[kGlossy].g + split.light.indirect[kDiffuse].g;
      }
      EXPECT_GT(found, 0.0f);
    }
  }
}

TEST(LightByKind, OfPaintIsDiffuseAndTheColourIsItsAlbedo) {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.diffuse(0.6f));
  scene.point_lamp({0.0f, 0.0f, 2.0f}, 3.0f);
  const Tracer tracer(scene);
  const SplitPath split = trace_split(tracer.context(), kIntoTheRoom, 0);
  EXPECT_GT(split.record.direct.g, 0.0f);
  EXPECT_FLOAT_EQ(split.light.direct[kDiffuse].g, split.record.direct.g);
  EXPECT_FLOAT_EQ(split.light.color[kDiffuse].g, 0.6f);
  EXPECT_TRUE(is_black(split.light.direct[kGlossy]) && is_black(split.light.color[kGlossy]));
}

/// Direct after one mirror, though our own passes call it seen; indirect after two.
TEST(LightByKind, OfMirrorsIsGlossyAndCountsTheirTurns) {
  PathScene scene;
  const int mirror = scene.glossy(0.0f);
  scene.floor(0.0f, 40.0f, mirror);
  scene.quad({0, 0, 10}, {0, 40, 0}, {40, 0, 0}, scene.emission({2, 3, 4}));
  const Ray down{{0, 0, 5}, normalize(Vec3{0.3f, 0, -1})};
  const SplitPath once = trace_split(Tracer(scene).context(), down, 0);
  EXPECT_FLOAT_EQ(once.record.emission.g, 3.0f);
  EXPECT_FLOAT_EQ(once.light.direct[kGlossy].g, 3.0f);
  EXPECT_TRUE(is_black(once.light.emission));
  scene.quad({4, 0, 2}, {0, 0, 4}, {0, 40, 0}, mirror);
  const Ray sideways{{0, 0, 2}, normalize(Vec3{1, 0, -1})};
  const SplitPath twice = trace_split(Tracer(scene).context(), sideways, 0);
  EXPECT_FLOAT_EQ(twice.light.indirect[kGlossy].g, 3.0f);
  EXPECT_TRUE(is_black(twice.light.direct[kGlossy]));
  const SplitPath straight = trace_split(Tracer(scene).context(), {{0, 0, 5}, {0, 0, 1}}, 0);
  EXPECT_FLOAT_EQ(straight.light.emission.g, 3.0f);
}

/// And not by their albedos: beside its highlight, polish sends hardly anything of a lamp.
TEST(LightByKind, IsDividedByWhatLobesMakeOfTheDirection) {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.mixed(0.8f, 0.3f, 0.5f));
  scene.point_lamp({-1.5f, 0.0f, 0.5f}, 3.0f);
  const Tracer tracer(scene);
  const Ray down{{0, 0, 1}, normalize(Vec3{0.1f, 0, -1})};
  const SplitPath split = trace_split(tracer.context(), down, 0);
  EXPECT_GT(split.light.direct[kDiffuse].g, 20.0f * split.light.direct[kGlossy].g);
  EXPECT_NEAR(split.light.color[kDiffuse].g, split.light.color[kGlossy].g, 0.01f) << "their albedos are alike";
}

}  // namespace
}  // namespace cistern::test
