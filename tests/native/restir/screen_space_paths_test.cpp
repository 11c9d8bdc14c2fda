#include "restir/screen_space_paths.h"

#include <gtest/gtest.h>

#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

// --- sample validation ----------------------------------------------------------------------------------------------

enum class Edit { NONE, LAMP_OFF, LAMP_BRIGHTER, LAMP_NEGATED, LAMP_RECOLORED, WALL_MOVED, WALL_PAINTED };

/// Of the lamp. The last two are as bright as that without an edit.
Rgb intensity(Edit edit) {
  if (edit == Edit::LAMP_BRIGHTER) return Rgb(3.0f);
  if (edit == Edit::LAMP_NEGATED) return Rgb(-2.0f);
  return edit == Edit::LAMP_RECOLORED ? Rgb{2.0f / 0.2126f, 0.0f, 0.0f} : Rgb(2.0f);
}

/// A floor between two lit walls; edits are to the lamp and to the wall on the right.
PathScene corridor(Edit edit) {
  PathScene scene;
  const int gray = scene.diffuse(0.6f), right = edit == Edit::WALL_PAINTED ? scene.diffuse(0.3f) : gray;
  scene.floor(0.0f, 6.0f, gray);
  scene.quad({edit == Edit::WALL_MOVED ? 2.3f : 2.0f, 0, 1}, {0, 0, 2}, {0, 6, 0}, right);
  scene.quad({-2, 0, 1}, {0, 6, 0}, {0, 0, 2}, gray);
  if (edit != Edit::LAMP_OFF) {
    Light lamp;
    lamp.name = "lamp";
    lamp.shape = PointLight{{0.3f, 0.0f, 1.5f}, 0.0f, intensity(edit), false};
    scene.builder.add_light(lamp);
  }
  return scene;
}

const Ray kRay{{0.0f, -0.5f, 1.8f}, normalize(Vec3{0.1f, 0.2f, -1.0f})};

PathLink trace(const Tracer& tracer, uint32_t path) {
  PathCapture capture;
  capture.link_count = 1;
  PathScratch scratch;
  PathSampler sampler(5, 0, path, SampleSequence::RANDOM);
  trace_path(tracer.context(), kRay, sampler, scratch, &capture);
  return capture.links[0];
}

/// Of samples with light, the shares that still hold after the edit: on the right wall, and elsewhere.
struct Holding {
  double on_right = 0.0, elsewhere = 0.0;
};

Holding still_holding(Edit edit) {
  PathLimits limits;
  limits.min_bounces = limits.max_bounces;  // roulette would give survivors of a darker wall the light of the others
  const Tracer before(corridor(Edit::NONE), limits), now(corridor(edit), limits);
  int samples[2] = {}, holding[2] = {};
  Rng rng(2, 0, 0, 0);
  for (uint32_t path = 0; path < 4000; ++path) {
    const PathLink link = trace(before, path);
    if (!(link.W > 0.0f) || is_black(link.to.radiance_as_found())) continue;
    const PathReservoir kept = keep_one_direction(link.from, {link.to, link.W, 1.0f}, {}, rng);
    const bool is_right = link.to.point.receiver.position.x > 1.9f;
    ++samples[is_right];
    holding[is_right] += still_holds(kept.sample, trace(now, path));
  }
  EXPECT_GT(samples[0], 100);
  EXPECT_GT(samples[1], 100);
  return {double(holding[1]) / samples[1], double(holding[0]) / samples[0]};
}

TEST(SampleValidation, NothingIsDroppedWithoutChange) {
  const Holding h = still_holding(Edit::NONE);
  EXPECT_EQ(h.on_right, 1.0);
  EXPECT_EQ(h.elsewhere, 1.0);
}

TEST(SampleValidation, ChangedLightIsDropped) {
  for (const Edit edit : {Edit::LAMP_OFF, Edit::LAMP_BRIGHTER, Edit::LAMP_NEGATED, Edit::LAMP_RECOLORED}) {
    const Holding h = still_holding(edit);
    EXPECT_EQ(h.on_right, 0.0);
    EXPECT_EQ(h.elsewhere, 0.0);
  }
}

TEST(SampleValidation, ChangedSurfacesAreDroppedAndOthersKept) {
  for (const Edit edit : {Edit::WALL_MOVED, Edit::WALL_PAINTED}) {
    const Holding h = still_holding(edit);
    EXPECT_EQ(h.on_right, 0.0);
    EXPECT_GT(h.elsewhere, 0.4) << "direct light of the other surfaces is as it was";
    EXPECT_LT(h.elsewhere, 1.0) << "what came by way of the wall is not";
  }
}

// --- multi-bounce tiles ---------------------------------------------------------------------------------------------

TEST(ScreenSpacePaths, AShareOfTheTilesGoesOn) {
  const PathScene scene = corridor(Edit::NONE);
  const Tracer tracer(scene);
  constexpr ImageRegion kImage{0, 0, 640, 320, 640, 320};
  ScreenPathReuse reuse;
  reuse.multi_bounce_share = 0.25f;
  const ScreenSpacePaths paths(tracer.context(), reuse, kImage, 3);
  Moments share;
  for (uint32_t frame = 0; frame < 200; ++frame)
    for (uint32_t y = 0; y < 320; y += 32)
      for (uint32_t x = 0; x < 640; x += 64) {
        const bool goes_on = paths.goes_on(y * 640 + x, frame);
        EXPECT_EQ(goes_on, paths.goes_on((y + 31) * 640 + x + 63, frame)) << "whole tiles";
        share.add(goes_on);
      }
  EXPECT_GT(mean_p_value(share, 0.25), kFalseAlarmRate);
}

/// Mean indirect light of paths that go on from every fourth sample point only.
Moments roulette(const Tracer& tracer, float probability) {
  Moments moments;
  PathScratch scratch;
  PathCapture capture;
  capture.link_count = 1;
  for (uint32_t path = 0; path < 40000; ++path) {
    capture.goes_on = path % 4 == 0;
    capture.going_on_probability = probability;
    PathSampler sampler(9, 0, path, SampleSequence::RANDOM);
    const PathRecord rest = trace_path(tracer.context(), kRay, sampler, scratch, &capture);
    const PathLink& link = capture.links[0];
    const bool has_link = link.W > 0.0f;
    const Rgb left = has_link ? reflected_path(tracer.context(), link.from, link.to, Reflection::EVALUATED) : Rgb();
    moments.add(rest.indirect.g + left.g * (has_link ? link.W : 0.0f));
  }
  return moments;
}

TEST(ScreenSpacePaths, PathsThatGoOnStandForTheOthers) {
  const Tracer tracer(corridor(Edit::NONE));
  Moments whole;
  PathScratch scratch;
  for (uint32_t path = 0; path < 40000; ++path) {
    PathSampler sampler(4, 0, path, SampleSequence::RANDOM);
    whole.add(trace_path(tracer.context(), kRay, sampler, scratch).indirect.g);
  }
  const Moments right = roulette(tracer, 0.25f), planted = roulette(tracer, 1.0f);
  EXPECT_GT(same_mean_p_value(whole, right), kFalseAlarmRate) << whole.mean() << " " << right.mean();
  EXPECT_LT(same_mean_p_value(whole, planted), kFalseAlarmRate) << "planted: not reweighted";
}

}  // namespace
}  // namespace cistern::test
