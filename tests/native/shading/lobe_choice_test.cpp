#include "shading/lobe_choice.h"

#include <gtest/gtest.h>

#include "shading/bsdf_statistics.h"
#include "shading/material.h"
#include "shading/nodes_scene.h"
#include "shading/program_builder.h"

// Which lobes are chosen after the first vertex. False-alarm rate of the comparison with chance: kFalseAlarmRate.
namespace cistern::test {
namespace {

constexpr float kSharp = 0.25f, kWide = 0.35f;  // roughness

/// Diffuse and, of `share`, glossy.
Scene glossy_over_diffuse(float share, float roughness) {
  ProgramBuilder b;
  const Operand n = b.add(Op::NORMAL, {}), zero = b.constant(0), gray = b.constant(0.6f);
  if (share < 1.0f) b.add(Op::CLOSURE_DIFFUSE, {b.constant(1.0f - share), gray, zero, n});
  b.add(Op::CLOSURE_GLOSSY, {b.constant(share), gray, b.constant(roughness), zero, zero, n, n}, {0});
  finish_program(b.program, 0);
  return make_scene(make_triangle(), {}, b.program);
}

Bsdf at_depth(const Scene& scene, uint16_t depth) {
  PathState path;
  path.depth = depth;
  return evaluate_material(scene, point_at(scene, {0.25f, 0.5f}, {0.4f, 0.2f, -1.0f}), path);
}

double p_value_of(const Bsdf& sampled, const Bsdf& told) {
  const auto sampler = [&](Rng& rng) -> std::optional<Vec3> {
    const float u = rng.next_float();
    const auto sample = sample_bsdf(sampled, u, {rng.next_float(), rng.next_float()});
    return sample ? std::optional(sample->wi) : std::nullopt;
  };
  return sampler_p_value(
      Frame(told.ng), sampler, [&](Vec3 wi) { return evaluate_bsdf(told, wi).pdf; }, 7);
}

TEST(LobeChoice, SharpLobesAreChosenFourTimesAsOftenBesideOthers) {
  const Scene scene = glossy_over_diffuse(0.1f, kSharp);
  const Bsdf first = at_depth(scene, 0), later = at_depth(scene, 1);
  ASSERT_EQ(later.count, 2);
  const auto odds = [](const Bsdf& bsdf) { return bsdf.lobes[1].sample_weight / bsdf.lobes[0].sample_weight; };
  EXPECT_NEAR(odds(later), 4.0f * odds(first), 1e-4f);
  EXPECT_FLOAT_EQ(later.lobes[0].sample_weight + later.lobes[1].sample_weight, later.total_sample_weight);
  EXPECT_EQ(later.total_sample_weight, first.total_sample_weight);
  for (size_t i = 0; i < 2; ++i) EXPECT_EQ(later.lobes[i].albedo, first.lobes[i].sample_weight);
}

TEST(LobeChoice, TheyAreHalfOfAllAtMostUnlessTheyWereMore) {
  for (const float share : {0.4f, 0.7f}) {
    const Bsdf later = at_depth(glossy_over_diffuse(share, kSharp), 1);
    EXPECT_NEAR(later.lobes[1].sample_weight / later.total_sample_weight, std::max(share, 0.5f), 1e-5f);
  }
}

/// What light samples take a ray to be, and how far glossy lobes are softened, is told by albedo.
TEST(LobeChoice, KindsAndTheirDensitiesByAlbedoAreAsAtTheFirst) {
  const Scene scene = glossy_over_diffuse(0.4f, kSharp);
  const Bsdf first = at_depth(scene, 0), later = at_depth(scene, 1);
  EXPECT_EQ(strongest_kind(later), ScatterKind::DIFFUSE);
  const Vec3 wi = at_angle(Frame(first.ng), 0.7f);
  EXPECT_FLOAT_EQ(evaluate_bsdf(later, wi).albedo_pdf, evaluate_bsdf(first, wi).pdf);
  EXPECT_GT(std::abs(evaluate_bsdf(later, wi).pdf / evaluate_bsdf(first, wi).pdf - 1.0f), 0.01f);
}

/// The rest is below the surface.
TEST(LobeChoice, LightBelowTheSurfaceKeepsItsPlace) {
  Bsdf bsdf;
  bsdf.ng = bsdf.ns = bsdf.wo = {0.0f, 0.0f, 1.0f};
  MicrofacetLobe coat;
  coat.n = bsdf.ng;
  coat.alpha_x = coat.alpha_y = sqr(kSharp);
  add_lobe(bsdf, coat, Rgb(0.1f), 0.1f);
  Subsurface below;
  below.n = bsdf.ng;
  below.weight = below.albedo = Rgb(1.0f);
  below.radius = Rgb(1.0f);
  add_subsurface(bsdf, below, 1e-6f);
  prefer_sharp_lobes(bsdf);
  ASSERT_EQ(bsdf.subsurface_count, 1);
  EXPECT_FLOAT_EQ(bsdf.lobes[0].sample_weight + bsdf.subsurfaces[0].sample_weight, bsdf.total_sample_weight);
  EXPECT_NEAR(bsdf.lobes[0].sample_weight / bsdf.subsurfaces[0].sample_weight, 0.4f, 1e-5f);
}

TEST(LobeChoice, WhatIsReflectedDoesNotChange) {
  const Scene scene = glossy_over_diffuse(0.1f, kSharp);
  const Bsdf first = at_depth(scene, 0), later = at_depth(scene, 1);
  const Frame frame(first.ng);
  for (const float cosine : {0.9f, 0.6f, 0.2f})
    EXPECT_EQ(evaluate_bsdf(first, at_angle(frame, cosine)).total_cos(),
              evaluate_bsdf(later, at_angle(frame, cosine)).total_cos());
}

TEST(LobeChoice, WideOnesAndSingleOnesAreAsEver) {
  for (const Scene& scene : {glossy_over_diffuse(0.1f, kWide), glossy_over_diffuse(1.0f, kSharp)}) {
    const Bsdf first = at_depth(scene, 0), later = at_depth(scene, 1);
    ASSERT_EQ(first.count, later.count);
    for (size_t i = 0; i < static_cast<size_t>(first.count); ++i)
      EXPECT_EQ(first.lobes[i].sample_weight, later.lobes[i].sample_weight);
  }
}

TEST(LobeChoice, DensitiesAreThoseOfSamples) {
  const Scene scene = glossy_over_diffuse(0.1f, kSharp);
  const Bsdf later = at_depth(scene, 1);
  EXPECT_GT(p_value_of(later, later), kFalseAlarmRate);
  EXPECT_LT(p_value_of(later, at_depth(scene, 0)), 1e-9);  // planted bug: densities of the first vertex
}

}  // namespace
}  // namespace cistern::test
