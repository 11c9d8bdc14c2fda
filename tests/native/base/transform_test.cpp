#include "base/transform.h"

#include <gtest/gtest.h>

#include "base/rng.h"

namespace cistern::test {
namespace {

Vec3 random_vector(Rng& rng) {
  const Vec2 xy = rng.next_vec2();
  return {2.0f * xy.x - 1.0f, 2.0f * xy.y - 1.0f, 2.0f * rng.next_float() - 1.0f};
}

/// Well-conditioned: a diagonal of at least 1.5 outweighs the rest.
Transform random_transform(Rng& rng) {
  Transform m{random_vector(rng), random_vector(rng), random_vector(rng), random_vector(rng)};
  m.row_x.x += 2.5f;
  m.row_y.y += 2.5f;
  m.row_z.z -= 2.5f;  // mirrors
  return m;
}

TEST(Transform, InverseUndoes) {
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const Transform m = random_transform(rng);
    const Vec3 p = random_vector(rng);
    EXPECT_LT(length(inverse(m).point(m.point(p)) - p), 1e-5f);
    EXPECT_LT(length(m.point(inverse(m).point(p)) - p), 1e-5f);
    EXPECT_NEAR(inverse(m).determinant() * m.determinant(), 1.0f, 1e-4f);
  }
}

TEST(Transform, NormalsStayNormal) {
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const Transform m = random_transform(rng);
    const Vec3 a = random_vector(rng), b = random_vector(rng);
    const Vec3 n = inverse(m).transposed_vector(cross(a, b));
    EXPECT_NEAR(dot(n, m.vector(a)), 0.0f, 1e-5f);
    EXPECT_NEAR(dot(n, m.vector(b)), 0.0f, 1e-5f);
    // Planted bug: mapping a normal like a vector.
    const Vec3 wrong = m.vector(cross(a, b));
    EXPECT_GT(std::abs(dot(wrong, m.vector(a))) + std::abs(dot(wrong, m.vector(b))), 1e-5f);
  }
}

TEST(Transform, ColumnsAreImagesOfTheAxes) {
  Rng rng(3, 0, 0, 0);
  const Transform m = random_transform(rng);
  EXPECT_EQ(m.column(0), m.vector({1.0f, 0.0f, 0.0f}));
  EXPECT_EQ(m.column(1), m.vector({0.0f, 1.0f, 0.0f}));
  EXPECT_EQ(m.column(2), m.vector({0.0f, 0.0f, 1.0f}));
  EXPECT_EQ(Transform{}.point({1.0f, 2.0f, 3.0f}), (Vec3{1.0f, 2.0f, 3.0f}));
}

}  // namespace
}  // namespace cistern::test
