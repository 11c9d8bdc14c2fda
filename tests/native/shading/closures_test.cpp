#include "shading/closures.h"

#include <gtest/gtest.h>

#include "shading/closure_inputs.h"
#include "shading/closure_parts.h"
#include "transport/visible_points.h"

namespace cistern::test {
namespace {

TEST(Closures, PlainDiffusePrincipledIsOneLambertLobe) {
  Inputs in = principled();
  in[LEVEL] = grey(0.0f);
  in[BASE] = {0.8f, 0.4f, 0.2f};
  const Bsdf bsdf = build(Op::CLOSURE_PRINCIPLED, in, make_point(0.5f));
  ASSERT_EQ(bsdf.count, 1);
  EXPECT_TRUE(std::holds_alternative<LambertLobe>(bsdf.lobes[0].model));
  EXPECT_EQ(bsdf.lobes[0].weight, Rgb(0.8f, 0.4f, 0.2f));
}

TEST(Closures, PrincipledKeepsAWhiteFurnaceWhite) {
  // Layers are weighed by albedo estimates: exact for metal and glass, within two percent for dielectric over diffuse.
  const auto see = [](PrincipledInput input, float value, float roughness, float cosine) {
    Inputs in = principled();
    in[ROUGHNESS] = grey(roughness);
    in[static_cast<size_t>(input)] = grey(value);
    return furnace(build(Op::CLOSURE_PRINCIPLED, in, make_point(cosine)));
  };
  for (float roughness : {0.2f, 0.5f, 0.9f})
    for (float cosine : {0.3f, 0.9f}) {
      EXPECT_NEAR(see(WEIGHT, 1.0f, roughness, cosine), 1.0, 0.025) << roughness << " " << cosine;
      EXPECT_NEAR(see(METALLIC, 1.0f, roughness, cosine), 1.0, 0.01) << roughness << " " << cosine;
      EXPECT_NEAR(see(TRANSMISSION, 1.0f, roughness, cosine), 1.0, 0.015) << roughness << " " << cosine;
      EXPECT_LT(see(COAT, 1.0f, roughness, cosine), 1.02) << roughness << " " << cosine;
      EXPECT_LT(see(SHEEN, 1.0f, roughness, cosine), 1.02) << roughness << " " << cosine;
    }
  // Planted bug: a specular layer on a base that does not know of it.
  Inputs in = principled();
  const SurfacePoint point = make_point(0.3f);
  Bsdf unaware = build(Op::CLOSURE_PRINCIPLED, in, point);
  add_lobe(unaware, LambertLobe{kTestNormal}, Rgb(1.0f) - unaware.lobes[1].weight, 0.1f);
  EXPECT_GT(furnace(unaware), 1.03);
}

TEST(Closures, ThinFilmsNeitherMakeNorLoseLight) {
  // The strongest channel of a film's colour is taken from all channels below; else as far as the albedo estimates
  // hold.
  for (const float thickness : {0.5f, 120.0f, 450.0f, 1000.0f})
    for (const float film_ior : {1.0f, 1.33f, 2.5f})
      for (const float roughness : {0.2f, 0.7f}) {
        Inputs in = principled();
        in[ROUGHNESS] = grey(roughness);
        in[FILM] = grey(thickness), in[FILM_IOR] = grey(film_ior);
        const SurfacePoint point = make_point(0.6f);
        const auto see = [&] { return furnace(build(Op::CLOSURE_PRINCIPLED, in, point)); };
        const double least = film_ior > 2.0f ? 0.85 : 0.95;
        EXPECT_LT(see(), 1.025) << thickness << " " << film_ior;
        EXPECT_GT(see(), least) << thickness << " " << film_ior;
        in[TRANSMISSION] = grey(1.0f);
        EXPECT_LT(see(), 1.025) << thickness << " " << film_ior;
        EXPECT_GT(see(), 0.95) << thickness << " " << film_ior;
        in[METALLIC] = grey(1.0f);
        EXPECT_LT(see(), 1.01) << thickness << " " << film_ior;
      }
  // Planted bug: a film on a base that does not know of it.
  Inputs in = principled();
  const SurfacePoint point = make_point(0.6f);
  const Bsdf bare = build(Op::CLOSURE_PRINCIPLED, in, point);
  in[FILM] = grey(120.0f), in[FILM_IOR] = grey(2.5f);
  Bsdf unaware = build(Op::CLOSURE_PRINCIPLED, in, point);
  ASSERT_EQ(unaware.count, 2);
  unaware.lobes[1].weight = bare.lobes[1].weight;
  EXPECT_GT(furnace(unaware), 1.05);
}

const MicrofacetLobe& first_microfacet(const Bsdf& bsdf) { return std::get<MicrofacetLobe>(bsdf.lobes[0].model); }

TEST(Closures, ThinFilmsLieWhereTheyAreAskedFor) {
  Inputs in = principled();
  SurfacePoint point = make_point(0.6f);
  const auto lobe = [&] { return first_microfacet(build(Op::CLOSURE_PRINCIPLED, in, point)); };
  in[FILM] = grey(kThinnestFilm);
  EXPECT_EQ(lobe().fresnel, FresnelModel::GENERALIZED_SCHLICK);
  in[FILM] = grey(300.0f);
  EXPECT_EQ(lobe().fresnel, FresnelModel::FILM_ON_DIELECTRIC);
  in[IOR] = grey(1.0f);  // what does not reflect by itself may carry a film
  EXPECT_EQ(lobe().fresnel, FresnelModel::FILM_ON_DIELECTRIC);
  in[TRANSMISSION] = grey(1.0f), in[IOR] = grey(1.5f);
  EXPECT_FLOAT_EQ(lobe().film.ior, 1.33f);
  point.is_backface = true;
  EXPECT_FLOAT_EQ(lobe().film.ior, 1.33f / 1.5f);
  in[FILM_IOR] = grey(1e20f);
  EXPECT_EQ(lobe().film.ior, kMaxFilmIor);  // reflects, where it was black
  in[METALLIC] = grey(1.0f);
  EXPECT_EQ(lobe().fresnel, FresnelModel::FILM_ON_METAL);
  Bsdf older;
  older.ng = point.ng, older.wo = point.wo;
  const int32_t parameters[4] = {1, 0, 0, 0};  // dielectrics alone, as before Blender 5.0
  add_closure(older, Op::CLOSURE_PRINCIPLED, in, parameters, point);
  EXPECT_EQ(first_microfacet(older).fresnel, FresnelModel::F82_TINT);
}

/// The same Principled `count` times, each with its share of the weight.
Bsdf mixed_alike(int count, PrincipledInput input, float value) {
  Inputs in = principled();
  in[static_cast<size_t>(input)] = grey(value);
  in[WEIGHT] = grey(1.0f / static_cast<float>(count));
  const SurfacePoint point = make_point(0.6f);
  const int32_t parameters[4] = {1, 0, 0, 0};
  Bsdf bsdf = build(Op::CLOSURE_PRINCIPLED, in, point);
  for (int i = 1; i < count; ++i) add_closure(bsdf, Op::CLOSURE_PRINCIPLED, in, parameters, point);
  return bsdf;
}

TEST(Closures, MixedAlikeTheyAreWhatOneIs) {
  const Vec3 wi = at_angle(kFrame, 0.5f);
  for (const PrincipledInput input : {METALLIC, COAT}) {
    const BsdfEvaluation one = evaluate_bsdf(mixed_alike(1, input, 1.0f), wi);
    for (const int count : {5, 20, 31}) {
      const BsdfEvaluation mixed = evaluate_bsdf(mixed_alike(count, input, 1.0f), wi);
      EXPECT_NEAR(mixed.total_cos().g / one.total_cos().g, 1.0f, 1e-4f) << count;
      EXPECT_NEAR(mixed.pdf / one.pdf, 1.0f, 1e-4f) << count;
    }
  }
  // Planted bug: more lobes than there is room for.
  const float held = average(bsdf_albedo(mixed_alike(100, METALLIC, 1.0f)));
  EXPECT_NEAR(held / average(bsdf_albedo(mixed_alike(1, METALLIC, 1.0f))), 0.64f, 1e-3f);
}

TEST(Closures, EverySwitchedOnLobeConservesEnergyAndSamplesItsDensity) {
  Inputs in = principled();
  for (PrincipledInput i : {METALLIC, TRANSMISSION, COAT, SHEEN, ANISOTROPIC, SUBSURFACE, DIFFUSE_ROUGHNESS})
    in[static_cast<size_t>(i)] = grey(0.4f);
  in[COAT_ROUGHNESS] = grey(0.5f);
  in[ROTATION] = grey(0.1f);
  const Bsdf bsdf = build(Op::CLOSURE_PRINCIPLED, in, make_point(0.6f));
  EXPECT_EQ(bsdf.count, 6);
  EXPECT_LT(furnace(bsdf), 1.02);
  expect_density_of_samples(bsdf);
}

TEST(Closures, SubsurfaceTakesItsShareOfTheBase) {
  Inputs in = principled();
  in[LEVEL] = grey(0.0f);
  in[SUBSURFACE] = grey(0.25f);
  in[BASE] = {0.8f, 0.4f, 0.2f};
  in[SUBSURFACE_RADIUS] = {2.0f, 1.0f, 0.0f};
  const Bsdf bsdf = build(Op::CLOSURE_PRINCIPLED, in, make_point(0.5f));
  ASSERT_EQ(bsdf.subsurface_count, 1);
  const Subsurface& below = bsdf.subsurfaces[0];
  EXPECT_EQ(below.weight, Rgb(0.25f, 0.25f, 0.0f));  // what has no depth is diffuse
  EXPECT_EQ(below.albedo, Rgb(0.8f, 0.4f, 0.2f));
  EXPECT_EQ(below.radius, Rgb(2.0f, 1.0f, 0.0f));
  const Rgb albedo = bsdf_albedo(bsdf);
  for (const float difference : {albedo.r - 0.8f, albedo.g - 0.4f, albedo.b - 0.2f})
    EXPECT_NEAR(difference, 0.0f, 1e-6f);
  Moments chosen;
  Rng rng(17, 0, 0, 0);
  for (int i = 0; i < 20000; ++i) {
    const float u = rng.next_float();
    const auto sample = sample_bsdf(bsdf, u, rng.next_vec2());
    ASSERT_TRUE(sample);
    chosen.add(sample->subsurface ? average(sample->smooth_weight) : 0.0);
  }
  EXPECT_GT(mean_p_value(chosen, average(below.weight)), kFalseAlarmRate);
}

TEST(Closures, SubsurfacesBeyondThoseThereIsRoomForAreDiffuse) {
  const SurfacePoint point = make_point(0.5f);
  Bsdf bsdf;
  bsdf.ng = bsdf.ns = point.ng;
  bsdf.wo = point.wo;
  for (int i = 0; i < Bsdf::kMaxSubsurfaces + 2; ++i)
    add_subsurface(bsdf, {kTestNormal, Rgb(0.05f), Rgb(0.5f), Rgb(1.0f)}, 1e-8f);
  EXPECT_EQ(bsdf.subsurface_count, Bsdf::kMaxSubsurfaces);
  EXPECT_NEAR(bsdf_albedo(bsdf).g, 0.025f * (Bsdf::kMaxSubsurfaces + 2), 1e-6f);
  const Bsdf copy = bsdf;
  EXPECT_EQ(copy.subsurfaces[3].weight, Rgb(0.05f));
}

TEST(Closures, EmissionAndTransparencyAloneAreTheSameBits) {
  Rng rng(8, 0, 0, 0);
  const int32_t parameters[4] = {1, 0, 0, 0};
  for (int i = 0; i < 300; ++i) {
    Inputs in = principled();
    for (PrincipledInput k : {WEIGHT, ALPHA, COAT, SHEEN, COAT_ROUGHNESS, SHEEN_ROUGHNESS, STRENGTH})
      in[static_cast<size_t>(k)] = grey(rng.next_float() < 0.3f ? 0.0f : rng.next_float());
    in[COAT_TINT] = {rng.next_float(), rng.next_float(), 1.0f};
    const SurfacePoint point = make_point(0.1f + 0.9f * rng.next_float());
    const Bsdf bsdf = build(Op::CLOSURE_PRINCIPLED, in, point);
    EXPECT_EQ(closure_emission(Op::CLOSURE_PRINCIPLED, in, parameters, point), bsdf.emission);
    EXPECT_EQ(closure_transparency(Op::CLOSURE_PRINCIPLED, in, parameters, point, kVisibleToCamera), bsdf.transparency);
  }
  const Inputs emission{grey(0.5f), {1.0f, 2.0f, 3.0f}, grey(4.0f)};
  EXPECT_EQ(build(Op::CLOSURE_EMISSION, emission, make_point(0.5f)).emission, Rgb(2.0f, 4.0f, 6.0f));
  const Inputs transparent{grey(0.5f), {1.0f, 0.5f, 0.0f}};
  EXPECT_EQ(build(Op::CLOSURE_TRANSPARENT, transparent, make_point(0.5f)).transparency, Rgb(0.5f, 0.25f, 0.0f));
  EXPECT_EQ(build(Op::CLOSURE_HOLDOUT, {grey(0.25f)}, make_point(0.5f)).holdout, 0.25f);
}

Inputs layered() {
  Inputs in = principled();
  for (PrincipledInput i : {METALLIC, TRANSMISSION, COAT, STRENGTH}) in[static_cast<size_t>(i)] = grey(0.5f);
  return in;
}

TEST(Closures, GlossIsKeptBackAndTakesNothingFromWhatLiesBelow) {
  const SurfacePoint point = make_point(0.4f);
  const Bsdf whole = build(Op::CLOSURE_PRINCIPLED, layered(), point);
  const Bsdf limited = build(Op::CLOSURE_PRINCIPLED, layered(), point, 1, {.has_reflection = false});
  ASSERT_EQ(whole.count, 5);
  ASSERT_EQ(limited.count, 2);  // glass that transmits alone, and the base
  const Vec3 up = at_angle(kFrame, 0.8f), down = -1.0f * up;
  EXPECT_GT(average(evaluate_bsdf(limited, down).total_cos()), 0.0f);
  EXPECT_LT(average(whole.lobes[4].weight), 0.9f * average(limited.lobes[1].weight));
  EXPECT_EQ(evaluate_bsdf(limited, up).even_cos, evaluate_bsdf(whole, up).even_cos) << "all finders agree about it";
  EXPECT_EQ(limited.emission, whole.emission) << "a light is the same one to all paths";
  const Bsdf reflecting = build(Op::CLOSURE_PRINCIPLED, layered(), point, 1, {.has_refraction = false});
  EXPECT_EQ(evaluate_bsdf(reflecting, down).total_cos(), Rgb());
  EXPECT_EQ(evaluate_bsdf(reflecting, up).total_cos(), evaluate_bsdf(whole, up).total_cos());
  EXPECT_EQ(build(Op::CLOSURE_PRINCIPLED, layered(), point, 1, {false, false}).count, 1);
}

TEST(Closures, SoftenedGlossKeepsItsWeightAndSamplesItsDensity) {
  const SurfacePoint point = make_point(0.6f);
  const Bsdf whole = build(Op::CLOSURE_PRINCIPLED, layered(), point);
  const Bsdf soft = build(Op::CLOSURE_PRINCIPLED, layered(), point, 1, {.least_alpha = 0.4f});
  ASSERT_EQ(soft.count, whole.count);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(std::get<MicrofacetLobe>(soft.lobes[i].model).alpha_x, 0.4f);
    EXPECT_EQ(soft.lobes[i].weight, whole.lobes[i].weight);
  }
  expect_density_of_samples(soft);
  Inputs air = principled();
  air[TRANSMISSION] = air[IOR] = grey(1.0f);
  const Bsdf clear = build(Op::CLOSURE_PRINCIPLED, air, point, 1, {.least_alpha = 0.4f});
  EXPECT_EQ(std::get<MicrofacetLobe>(clear.lobes[0].model).alpha_x, 0.0f) << "light goes straight on";
}

TEST(Closures, CoatAbsorbsEmissionByBeersLaw) {
  Inputs in = principled();
  in[COAT] = in[STRENGTH] = grey(1.0f);
  in[COAT_IOR] = grey(1.0f);  // an index of 1 neither reflects nor bends
  in[COAT_TINT] = grey(0.5f);
  EXPECT_NEAR(build(Op::CLOSURE_PRINCIPLED, in, make_point(1.0f)).emission.g, 0.5f, 1e-3f);
  EXPECT_NEAR(build(Op::CLOSURE_PRINCIPLED, in, make_point(0.5f)).emission.g, 0.25f, 1e-3f);  // twice the way
}

/// From Blender 5.3 on the covered part alone is dimmed and tinted; before, all of it by mean shares.
TEST(Closures, HalfACoatDimsAndTintsWhatItCovers) {
  Inputs in = principled();
  in[COAT] = grey(0.5f);
  in[STRENGTH] = grey(1.0f);
  in[COAT_IOR] = grey(2.0f);  // reflects 1 / 9 head-on
  in[COAT_TINT] = grey(0.3f);
  const SurfacePoint point = make_point(1.0f);
  const auto emission = [&](int32_t layers) {
    const int32_t parameters[4] = {1, 0, layers, 0};
    Bsdf bsdf;
    bsdf.ng = point.ng;
    bsdf.wo = point.wo;
    add_closure(bsdf, Op::CLOSURE_PRINCIPLED, in, parameters, point);
    return bsdf.emission.g;
  };
  EXPECT_NEAR(emission(8), 0.5f + 0.5f * 0.3f * 8.0f / 9.0f, 5e-3f);
  EXPECT_NEAR(emission(0), (1.0f - 0.5f / 9.0f) * (0.5f + 0.5f * 0.3f), 5e-3f);
  in[COAT_TINT] = grey(4.0f);  // no coat adds light there
  EXPECT_LE(emission(8), 1.0f);
}

TEST(Closures, GlassKnowsInsideFromOutside) {
  const Inputs in{grey(1.0f), grey(1.0f), grey(0.3f), grey(1.5f), kTestNormal,
                  grey(0.0f), grey(1.0f), grey(0.0f), grey(0.0f), {}};
  SurfacePoint point = make_point(0.5f);
  const auto ior = [&] { return std::get<MicrofacetLobe>(build(Op::CLOSURE_GLASS, in, point).lobes[0].model).ior; };
  EXPECT_FLOAT_EQ(ior(), 1.5f);
  point.is_backface = true;
  EXPECT_FLOAT_EQ(ior(), 1.0f / 1.5f);
}

TEST(Closures, SingleLobeNodes) {
  const SurfacePoint point = make_point(0.7f);
  const auto mean_albedo = [&](Op op, const Inputs& in, int32_t parameter = 1) {
    return furnace(build(op, in, point, parameter));
  };
  const Vec3 n = kTestNormal, t = kFrame.s, one = grey(1.0f), none = grey(0.0f);
  EXPECT_NEAR(mean_albedo(Op::CLOSURE_DIFFUSE, {one, grey(0.5f), grey(0.0f), n}), 0.5, 1e-3);
  EXPECT_NEAR(mean_albedo(Op::CLOSURE_DIFFUSE, {one, one, grey(1.0f), n}), 1.0, 0.01);
  EXPECT_NEAR(mean_albedo(Op::CLOSURE_TRANSLUCENT, {one, grey(0.5f), n}), 0.5, 1e-3);
  EXPECT_NEAR(mean_albedo(Op::CLOSURE_GLOSSY, {one, one, grey(0.8f), grey(0.0f), grey(0.0f), n, t}), 1.0, 0.01);
  EXPECT_LT(mean_albedo(Op::CLOSURE_GLOSSY, {one, one, grey(0.8f), grey(0.0f), grey(0.0f), n, t}, 0), 0.97);
  EXPECT_NEAR(mean_albedo(Op::CLOSURE_GLASS, {one, one, grey(0.5f), grey(1.5f), n, none, one, none, none, t}), 1.0,
              0.015);
  EXPECT_NEAR(mean_albedo(Op::CLOSURE_GLASS, {one, one, grey(0.5f), grey(1.5f), n, none, one, grey(0.4f), none, t}),
              1.0, 0.02);
  EXPECT_LT(mean_albedo(Op::CLOSURE_REFRACTION, {one, one, grey(0.5f), grey(1.5f), n}), 1.0);
  EXPECT_NEAR(mean_albedo(Op::CLOSURE_METALLIC, {one, one, one, grey(0.5f), grey(0.3f), none, n, t, none, one}), 1.0,
              0.01);
  EXPECT_GT(mean_albedo(Op::CLOSURE_SHEEN, {one, one, grey(1.0f), n}), 0.2);
}

struct NamedClosure {
  const char* name;
  Op op;
  Inputs inputs;
};

/// Everything with a diffuse lobe.
std::vector<NamedClosure> diffuse_closures() {
  Inputs plain = principled(), coated = principled(), velvet = principled(), mixed = principled(), clay = principled();
  Inputs soap = principled(), oil = principled();
  coated[COAT] = grey(0.8f), coated[COAT_TINT] = {0.9f, 0.6f, 0.4f};
  velvet[SHEEN] = grey(0.7f);
  mixed[METALLIC] = mixed[TRANSMISSION] = grey(0.4f);
  clay[DIFFUSE_ROUGHNESS] = grey(1.0f), clay[LEVEL] = grey(0.0f);
  soap[FILM] = grey(400.0f);
  oil[FILM] = grey(250.0f), oil[FILM_IOR] = grey(2.0f), oil[ROUGHNESS] = grey(0.2f);
  const Vec3 one = grey(1.0f), leaf{0.2f, 0.7f, 0.1f}, n = kTestNormal;
  return {{"plain", Op::CLOSURE_PRINCIPLED, plain},
          {"coated", Op::CLOSURE_PRINCIPLED, coated},
          {"velvet", Op::CLOSURE_PRINCIPLED, velvet},
          {"mixed", Op::CLOSURE_PRINCIPLED, mixed},
          {"clay", Op::CLOSURE_PRINCIPLED, clay},
          {"soap", Op::CLOSURE_PRINCIPLED, soap},
          {"oil", Op::CLOSURE_PRINCIPLED, oil},
          {"Lambert", Op::CLOSURE_DIFFUSE, {one, leaf, grey(0.0f), n}},
          {"Oren-Nayar", Op::CLOSURE_DIFFUSE, {one, leaf, grey(0.7f), n}},
          {"translucent", Op::CLOSURE_TRANSLUCENT, {one, leaf, n}}};
}

/// Where layers leave nothing at some angles, or nothing but a tint.
std::vector<NamedClosure> odd_closures() {
  Inputs velvet = principled(), varnished = principled();
  velvet[SHEEN] = grey(5.0f);
  varnished[COAT] = varnished[COAT_IOR] = grey(1.0f), varnished[COAT_TINT] = {0.9f, 0.6f, 0.4f};
  varnished[LEVEL] = grey(0.0f);
  return {{"heavy velvet", Op::CLOSURE_PRINCIPLED, velvet}, {"varnished", Op::CLOSURE_PRINCIPLED, varnished}};
}

/// Its shading normal leans away from the viewer, as those of smooth meshes may: specular normals then bend.
SurfacePoint leaning_point(float cosine) {
  SurfacePoint point = make_point(cosine);
  point.ng = normalize(kTestNormal + 0.6f * kFrame.s);
  return point;
}

/// Light that arrives at random, from both sides.
template <class Check>
void for_directions(const Check& check) {
  Rng rng(10, 0, 0, 0);
  for (int i = 0; i < 200; ++i) check(square_to_sphere(rng.next_vec2()));
}

TEST(Closures, TheEvenPartDoesNotKnowTheView) {
  std::vector<NamedClosure> closures = diffuse_closures();
  for (const NamedClosure& odd : odd_closures()) closures.push_back(odd);
  for (const NamedClosure& closure : closures) {
    for (const auto& point_at : {make_point, leaning_point}) {
      const Bsdf head_on = build(closure.op, closure.inputs, point_at(1.0f));
      for (const float cosine : {0.9f, 0.4f, 0.05f}) {
        const Bsdf bsdf = build(closure.op, closure.inputs, point_at(cosine));
        EXPECT_TRUE(bsdf.even_shade == head_on.even_shade || is_black(bsdf.lobes[0].even)) << closure.name;
        for_directions([&](Vec3 wi) {
          const BsdfEvaluation f = evaluate_bsdf(bsdf, wi);
          EXPECT_EQ(f.even_cos, evaluate_bsdf(head_on, wi).even_cos) << closure.name;
          EXPECT_TRUE(is_black(f.even_cos) || f.pdf > 0.0f) << closure.name;
        });
      }
    }
  }
}

/// Else what is left to the finder of a sample point would often be negative.
TEST(Closures, TheEvenPartIsMuchOfDiffuseLobesAndSeldomMore) {
  for (const auto& [name, op, inputs] : diffuse_closures()) {
    for (const float cosine : {1.0f, 0.7f, 0.4f, 0.2f}) {
      const Bsdf bsdf = build(op, inputs, make_point(cosine));
      const Lobe& diffuse = bsdf.lobes[static_cast<size_t>(bsdf.count - 1)];
      const float even = diffuse.even.g * even_transmittance(bsdf.even_shade, cosine) / diffuse.weight.g;
      EXPECT_LT(even, 1.12f) << name << cosine;
      EXPECT_GT(even, 0.35f) << name << cosine;
    }
  }
}

/// Of one Lambert lobe each; a varnish that does not bend light tints it by the angle of view nevertheless.
TEST(Closures, OnlyWhatLooksAlikeFromEverywhereIsLambertian) {
  Scene scene;
  scene.materials.push_back(std::make_shared<const MaterialProgram>());
  Inputs varnished = odd_closures().back().inputs, plain = varnished, matte = varnished;
  plain[COAT] = grey(0.0f);
  matte[COAT_ROUGHNESS] = grey(1.0f);  // then the tint alone tells
  for (const float cosine : {1.0f, 0.3f}) {
    SurfacePoint point = make_point(cosine);
    point.material = 0;
    for (const auto& [inputs, is_lambertian] : {std::pair{plain, true}, {varnished, false}, {matte, false}}) {
      const Bsdf bsdf = build(Op::CLOSURE_PRINCIPLED, inputs, point);
      EXPECT_EQ(bsdf.count, 1);
      EXPECT_EQ(make_visible_point(scene, point, bsdf).is_lambertian, is_lambertian) << cosine;
    }
  }
}

TEST(Closures, NegligibleWeightsLeaveNothing) {
  Inputs in = principled();
  in[WEIGHT] = grey(1e-6f);
  EXPECT_EQ(build(Op::CLOSURE_PRINCIPLED, in, make_point(0.5f)).count, 0);
  EXPECT_EQ(build(Op::CLOSURE_DIFFUSE, {grey(0.0f), grey(1.0f), {}, kTestNormal}, make_point(0.5f)).count, 0);
}

TEST(Closures, SpecularNormalsKeepMirrorDirectionsAboveTheSurface) {
  Rng rng(9, 0, 0, 0);
  int lifted = 0;
  for (int i = 0; i < 2000; ++i) {
    SurfacePoint point = make_point(0.02f + 0.98f * rng.next_float());
    const Vec3 n = normalize(kTestNormal + 0.9f * square_to_sphere(rng.next_vec2()));
    if (dot(n, point.wo) <= 0.0f) continue;
    const Vec3 bent = specular_normal(n, point);
    EXPECT_NEAR(length(bent), 1.0f, 1e-4f);
    EXPECT_GT(dot(reflect(point.wo, bent), point.ng), 0.0f);
    lifted += bent != n;
  }
  EXPECT_GT(lifted, 100);  // without the correction these would have pointed into the surface
}

}  // namespace
}  // namespace cistern::test
