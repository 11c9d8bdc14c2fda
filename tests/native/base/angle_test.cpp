#include "base/angle.h"

#include <gtest/gtest.h>

#include <numbers>

namespace cistern {
namespace {

constexpr int kSteps = 1 << 20;
constexpr double kTurn = 2.0 * std::numbers::pi;

/// Largest difference between `f` and the exact `g` over [low, high], both ends included.
template <class F, class G>
double largest_error(float low, float high, F f, G g) {
  double largest = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const float x = low + (high - low) * (static_cast<float>(i) / kSteps);
    largest = std::max(largest, std::abs(static_cast<double>(f(x)) - g(static_cast<double>(x))));
  }
  return largest;
}

TEST(Angle, SineAndCosineOfTurns) {
  const auto sine = [](float turns) { return sine_cosine_of_turns(turns).sine; };
  const auto cosine = [](float turns) { return sine_cosine_of_turns(turns).cosine; };
  EXPECT_LT(largest_error(0.0f, 1.0f, sine, [](double turns) { return std::sin(kTurn * turns); }), 2e-7);
  EXPECT_LT(largest_error(0.0f, 1.0f, cosine, [](double turns) { return std::cos(kTurn * turns); }), 2e-7);
}

TEST(Angle, SineAndCosineOfTurnsAreUnit) {
  const auto squares = [](float turns) {
    const SineCosine s = sine_cosine_of_turns(turns);
    return s.sine * s.sine + s.cosine * s.cosine;
  };
  EXPECT_LT(largest_error(0.0f, 1.0f, squares, [](double) { return 1.0; }), 3e-7);
}

TEST(Angle, AzimuthIsThatOfTheDirection) {
  const auto azimuth = [](float turns) {
    const double angle = kTurn * static_cast<double>(turns);
    return azimuth_turns(static_cast<float>(std::sin(angle)), static_cast<float>(std::cos(angle)));
  };
  EXPECT_LT(largest_error(-0.4999f, 0.4999f, azimuth, [](double turns) { return turns; }), 2e-7);
}

TEST(Angle, AzimuthOfAxes) {
  EXPECT_EQ(azimuth_turns(0.0f, 1.0f), 0.0f);
  EXPECT_EQ(azimuth_turns(1.0f, 0.0f), 0.25f);
  EXPECT_EQ(azimuth_turns(-1.0f, 0.0f), -0.25f);
  EXPECT_EQ(azimuth_turns(0.0f, -1.0f), 0.5f);
  EXPECT_EQ(azimuth_turns(-0.0f, -1.0f), -0.5f);
  EXPECT_EQ(azimuth_turns(0.0f, 0.0f), 0.0f);
  EXPECT_EQ(azimuth_turns(0x1p-140f, 0.0f), 0.25f);
}

TEST(Angle, ElevationIsThatOfTheDirection) {
  EXPECT_LT(largest_error(-1.0f, 1.0f, elevation_half_turns, [](double z) { return 2.0 * std::asin(z) / kTurn; }),
            2e-7);
  EXPECT_NEAR(elevation_half_turns(1e-9f) / (1e-9f * kInvPi), 1.0f, 1e-5f);
}

TEST(Angle, InclinationIsThatOfTheDirection) {
  EXPECT_LT(largest_error(-1.0f, 1.0f, inclination_half_turns, [](double z) { return 2.0 * std::acos(z) / kTurn; }),
            2e-7);
  EXPECT_EQ(inclination_half_turns(1.0f), 0.0f);
  EXPECT_EQ(inclination_half_turns(-1.0f), 1.0f);
}

}  // namespace
}  // namespace cistern
