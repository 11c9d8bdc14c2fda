// Two receivers exchange points of one square light. Weights are kept in area measure at the light and targets hold the
// geometry term, so a point needs no Jacobian to change receivers; the mean must be the irradiance in closed form.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "base/rng.h"
#include "base/vec.h"
#include "resampling/resample.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr float kSide = 1.0f, kHeight = 0.8f;  // light: [0, 1]^2 at z = 0.8, facing down, radiance 1
constexpr int kRuns = 60000;

struct Receiver {
  Vec3 position, normal;
};

struct Geometry {
  float cos_receiver, cos_light_over_distance_squared;
};

Geometry geometry(const Receiver& receiver, Vec2 uv) {
  const Vec3 to_light = Vec3{uv.x * kSide, uv.y * kSide, kHeight} - receiver.position;
  const float distance_squared = dot(to_light, to_light), distance = std::sqrt(distance_squared);
  return {std::max(0.0f, dot(to_light, receiver.normal) / distance), to_light.z / distance / distance_squared};
}

/// Irradiance of a receiver that sees the whole polygon. [Lambert 1760; Baum et al. 1989]
double irradiance(const Receiver& receiver, const std::vector<Vec3>& polygon) {
  double sum = 0.0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 a = normalize(polygon[i] - receiver.position);
    const Vec3 b = normalize(polygon[(i + 1) % polygon.size()] - receiver.position);
    sum += std::acos(double{dot(a, b)}) * dot(normalize(cross(a, b)), receiver.normal);
  }
  return std::abs(sum) / 2.0;
}

// The receiver lies on the floor. The neighbour stands upright facing +x at x = 0.6: it sees only 0.4 of the light.
constexpr Receiver kReceiver{{0.2f, 0.5f, 0.0f}, {0.0f, 0.0f, 1.0f}};
constexpr Receiver kNeighbour{{0.6f, 0.1f, 0.0f}, {1.0f, 0.0f, 0.0f}};

std::vector<Vec3> light_from(float x) {
  return {{x, 0.0f, kHeight}, {kSide, 0.0f, kHeight}, {kSide, kSide, kHeight}, {x, kSide, kHeight}};
}

enum class Planted { NOTHING, SOLID_ANGLE_WEIGHTS, NULL_CANDIDATES_NOT_IN_M };

/// Targets in area measure are the integrand; in solid-angle measure they leave out cos(light) / distance².
float target(const Receiver& receiver, Vec2 uv, Planted planted) {
  const Geometry g = geometry(receiver, uv);
  return planted == Planted::SOLID_ANGLE_WEIGHTS ? g.cos_receiver : g.cos_receiver * g.cos_light_over_distance_squared;
}

Reservoir<Vec2> initial(const Receiver& receiver, int M, Planted planted, Rng& rng) {
  uint64_t non_finite = 0;
  ReservoirBuilder<Vec2> builder(non_finite);
  int found = 0;
  for (int m = 0; m < M; ++m) {
    const Vec2 uv = rng.next_vec2();
    const float p_hat = target(receiver, uv, planted);
    const bool solid_angle = planted == Planted::SOLID_ANGLE_WEIGHTS;
    const float pdf =
        1.0f / (kSide * kSide) / (solid_angle ? geometry(receiver, uv).cos_light_over_distance_squared : 1.0f);
    found += p_hat > 0.0f;
    builder.add(uv, p_hat / pdf, p_hat, rng.next_float());
  }
  Reservoir<Vec2> reservoir = builder.finish(1.0f);
  reservoir.W /= static_cast<float>(planted == Planted::NULL_CANDIDATES_NOT_IN_M ? std::max(found, 1) : M);
  EXPECT_EQ(non_finite, 0u);
  return reservoir;
}

/// Estimates of the irradiance of `receivers[0]`.
Moments estimates(const std::array<Receiver, 2>& receivers, MisWeight weights, Planted planted, uint64_t seed) {
  Rng rng(seed, 0, 0, 0);
  uint64_t non_finite = 0;
  Moments result;
  for (int run = 0; run < kRuns; ++run) {
    const std::array candidates{initial(receivers[0], 2, planted, rng), initial(receivers[1], 3, planted, rng)};
    const auto p_hat = [&](size_t i, Vec2 uv) { return target(receivers[i], uv, planted); };
    const Reservoir<Vec2> merged = resample<Vec2>(candidates, p_hat, weights, rng, non_finite);
    result.add(merged.W * target(receivers[0], merged.sample, planted));
  }
  EXPECT_EQ(non_finite, 0u);
  return result;
}

constexpr std::array<MisWeight, 3> kUnbiased{MisWeight::CONTRIBUTION, MisWeight::BALANCE, MisWeight::PAIRWISE};
const double kReceiverTruth = irradiance(kReceiver, light_from(0.0f));
const double kNeighbourTruth = irradiance(kNeighbour, light_from(kNeighbour.position.x));

// Seeds 1-6; false alarm with probability kFalseAlarmRate for all six.
TEST(TwoReceivers, MeansAreTheClosedForm) {
  for (size_t i = 0; i < kUnbiased.size(); ++i) {
    const Moments one = estimates({kReceiver, kNeighbour}, kUnbiased[i], Planted::NOTHING, 1 + 2 * i);
    EXPECT_GT(mean_p_value(one, kReceiverTruth), shared_rate(6)) << i << ' ' << one.mean() << ' ' << kReceiverTruth;
    const Moments other = estimates({kNeighbour, kReceiver}, kUnbiased[i], Planted::NOTHING, 2 + 2 * i);
    EXPECT_GT(mean_p_value(other, kNeighbourTruth), shared_rate(6)) << i << ' ' << other.mean();
  }
}

TEST(TwoReceivers, PlantedBugsAreSeen) {
  for (MisWeight weights : kUnbiased) {
    for (Planted planted : {Planted::SOLID_ANGLE_WEIGHTS, Planted::NULL_CANDIDATES_NOT_IN_M})
      EXPECT_LT(mean_p_value(estimates({kReceiver, kNeighbour}, weights, planted, 7), kReceiverTruth), kFalseAlarmRate);
  }
  const Moments constant = estimates({kReceiver, kNeighbour}, MisWeight::CONSTANT, Planted::NOTHING, 8);
  EXPECT_LT(mean_p_value(constant, kReceiverTruth), kFalseAlarmRate);
  EXPECT_LT(constant.mean(), kReceiverTruth);
}

}  // namespace
}  // namespace cistern::test
