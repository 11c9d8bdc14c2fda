#include "base/frame.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "base/warp.h"

namespace cistern::test {
namespace {

void expect_orthonormal(const Frame& frame) {
  constexpr float kTolerance = 2e-6f;
  EXPECT_NEAR(length(frame.s), 1.0f, kTolerance);
  EXPECT_NEAR(length(frame.t), 1.0f, kTolerance);
  EXPECT_NEAR(dot(frame.s, frame.t), 0.0f, kTolerance);
  EXPECT_NEAR(dot(frame.s, frame.n), 0.0f, kTolerance);
  EXPECT_NEAR(dot(frame.t, frame.n), 0.0f, kTolerance);
  EXPECT_NEAR(dot(cross(frame.s, frame.t), frame.n), 1.0f, kTolerance);
}

TEST(Frame, IsRightHandedAndOrthonormal) {
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < 10000; ++i) expect_orthonormal(Frame(square_to_sphere(rng.next_vec2())));
}

TEST(Frame, PolesAreNoException) {
  expect_orthonormal(Frame(Vec3{0.0f, 0.0f, 1.0f}));
  expect_orthonormal(Frame(Vec3{0.0f, 0.0f, -1.0f}));
  expect_orthonormal(Frame(Vec3{0.0f, 0.0f, -0.0f} + Vec3{1.0f, 0.0f, 0.0f}));
  expect_orthonormal(Frame(normalize({1e-4f, 0.0f, -1.0f})));
}

TEST(Frame, LocalAndWorldAreInverse) {
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const Frame frame(square_to_sphere(rng.next_vec2()));
    const Vec3 v = square_to_sphere(rng.next_vec2());
    EXPECT_LT(length(frame.to_world(frame.to_local(v)) - v), 2e-6f);
    EXPECT_NEAR(frame.to_local(frame.n).z, 1.0f, 2e-6f);
  }
}

}  // namespace
}  // namespace cistern::test
