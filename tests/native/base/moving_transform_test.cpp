#include "base/moving_transform.h"

#include <gtest/gtest.h>

#include "base/rng.h"

namespace cistern::test {
namespace {

Transform turned_about_z(float angle) {
  const float c = std::cos(angle), s = std::sin(angle);
  return {{c, -s, 0}, {s, c, 0}, {0, 0, 1}, {}};
}

void expect_near(const Transform& a, const Transform& b, float tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_LT(length(a.column(i) - b.column(i)), tolerance) << i;
  EXPECT_LT(length(a.translation - b.translation), tolerance);
}

TEST(MovingTransform, EndsAreThoseGiven) {
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < 50; ++i) {
    const auto row = [&] { return Vec3{rng.next_float() - 0.5f, rng.next_float() - 0.5f, rng.next_float() - 0.5f}; };
    const Transform a{row(), row(), row(), row()}, b{row(), row(), row(), row()};
    const MovingTransform moving(a, b);
    EXPECT_EQ(moving.at(0.0f), a);
    EXPECT_EQ(moving.at(1.0f), b);
    expect_near(moving.at(1e-4f), a, 2e-3f);  // without a jump
    expect_near(moving.at(1.0f - 1e-4f), b, 2e-3f);
  }
}

/// Were matrices mixed number by number, half a turn would pass through what is flat.
TEST(MovingTransform, TurnsAtEvenSpeed) {
  for (const float angle : {0.3f, 1.5f, 3.0f}) {
    const MovingTransform moving(turned_about_z(0.2f), turned_about_z(0.2f + angle));
    for (const float t : {0.1f, 0.25f, 0.5f, 0.9f}) expect_near(moving.at(t), turned_about_z(0.2f + t * angle), 1e-5f);
  }
}

TEST(MovingTransform, StretchesAndMovesStraight) {
  const Transform small{{1, 0, 0}, {0, 2, 0}, {0, 0, -1}, {1, 2, 3}},
      large{{3, 0, 0}, {0, 2, 0}, {0, 0, -5}, {5, 2, 1}};
  expect_near(MovingTransform(small, large).at(0.25f), {{1.5f, 0, 0}, {0, 2, 0}, {0, 0, -2}, {2, 2, 2.5f}}, 1e-5f);
}

/// A turn of what is flat would be of a rotation that it does not have.
TEST(MovingTransform, WhatIsFlatOrMirroredAtAnEndGoesStraight) {
  const Transform turned = turned_about_z(0.3f), nothing{{}, {}, {}, {1, 2, 3}};
  const Transform mirrored = turned * Transform{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {}};
  const auto at = [](Vec3 a, Vec3 b, float t) { return a + t * (b - a); };
  for (const Transform& end : {nothing, mirrored})
    for (const float t : {0.25f, 0.8f}) {
      const Transform expected{at(turned.row_x, end.row_x, t), at(turned.row_y, end.row_y, t),
                               at(turned.row_z, end.row_z, t), at(turned.translation, end.translation, t)};
      expect_near(MovingTransform(turned, end).at(t), expected, 1e-6f);
      expect_near(MovingTransform(end, turned).at(1.0f - t), expected, 1e-6f);
    }
}

TEST(MovingTransform, WhatRestsRests) {
  const Transform uneven = turned_about_z(0.7f) * Transform{{1, 0.2f, 0}, {0, 0.01f, 0}, {0, 0, 300}, {4, 5, 6}};
  expect_near(MovingTransform(uneven, uneven).at(0.3f), uneven, 1e-4f);
}

}  // namespace
}  // namespace cistern::test
