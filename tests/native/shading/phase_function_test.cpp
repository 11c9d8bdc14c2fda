#include "shading/phase_function.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace cistern::test {
namespace {

struct Case {
  const char* name;
  PhaseFunction phase;
};

std::vector<Case> cases() {
  std::vector<Case> all{
      {"isotropic", {}},
      {"forward", PhaseFunction::henyey_greenstein(0.85f)},
      {"Rayleigh", PhaseFunction::rayleigh()},
      {"Draine", PhaseFunction::draine(0.6f, 0.5f)},
      {"Draine, even", PhaseFunction::draine(0.0f, 0.01f)},
      {"Draine, hardly uneven", PhaseFunction::draine(0.0011f, 250.0f)},
      {"Draine, backward", PhaseFunction::draine(-0.7f, 3.0f)},
      {"Draine, sharp", PhaseFunction::draine(0.99f, 30.0f)},
      {"sea water", PhaseFunction::fournier_forand(1.33f, 0.1f)},
      {"clear water", PhaseFunction::fournier_forand(1.1f, 0.0183f)},
      {"backscattering", PhaseFunction::fournier_forand(1.05f, 0.499f)},
      {"delta of 1 at a right angle", PhaseFunction::fournier_forand(1.8164966f, 0.2f)},
      {"delta of 1 straight back", PhaseFunction::fournier_forand(2.1547005177f, 0.2f)},
      {"little backscatter", PhaseFunction::fournier_forand(1.5f, 0.001f)},
  };
  for (const float diameter : {0.05f, 0.8f, 2.0f, 20.0f}) all.push_back({"droplets", droplet_phase(diameter).draine});
  return all;
}

/// The integral over all deflections by an angle of a cosine from `least` on, of the density times `weight(cosine)`.
/// Steps are even in the logarithm of 1 - cosine, which resolves peaks.
double integral(const PhaseFunction& phase, double least, const std::function<double(double)>& weight) {
  constexpr int kSteps = 40000;
  constexpr double kNearest = 1e-9;  // of 1 - cosine; below it the density is taken for even
  const double span = std::log((1.0 - least) / kNearest);
  double sum = phase.density(1.0f) * weight(1.0) * kNearest;
  for (int i = 0; i < kSteps; ++i) {
    const double below = kNearest * std::exp(span * (i + 0.5) / kSteps);
    sum += phase.density(static_cast<float>(1.0 - below)) * weight(1.0 - below) * below * span / kSteps;
  }
  return 2.0 * M_PI * sum;
}
double integral(const PhaseFunction& phase, double least = -1.0) {
  return integral(phase, least, [](double) { return 1.0; });
}
double mean_cosine(const PhaseFunction& phase) {
  return integral(phase, -1.0, [](double cosine) { return cosine; });
}

/// Single precision tells 1 - cosine, by which the densities of the sharpest change, to a few per cent at 1e-6.
constexpr double kAccuracy = 2e-3;

TEST(PhaseFunction, IsADensity) {
  for (const Case& c : cases()) EXPECT_NEAR(integral(c.phase), 1.0, kAccuracy) << c.name;
}

TEST(PhaseFunction, SamplesInvertTheDistribution) {
  for (const Case& c : cases())
    for (const float u : {0.01f, 0.2f, 0.5f, 0.77f, 0.95f, 0.999f}) {
      const float cosine = c.phase.sample_cosine(u);
      ASSERT_GE(cosine, -1.0f) << c.name;
      ASSERT_LE(cosine, 1.0f) << c.name;
      if (cosine < 1.0f - 1e-5f) {
        EXPECT_NEAR(integral(c.phase, cosine), u, kAccuracy) << c.name << " " << u;
      } else {
        EXPECT_GT(integral(c.phase, 1.0 - 2e-5), u - kAccuracy) << c.name << " " << u;
      }
    }
}

TEST(PhaseFunction, AWrongDistributionIsSeen) {
  const PhaseFunction wrong = PhaseFunction::draine(0.6f, 0.55f), right = PhaseFunction::draine(0.6f, 0.5f);
  double most = 0.0;
  for (const float u : {0.01f, 0.2f, 0.5f, 0.77f, 0.95f, 0.999f})
    most = std::max(most, std::abs(integral(right, wrong.sample_cosine(u)) - u));
  EXPECT_GT(most, kAccuracy);
}

TEST(PhaseFunction, EndsOfTheDistributionAreEndsOfTheSphere) {
  for (const Case& c : cases()) {
    EXPECT_NEAR(c.phase.sample_cosine(0.0f), 1.0f, 1e-6f) << c.name;
    EXPECT_NEAR(c.phase.sample_cosine(1.0f), -1.0f, 1e-5f) << c.name;
    float before = 1.0f;
    for (int i = 0; i < 1000; ++i) {
      const float cosine = c.phase.sample_cosine(static_cast<float>(i) / 1000.0f);
      ASSERT_LE(cosine, before + 1e-6f) << c.name << " " << i;
      before = cosine;
    }
  }
}

TEST(PhaseFunction, RayleighsIsThatOfDipoles) {
  for (const float cosine : {-1.0f, -0.3f, 0.0f, 0.8f})
    EXPECT_NEAR(PhaseFunction::rayleigh().density(cosine), 3.0 / (16.0 * M_PI) * (1.0 + cosine * cosine), 1e-6);
}

TEST(PhaseFunction, DrainesHasHisMeanCosine) {
  for (const auto& [g, alpha] : {std::pair{0.5f, 1.0f}, {-0.7f, 3.0f}, {0.3f, 30.0f}}) {
    const double g2 = g * g,
                 expected = g * (1.0 + alpha * (3.0 + 2.0 * g2) / 5.0) / (1.0 + alpha * (1.0 + 2.0 * g2) / 3.0);
    EXPECT_NEAR(mean_cosine(PhaseFunction::draine(g, alpha)), expected, 1e-4) << g;
  }
}

TEST(PhaseFunction, BackscatterIsWhatIsDeflectedByMoreThanARightAngle) {
  for (const float ior : {1.01f, 1.33f, 1.8164966f, 3.0f})
    for (const float backscatter : {0.001f, 0.1f, 0.45f}) {
      constexpr int kSteps = 1000;
      double sum = 0.0;
      for (int i = 0; i < kSteps; ++i)
        sum += PhaseFunction::fournier_forand(ior, backscatter).density((static_cast<float>(i) + 0.5f) / -kSteps);
      EXPECT_NEAR(2.0 * M_PI * sum / kSteps / backscatter, 1.0, 1e-4) << ior;
    }
}

TEST(PhaseFunction, FournierAndForandsIsAsMobleyPrintsIt) {
  for (const double angle : {0.05, 0.7, M_PI / 2.0, 3.0}) {
    const double n = 1.1, nu = -0.6, x = std::pow(std::sin(0.5 * angle), 2.0);
    const auto delta_of = [&](double y) { return 4.0 / (3.0 * (n - 1.0) * (n - 1.0)) * y; };
    const double d = delta_of(x), d90 = delta_of(0.5), d180 = delta_of(1.0);
    const double backscatter =
        1.0 - (1.0 - std::pow(d90, nu + 1.0) - 0.5 * (1.0 - std::pow(d90, nu))) / ((1.0 - d90) * std::pow(d90, nu));
    const double peak =
        (nu * (1.0 - d) - (1.0 - std::pow(d, nu)) + (d * (1.0 - std::pow(d, nu)) - nu * (1.0 - d)) / x) /
        (4.0 * M_PI * (1.0 - d) * (1.0 - d) * std::pow(d, nu));
    const double tail = (1.0 - std::pow(d180, nu)) / (16.0 * M_PI * (d180 - 1.0) * std::pow(d180, nu)) *
                        (3.0 * std::pow(std::cos(angle), 2.0) - 1.0);
    const PhaseFunction phase = PhaseFunction::fournier_forand(n, static_cast<float>(backscatter));
    EXPECT_NEAR(phase.density(static_cast<float>(std::cos(angle))) / (peak + tail), 1.0, 1e-3) << angle;
  }
}

TEST(PhaseFunction, SmallDropletsScatterAsDipolesDo) {
  const DropletPhase droplets = droplet_phase(0.0f);
  for (const float cosine : {-1.0f, 0.0f, 0.5f}) {
    const double mixture =
        std::lerp(droplets.henyey_greenstein.density(cosine), droplets.draine.density(cosine), droplets.draine_share);
    EXPECT_NEAR(mixture / PhaseFunction::rayleigh().density(cosine), 1.0, 0.02) << cosine;
  }
}

TEST(PhaseFunction, LargeDropletsScatterForward) {
  float before = 0.0f;
  for (const float diameter : {5.0f, 10.0f, 20.0f, 50.0f}) {
    const DropletPhase droplets = droplet_phase(diameter);
    EXPECT_GT(droplets.henyey_greenstein.g(), before);
    before = droplets.henyey_greenstein.g();
    const double mean = std::lerp(mean_cosine(droplets.henyey_greenstein), mean_cosine(droplets.draine),
                                  static_cast<double>(droplets.draine_share));
    EXPECT_GT(mean, 0.8) << diameter;
    EXPECT_LT(mean, 0.9) << diameter;
  }
}

TEST(PhaseFunction, FitsMeetWhereTheyEnd) {
  for (const float diameter : {0.1f, 1.5f, 5.0f}) {
    const DropletPhase below = droplet_phase(0.9999f * diameter), above = droplet_phase(1.0001f * diameter);
    for (const float cosine : {-0.9f, 0.0f, 0.7f}) {
      const auto density = [&](const DropletPhase& p) {
        return std::lerp(p.henyey_greenstein.density(cosine), p.draine.density(cosine), p.draine_share);
      };
      EXPECT_NEAR(density(below) / density(above), 1.0, 0.35) << diameter << " " << cosine;
    }
  }
}

TEST(PhaseFunction, BadNumbersAreClamped) {
  EXPECT_EQ(PhaseFunction::draine(NAN, INFINITY), PhaseFunction());
  EXPECT_EQ(PhaseFunction::draine(0.5f, -2.0f), PhaseFunction::henyey_greenstein(0.5f));
  EXPECT_EQ(PhaseFunction::fournier_forand(NAN, NAN), PhaseFunction::fournier_forand(1.33f, 0.1f));
  EXPECT_EQ(droplet_phase(NAN).draine, droplet_phase(-3.0f).draine);
  for (const PhaseFunction& phase :
       {PhaseFunction::fournier_forand(0.0f, -1.0f), PhaseFunction::fournier_forand(1e30f, 7.0f),
        PhaseFunction::draine(1.0f, 1e30f), droplet_phase(1e30f).henyey_greenstein, droplet_phase(INFINITY).draine}) {
    for (const float cosine : {-1.0f, 0.0f, 1.0f}) EXPECT_TRUE(std::isfinite(phase.density(cosine)));
    for (const float cosine : {-1.0f, 0.0f, 1.0f}) EXPECT_GE(phase.density(cosine), 0.0f);
    for (const float u : {0.0f, 0.5f, 0.99999994f}) EXPECT_LE(std::abs(phase.sample_cosine(u)), 1.0f);
  }
}

}  // namespace
}  // namespace cistern::test
