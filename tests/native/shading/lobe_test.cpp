#include <gtest/gtest.h>

#include "shading/albedo_tables.h"
#include "shading/ashikhmin_shirley.h"
#include "shading/bsdf_statistics.h"
#include "shading/fresnel.h"
#include "shading/lobe_microfacet.h"
#include "shading/lobe_sheen.h"
#include "shading/lobe_velvet.h"

namespace cistern::test {
namespace {

const Frame kFrame(kTestNormal);

MicrofacetLobe reflection(float roughness) {
  MicrofacetLobe lobe;
  lobe.n = kTestNormal;
  lobe.alpha_x = lobe.alpha_y = sqr(roughness);
  return lobe;
}
MicrofacetLobe anisotropic(float alpha_x, float alpha_y) {
  MicrofacetLobe lobe = reflection(0.0f);
  lobe.alpha_x = alpha_x;
  lobe.alpha_y = alpha_y;
  lobe.tangent = kFrame.s;
  return lobe;
}
MicrofacetLobe glass(float roughness, float ior) {
  MicrofacetLobe lobe = reflection(roughness);
  lobe.transmits = true;
  lobe.fresnel = FresnelModel::DIELECTRIC;
  lobe.ior = ior;
  return lobe;
}
MicrofacetLobe refraction(float roughness, float ior) {
  MicrofacetLobe lobe = glass(roughness, ior);
  lobe.reflects = false;
  lobe.fresnel = FresnelModel::NONE;
  return lobe;
}

MicrofacetLobe with_film(MicrofacetLobe lobe, FresnelModel fresnel) {
  lobe.fresnel = fresnel;
  lobe.f0 = fresnel == FresnelModel::FILM_ON_METAL ? Rgb(0.9f, 0.6f, 0.2f) : Rgb(f0_from_ior(lobe.ior));
  lobe.f90_or_b = Rgb(0.0f);
  lobe.film = {350.0f, 1.7f};
  return lobe;
}

template <class Model>
double p_value(const Model& lobe, Vec3 wo, const DirectionDensity& density, uint64_t seed) {
  const auto sampler = [&](Rng& rng) {
    const float u = rng.next_float();
    return sample_lobe(lobe, wo, u, rng.next_vec2());
  };
  return sampler_p_value(kFrame, sampler, density, seed);
}
template <class Model>
double p_value(const Model& lobe, Vec3 wo, uint64_t seed) {
  return p_value(
      lobe, wo, [&](Vec3 wi) { return evaluate_lobe(lobe, wo, wi).pdf; }, seed);
}

constexpr int kChiSquareCases = 40;  // at most, in each test: they share kFalseAlarmRate
const double kThreshold = shared_rate(kChiSquareCases);

TEST(Lobe, DiffuseSamplersFollowTheirDensity) {
  const Vec3 wo = at_angle(kFrame, 0.5f);
  EXPECT_GT(p_value(LambertLobe{kTestNormal}, wo, 1), kThreshold);
  EXPECT_GT(p_value(TranslucentLobe{kTestNormal}, wo, 2), kThreshold);
  EXPECT_GT(p_value(make_oren_nayar(kTestNormal, wo, 0.7f, Rgb(0.8f)), wo, 3), kThreshold);
  // Planted bug: the density of a uniform hemisphere.
  const auto uniform = [](Vec3 wi) { return dot(kTestNormal, wi) > 0.0f ? 0.5f * kInvPi : 0.0f; };
  EXPECT_LT(p_value(LambertLobe{kTestNormal}, wo, uniform, 1), kThreshold);
}

TEST(Lobe, SheenSamplerFollowsItsDensity) {
  uint64_t seed = 10;
  for (float roughness : {0.25f, 0.5f, 1.0f})
    for (float cosine : {0.15f, 0.6f, 1.0f}) {
      const Vec3 wo = at_angle(kFrame, cosine);
      const Sheen sheen = make_sheen(kTestNormal, wo, roughness);
      EXPECT_GT(p_value(sheen.lobe, wo, ++seed), kThreshold) << roughness << " " << cosine;
    }
  // Planted bug: the transform without its Jacobian.
  const Vec3 wo = at_angle(kFrame, 0.6f);
  const SheenLobe lobe = make_sheen(kTestNormal, wo, 0.5f).lobe;
  const auto no_jacobian = [&](Vec3 wi) {
    return std::sqrt(evaluate_lobe(lobe, wo, wi).pdf * dot(kTestNormal, wi) * kInvPi);
  };
  EXPECT_LT(p_value(lobe, wo, no_jacobian, 10), kThreshold);
}

TEST(Lobe, ReflectionSamplerFollowsItsDensity) {
  uint64_t seed = 30;
  for (float roughness : {0.25f, 0.5f, 1.0f})
    for (float cosine : {0.1f, 0.6f, 0.9f}) {
      const Vec3 wo = at_angle(kFrame, cosine);
      EXPECT_GT(p_value(reflection(roughness), wo, ++seed), kThreshold) << roughness << " " << cosine;
      EXPECT_GT(p_value(anisotropic(sqr(roughness), 0.3f), wo, ++seed), kThreshold) << roughness << " " << cosine;
    }
  // Planted bug: the Jacobian 1 / (4 cos) of the half vector taken as constant.
  const Vec3 wo = at_angle(kFrame, 0.6f);
  const MicrofacetLobe lobe = reflection(0.5f);
  const auto no_jacobian = [&](Vec3 wi) {
    return evaluate_lobe(lobe, wo, wi).pdf * 4.0f * std::max(dot(wo, normalize(wi + wo)), 0.0f) * 0.3f;
  };
  EXPECT_LT(p_value(lobe, wo, no_jacobian, 30), kThreshold);
}

MicrofacetLobe beckmann(MicrofacetLobe lobe) {
  lobe.microfacets = Microfacets::BECKMANN;
  return lobe;
}

TEST(Lobe, BeckmannSamplersFollowTheirDensity) {
  uint64_t seed = 400;
  for (float roughness : {0.3f, 0.6f, 1.0f})
    for (float cosine : {0.1f, 0.6f, 0.9f}) {
      const Vec3 wo = at_angle(kFrame, cosine);
      EXPECT_GT(p_value(beckmann(reflection(roughness)), wo, ++seed), kThreshold) << roughness << " " << cosine;
      EXPECT_GT(p_value(beckmann(anisotropic(sqr(roughness), 0.3f)), wo, ++seed), kThreshold) << roughness;
      EXPECT_GT(p_value(beckmann(glass(roughness, 1.5f)), wo, ++seed), kThreshold) << roughness << " " << cosine;
    }
  // Planted bug: the density of GGX.
  const Vec3 wo = at_angle(kFrame, 0.6f);
  const auto of_ggx = [&](Vec3 wi) { return evaluate_lobe(reflection(0.5f), wo, wi).pdf; };
  EXPECT_LT(p_value(beckmann(reflection(0.5f)), wo, of_ggx, 400), kThreshold);
}

MicrofacetLobe ashikhmin_shirley(MicrofacetLobe lobe) {
  lobe.microfacets = Microfacets::ASHIKHMIN_SHIRLEY;
  return lobe;
}

TEST(Lobe, AshikhminShirleySamplersFollowTheirDensity) {
  uint64_t seed = 500;
  for (float roughness : {0.15f, 0.6f, 1.0f})
    for (float cosine : {0.1f, 0.6f, 0.9f}) {
      const Vec3 wo = at_angle(kFrame, cosine);
      EXPECT_GT(p_value(ashikhmin_shirley(reflection(roughness)), wo, ++seed), kThreshold)
          << roughness << " " << cosine;
      const MicrofacetLobe stretched = ashikhmin_shirley(anisotropic(sqr(roughness), 0.3f));
      EXPECT_GT(p_value(stretched, wo, ++seed), kThreshold) << roughness << " " << cosine;
    }
  // Planted bug: the density of the half vector.
  const Vec3 wo = at_angle(kFrame, 0.6f);
  const MicrofacetLobe lobe = ashikhmin_shirley(reflection(0.5f));
  const auto no_jacobian = [&](Vec3 wi) {
    return evaluate_lobe(lobe, wo, wi).pdf * std::max(dot(wo, normalize(wi + wo)), 0.0f);
  };
  EXPECT_LT(p_value(lobe, wo, no_jacobian, 500), kThreshold);
}

TEST(Lobe, VelvetSamplerFollowsItsDensity) {
  uint64_t seed = 600;
  for (float roughness : {0.1f, 0.5f, 1.0f})
    for (float cosine : roughness < 0.2f ? std::array{0.02f, 0.05f, 0.1f} : std::array{0.1f, 0.6f, 0.9f}) {
      const Vec3 wo = at_angle(kFrame, cosine);
      EXPECT_GT(p_value(make_velvet(kTestNormal, roughness), wo, ++seed), kThreshold) << roughness << " " << cosine;
    }
  // Planted bug: walls that wo does not see count, too.
  const Vec3 wo = at_angle(kFrame, 0.6f);
  const VelvetLobe lobe = make_velvet(kTestNormal, 0.5f);
  const auto all_walls = [&](Vec3 wi) {
    const Vec3 h = normalize(wi + wo);
    const float seen = 2.0f * dot(kTestNormal, h) * dot(kTestNormal, wo) / dot(wo, h);
    return evaluate_lobe(lobe, wo, wi).pdf / (seen < 1.0f ? 2.0f : 1.0f);
  };
  EXPECT_LT(p_value(lobe, wo, all_walls, 600), kThreshold);
}

TEST(Lobe, SharpAshikhminShirleyKeepsItsEnergy) {
  // Half vectors around the normal in rings that are even in the logarithm of their sine.
  for (const float roughness : {0.006f, 0.01f, 0.02f, 0.1f}) {
    const float alpha = sqr(roughness);
    double integral = 0.0;
    constexpr int kRings = 20000;
    constexpr double kFirst = -25.0;
    for (int i = 0; i < kRings; ++i) {
      const double sine = std::exp(kFirst * (1.0 - (i + 0.5) / kRings));
      const Vec3 h{static_cast<float>(sine), 0.0f, static_cast<float>(std::sqrt(1.0 - sine * sine))};
      integral += ashikhmin_shirley_density({alpha, alpha}, h) * 2.0 * std::numbers::pi * sine * sine / h.z;
    }
    EXPECT_NEAR(integral * -kFirst / kRings, 1.0, 2e-3) << roughness;
    double sine2 = 0.0;  // its mean is 2 / (n + 3)
    Rng rng(12, 0, 0, 0);
    constexpr int kDraws = 20000;
    for (int i = 0; i < kDraws; ++i) {
      const Vec3 h = sample_ashikhmin_shirley({alpha, alpha}, rng.next_vec2());
      sine2 += (sqr(double{h.x}) + sqr(double{h.y})) / kDraws;
    }
    EXPECT_NEAR(sine2 * (phong_exponent(alpha) + 3.0f) / 2.0f, 1.0, 0.05) << roughness;  // seven standard errors
  }
}

TEST(Lobe, VelvetAlbedoIsNearItsIntegral) {
  for (const float roughness : {0.1f, 0.3f, 0.6f, 1.0f})
    for (const float cosine : {0.05f, 0.2f, 0.5f, 0.8f}) {
      const Vec3 wo = at_angle(kFrame, cosine);
      const VelvetLobe lobe = make_velvet(kTestNormal, roughness);
      const auto f_cos = [&](Vec3 wi) { return evaluate_lobe(lobe, wo, wi).f_cos.g; };
      EXPECT_NEAR(velvet_albedo(lobe, wo), integrate_sphere(kFrame, f_cos), 0.04) << roughness << " " << cosine;
    }
}

TEST(Lobe, VelvetAndAshikhminShirleyReflectNoMoreThanTheirDensity) {
  constexpr float kRounding = 1.00001f, kTiny = 1e-30f;
  Rng rng(8, 0, 0, 0);
  const std::array lobes{ashikhmin_shirley(reflection(0.4f)), ashikhmin_shirley(anisotropic(0.1f, 0.6f))};
  for (int i = 0; i < 2000; ++i) {
    const Vec3 wo = kFrame.to_world(square_to_cosine_hemisphere(rng.next_vec2()));
    const Vec3 wi = kFrame.to_world(square_to_cosine_hemisphere(rng.next_vec2()));
    for (const MicrofacetLobe& lobe : lobes) {
      const LobeEvaluation seen = evaluate_lobe(lobe, wo, wi);
      EXPECT_LE(seen.f_cos.g, seen.pdf * kRounding + kTiny);
    }
    for (const float roughness : {0.0f, 0.1f, 1.0f}) {
      const LobeEvaluation seen = evaluate_lobe(make_velvet(kTestNormal, roughness), wo, wi);
      EXPECT_LE(seen.f_cos.g, seen.pdf * kRounding + kTiny) << roughness;
    }
  }
}

TEST(Lobe, RefractionSamplersFollowTheirDensityBothWays) {
  uint64_t seed = 60;
  for (float ior : {1.5f, 1.0f / 1.5f})
    for (float roughness : {0.35f, 0.7f})
      for (float cosine : {0.15f, 0.6f, 0.9f}) {
        const Vec3 wo = at_angle(kFrame, cosine);
        EXPECT_GT(p_value(glass(roughness, ior), wo, ++seed), kThreshold) << ior << " " << roughness << " " << cosine;
        EXPECT_GT(p_value(refraction(roughness, ior), wo, ++seed), kThreshold)
            << ior << " " << roughness << " " << cosine;
      }
  // Planted bug: the index forgotten in the Jacobian of refraction.
  const Vec3 wo = at_angle(kFrame, 0.6f);
  const MicrofacetLobe lobe = glass(0.5f, 1.5f);
  const auto no_eta = [&](Vec3 wi) {
    return evaluate_lobe(lobe, wo, wi).pdf * (dot(kTestNormal, wi) < 0.0f ? 1.0f / sqr(1.5f) : 1.0f);
  };
  EXPECT_LT(p_value(lobe, wo, no_eta, 60), kThreshold);
}

TEST(Lobe, SamplersFollowTheirDensityUnderThinFilms) {
  uint64_t seed = 90;
  for (float cosine : {0.15f, 0.6f, 0.9f}) {
    const Vec3 wo = at_angle(kFrame, cosine);
    EXPECT_GT(p_value(with_film(reflection(0.5f), FresnelModel::FILM_ON_METAL), wo, ++seed), kThreshold) << cosine;
    for (float ior : {1.5f, 1.0f / 1.5f}) {
      const MicrofacetLobe lobe = with_film(glass(0.5f, ior), FresnelModel::FILM_ON_DIELECTRIC);
      EXPECT_GT(p_value(lobe, wo, ++seed), kThreshold) << ior << " " << cosine;
    }
  }
  // Planted bug: branches chosen as without the film.
  const Vec3 wo = at_angle(kFrame, 0.15f);
  const MicrofacetLobe bare = glass(0.5f, 1.5f), lobe = with_film(bare, FresnelModel::FILM_ON_DIELECTRIC);
  EXPECT_LT(p_value(
                lobe, wo, [&](Vec3 wi) { return evaluate_lobe(bare, wo, wi).pdf; }, 90),
            kThreshold);
}

TEST(Lobe, DensitiesIntegrateToAtMostOne) {
  for (float cosine : {0.1f, 0.6f, 0.9f}) {
    const Vec3 wo = at_angle(kFrame, cosine);
    const auto integral = [&](const auto& lobe) {
      return integrate_sphere(kFrame, [&](Vec3 wi) { return evaluate_lobe(lobe, wo, wi).pdf; });
    };
    EXPECT_NEAR(integral(LambertLobe{kTestNormal}), 1.0, 1e-3);
    EXPECT_NEAR(integral(make_sheen(kTestNormal, wo, 0.6f).lobe), 1.0, 1e-3);
    for (float roughness : {0.3f, 1.0f}) {
      EXPECT_LT(integral(make_velvet(kTestNormal, roughness)), 1.001);
      EXPECT_LT(integral(ashikhmin_shirley(reflection(roughness))), 1.001);
      EXPECT_LT(integral(reflection(roughness)), 1.001);
      EXPECT_LT(integral(glass(roughness, 1.5f)), 1.001);
      EXPECT_LT(integral(glass(roughness, 1.0f / 1.5f)), 1.001);
    }
  }
}

/// Largest relative asymmetry of f over pairs of directions; on other sides of the surface, f(a, b; eta) is compared
/// with eta^2 f(b, a; 1 / eta).
double asymmetry(MicrofacetLobe lobe, bool transmits, float planted_power = 2.0f) {
  Rng rng(5, 0, 0, 0);
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 a = kFrame.to_world(square_to_cosine_hemisphere(rng.next_vec2()));
    Vec3 b = kFrame.to_world(square_to_cosine_hemisphere(rng.next_vec2()));
    if (transmits) b = -b;
    const float cos_a = std::abs(dot(a, kTestNormal)), cos_b = std::abs(dot(b, kTestNormal));
    MicrofacetLobe back = lobe;
    if (transmits) {
      back.ior = 1.0f / lobe.ior;
      back.n = -lobe.n;
    }
    const double forth = evaluate_lobe(lobe, a, b).f_cos.g / cos_b;
    const double reverse =
        evaluate_lobe(back, b, a).f_cos.g / cos_a * (transmits ? std::pow(lobe.ior, planted_power) : 1.0f);
    if (forth + reverse > 1e-3) worst = std::max(worst, std::abs(forth - reverse) / (forth + reverse));
  }
  return worst;
}

TEST(Lobe, MicrofacetsAreReciprocal) {
  EXPECT_LT(asymmetry(reflection(0.5f), false), 1e-3);
  EXPECT_LT(asymmetry(anisotropic(0.1f, 0.5f), false), 1e-3);
  EXPECT_LT(asymmetry(glass(0.6f, 1.5f), false), 1e-3);
  EXPECT_LT(asymmetry(with_film(anisotropic(0.1f, 0.5f), FresnelModel::FILM_ON_METAL), false), 1e-3);
  EXPECT_LT(asymmetry(with_film(glass(0.6f, 1.5f), FresnelModel::FILM_ON_DIELECTRIC), false), 1e-3);
  EXPECT_LT(asymmetry(ashikhmin_shirley(anisotropic(0.1f, 0.5f)), false), 1e-3);
  EXPECT_LT(asymmetry(glass(0.6f, 1.5f), true), 0.02);       // rounding, near the critical angle
  EXPECT_GT(asymmetry(glass(0.6f, 1.5f), true, 0.0f), 0.1);  // planted bug: no eta^2
}

/// As `asymmetry`, for lobes made for a `wo`: `make(wo)`.
template <class Make>
double asymmetry_of_reflection(const Make& make) {
  Rng rng(5, 0, 0, 0);
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 a = kFrame.to_world(square_to_cosine_hemisphere(rng.next_vec2()));
    const Vec3 b = kFrame.to_world(square_to_cosine_hemisphere(rng.next_vec2()));
    const double forth = evaluate_lobe(make(a), a, b).f_cos.g / dot(b, kTestNormal);
    const double reverse = evaluate_lobe(make(b), b, a).f_cos.g / dot(a, kTestNormal);
    worst = std::max(worst, std::abs(forth - reverse) / (forth + reverse + 1e-3));
  }
  return worst;
}

TEST(Lobe, VelvetIsReciprocal) {
  for (const float roughness : {0.2f, 1.0f})
    EXPECT_LT(asymmetry_of_reflection([=](Vec3) { return make_velvet(kTestNormal, roughness); }), 1e-3) << roughness;
  // Planted bug: walls that lean over by what lies opposite of the viewer.
  const auto leaning = [](Vec3 wo) { return make_velvet(kTestNormal, dot(kTestNormal, wo)); };
  EXPECT_GT(asymmetry_of_reflection(leaning), 1e-3);
}

TEST(Lobe, DiffuseLobesAreReciprocal) {
  EXPECT_LT(asymmetry_of_reflection([](Vec3) { return LambertLobe{kTestNormal}; }), 1e-5);
  for (const float roughness : {0.3f, 1.0f}) {
    const auto make = [=](Vec3 wo) { return make_oren_nayar(kTestNormal, wo, roughness, Rgb(0.8f)); };
    EXPECT_LT(asymmetry_of_reflection(make), 1e-3) << roughness;
    // Planted bug: the light of further bounces scaled by what leaves for one direction only.
    const auto fixed = [=](Vec3) { return make_oren_nayar(kTestNormal, at_angle(kFrame, 0.2f), roughness, Rgb(0.8f)); };
    EXPECT_GT(asymmetry_of_reflection(fixed), 1e-3) << roughness;
  }
}

// Sheen depends on wo and wi in different ways and is not reciprocal, as published; its albedo is the cosine lobe's.
TEST(Lobe, SheenReflectsNoMoreThanItsAlbedo) {
  for (const float roughness : {0.2f, 0.5f, 1.0f})
    for (const float cosine : {0.05f, 0.5f, 1.0f}) {
      const Vec3 wo = at_angle(kFrame, cosine);
      const Sheen sheen = make_sheen(kTestNormal, wo, roughness);
      const auto f_cos = [&](Vec3 wi) { return evaluate_lobe(sheen.lobe, wo, wi).f_cos.g; };
      EXPECT_NEAR(integrate_sphere(kFrame, f_cos), 1.0, 1e-2) << roughness << " " << cosine;
      EXPECT_LE(sheen.albedo, 1.0f);
      EXPECT_GE(sheen.albedo, 0.0f);
    }
}

/// Directional albedo through the sampler.
Moments albedo(const MicrofacetLobe& lobe, Vec3 wo, int samples = 20000) {
  Moments moments;
  Rng rng(6, 0, 0, 0);
  for (int i = 0; i < samples; ++i) {
    const float u = rng.next_float();
    const std::optional<Vec3> wi = sample_lobe(lobe, wo, u, rng.next_vec2());
    const LobeEvaluation e = wi ? evaluate_lobe(lobe, wo, *wi) : LobeEvaluation{};
    moments.add(e.pdf > 0.0f ? average(e.f_cos) / e.pdf : 0.0);
  }
  return moments;
}

TEST(Lobe, CompensatedMetalReflectsEverything) {
  for (float roughness : {0.2f, 0.5f, 0.8f, 1.0f})
    for (float cosine : {0.2f, 0.5f, 0.95f}) {
      const Vec3 wo = at_angle(kFrame, cosine);
      MicrofacetLobe lobe = reflection(roughness);
      lobe.fresnel = FresnelModel::F82_TINT;
      lobe.f0 = Rgb(1.0f);
      EXPECT_EQ(compensate_energy(lobe, wo, Rgb(1.0f)), Rgb(1.0f));
      EXPECT_NEAR(albedo(lobe, wo).mean(), 1.0, 0.01) << roughness << " " << cosine;
    }
  EXPECT_LT(albedo(reflection(1.0f), at_angle(kFrame, 0.5f)).mean(), 0.8);  // planted bug: no compensation
}

TEST(Lobe, CompensatedClearGlassLosesNothingOnTheWayIn) {
  for (float roughness : {0.2f, 0.5f, 0.8f})
    for (float cosine : {0.3f, 0.6f, 0.95f}) {
      const Vec3 wo = at_angle(kFrame, cosine);
      MicrofacetLobe in = glass(roughness, 1.5f), out = glass(roughness, 1.0f / 1.5f);
      compensate_energy(in, wo, Rgb(1.0f));
      compensate_energy(out, wo, Rgb(1.0f));
      EXPECT_NEAR(albedo(in, wo).mean(), 1.0, 0.015) << roughness << " " << cosine;
      EXPECT_LT(albedo(out, wo).mean(), 1.01) << roughness << " " << cosine;  // see generate_albedo_tables.cpp
    }
}

// Quadrature of f cos over the sphere knows nothing of the sampler that made the tables. Node values: no interpolation.
TEST(Lobe, AlbedoTablesMatchQuadrature) {
  for (int x : {12, 20, 31})
    for (int y : {6, 15, 31}) {
      const float roughness = static_cast<float>(x) / 31.0f, mu = static_cast<float>(y) / 31.0f;
      const Vec3 wo = at_angle(kFrame, mu);
      const MicrofacetLobe lobe = reflection(roughness);
      const double direct = integrate_sphere(kFrame, [&](Vec3 wi) { return evaluate_lobe(lobe, wo, wi).f_cos.g; });
      EXPECT_NEAR(ggx_albedo(roughness, mu), direct, 1e-3) << x << " " << y;
    }
  for (int z : {4, 7}) {
    const float f0 = std::pow(static_cast<float>(z) / 15.0f, 4.0f), ior = ior_from_f0(f0);
    EXPECT_NEAR(ior_coordinate(ior), static_cast<float>(z) / 15.0f, 1e-5f);
    const float roughness = 9.0f / 15.0f, mu = 12.0f / 15.0f;
    const Vec3 wo = at_angle(kFrame, mu);
    const MicrofacetLobe lobe = glass(roughness, ior);
    const double direct = integrate_sphere(kFrame, [&](Vec3 wi) { return evaluate_lobe(lobe, wo, wi).f_cos.g; });
    EXPECT_NEAR(ggx_glass_albedo(roughness, mu, ior), direct, 1e-3) << z;
    EXPECT_GT(std::abs(ggx_glass_albedo(roughness, mu, 1.0f / ior) - direct), 1e-3);  // planted bug: the wrong side
  }
}

// Of what comes out on either side; planted bug: what a smooth surface lets through there.
TEST(Lobe, AlbedoBySideIsAMeanOverFacets) {
  for (const float mu : {0.2f, 0.4f}) {
    const Vec3 wo = at_angle(kFrame, mu);
    const MicrofacetLobe lobe = glass(0.7f, 1.5f);
    const auto through = [&](bool below) {
      return integrate_sphere(kFrame, [&](Vec3 wi) {
        return (dot(wi, kTestNormal) < 0.0f) == below ? evaluate_lobe(lobe, wo, wi).f_cos.g : 0.0f;
      });
    };
    const double share = through(true) / (through(true) + through(false));
    const SidedAlbedo albedo = microfacet_albedo_by_side(lobe, wo);
    EXPECT_NEAR(albedo.transmitted.g, share, 0.04) << mu;
    EXPECT_GT(std::abs(facet_fresnel(lobe, mu).transmittance.g - share), 0.05) << mu;
    EXPECT_FLOAT_EQ(albedo.transmitted.g + albedo.reflected.g, 1.0f);
  }
}

TEST(Fresnel, KnownValues) {
  float cos_t = 0.0f;
  EXPECT_NEAR(fresnel_dielectric(1.0f, 1.5f, &cos_t), 0.04f, 1e-6f);
  EXPECT_NEAR(cos_t, 1.0f, 1e-6f);
  const float brewster = std::cos(std::atan(1.5f));  // only s-polarised light returns: half of ((n^2-1)/(n^2+1))^2
  EXPECT_NEAR(fresnel_dielectric(brewster, 1.5f), 0.5f * sqr(1.25f / 3.25f), 1e-6f);
  EXPECT_EQ(fresnel_dielectric(0.5f, 1.0f / 1.5f), 1.0f);  // beyond the critical angle
  EXPECT_NEAR(ior_from_f0(f0_from_ior(1.45f)), 1.45f, 1e-5f);
}

TEST(Fresnel, AveragesMatchQuadrature) {
  const Rgb f0(0.3f, 0.5f, 0.9f), tint(0.4f, 0.7f, 1.0f);
  const Rgb b = f82_coefficient(f0, tint);
  for (float eta : {1.2f, 1.5f, 2.0f, 0.7f}) {
    double dielectric = 0.0, metal = 0.0;
    constexpr int kSteps = 10000;
    for (int i = 0; i < kSteps; ++i) {
      const float mu = (static_cast<float>(i) + 0.5f) / kSteps;
      dielectric += 2.0f * mu * fresnel_dielectric(mu, eta) / kSteps;
      metal += 2.0f * mu * fresnel_f82(mu, f0, b).r / kSteps;
    }
    EXPECT_NEAR(fresnel_dielectric_average(eta), dielectric, 7e-3);
    EXPECT_NEAR(fresnel_f82_average(f0, b).r, metal, 1e-4);
  }
  // The tint multiplies Schlick's value at cos = 1/7.
  EXPECT_NEAR(fresnel_f82(1.0f / 7.0f, f0, b).r / fresnel_f82(1.0f / 7.0f, f0, Rgb(0.0f)).r, 0.4f, 1e-4f);
}

TEST(Lobe, OrenNayarConservesEnergyAndTendsToLambert) {
  for (float cosine : {0.1f, 0.5f, 1.0f}) {
    const Vec3 wo = at_angle(kFrame, cosine);
    const auto albedo_of = [&](float roughness, Rgb color) {
      const OrenNayarLobe lobe = make_oren_nayar(kTestNormal, wo, roughness, color);
      return integrate_sphere(kFrame, [&](Vec3 wi) { return evaluate_lobe(lobe, wo, wi).f_cos.g; });
    };
    EXPECT_NEAR(albedo_of(0.001f, Rgb(1.0f)), 1.0, 2e-3);
    EXPECT_NEAR(albedo_of(1.0f, Rgb(1.0f)), 1.0, 0.01);  // white stays white
    EXPECT_LT(albedo_of(1.0f, Rgb(0.0f)), 0.98);         // planted bug: no further bounces
    // Light that bounces twice is coloured twice, and once of these by the lobe's weight.
    const auto further = [&](float color, bool is_dim) {
      const OrenNayarLobe lobe = make_oren_nayar(kTestNormal, wo, 1.0f, Rgb(color), is_dim);
      return lobe.multi_scatter.g / make_oren_nayar(kTestNormal, wo, 1.0f, Rgb(1.0f)).multi_scatter.g;
    };
    EXPECT_NEAR(further(1e-3f, false) / further(2e-3f, false), 0.5f, 1e-3f);
    EXPECT_NEAR(further(1e-3f, true) / further(2e-3f, true), 0.25f, 1e-3f);
  }
}

}  // namespace
}  // namespace cistern::test
