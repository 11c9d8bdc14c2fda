#include "shading/nodes_color.h"

#include <gtest/gtest.h>

#include <array>

#include "base/rng.h"

namespace cistern {
namespace {

void expect_near(Vec3 found, Vec3 expected, float tolerance = 2e-6f) {
  EXPECT_NEAR(found.x, expected.x, tolerance);
  EXPECT_NEAR(found.y, expected.y, tolerance);
  EXPECT_NEAR(found.z, expected.z, tolerance);
}

TEST(NodesColor, BlendsOfKnownColours) {
  const Vec3 a{0.2f, 0.6f, 0.9f}, b{0.5f, 0.25f, 0.4f};
  struct Case {
    int blend;
    Vec3 full;  // at factor 1
  };
  const Case cases[] = {
      {0, b},
      {1, {0.2f, 0.25f, 0.4f}},
      {2, {0.1f, 0.15f, 0.36f}},
      {3, {0.0f, 0.0f, 0.75f}},
      {4, {0.5f, 0.6f, 0.9f}},
      {5, {0.6f, 0.7f, 0.94f}},
      {6, {0.4f, 0.8f, 1.0f}},
      {7, {0.7f, 0.85f, 1.3f}},
      {8, {0.2f, 0.4f, 0.88f}},
      {9, {0.2f, 0.48f, 0.882f}},
      {10, {0.2f, 0.1f, 0.7f}},
      {11, {0.3f, 0.35f, 0.5f}},
      {12, {0.5f, 0.55f, 0.58f}},
      {13, {-0.3f, 0.35f, 0.5f}},
      {14, {0.4f, 2.4f, 2.25f}},
      {18, {0.2f / 0.9f * 0.5f, 0.6f / 0.9f * 0.5f, 0.5f}},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.blend);
    expect_near(mix_color_node(c.blend, 1.0f, a, b), c.full);
    expect_near(mix_color_node(c.blend, 0.0f, a, b), a);
  }
}

TEST(NodesColor, HueSaturationAndColourBlendsExchangeTheirComponent) {
  const Vec3 a{0.2f, 0.6f, 0.9f}, b{0.5f, 0.25f, 0.4f};
  const Vec3 hsv_a = rgb_to_hsv(a), hsv_b = rgb_to_hsv(b);
  expect_near(rgb_to_hsv(mix_color_node(15, 1.0f, a, b)), {hsv_b.x, hsv_a.y, hsv_a.z}, 1e-5f);
  expect_near(rgb_to_hsv(mix_color_node(16, 1.0f, a, b)), {hsv_a.x, hsv_b.y, hsv_a.z}, 1e-5f);
  expect_near(rgb_to_hsv(mix_color_node(17, 1.0f, a, b)), {hsv_b.x, hsv_b.y, hsv_a.z}, 1e-5f);
  const Vec3 grey{0.5f, 0.5f, 0.5f};
  EXPECT_EQ(mix_color_node(15, 1.0f, a, grey), a);
  EXPECT_EQ(mix_color_node(17, 1.0f, a, grey), a);
}

TEST(NodesColor, HsvAndHslRoundTrip) {
  Rng rng(7, 0, 0, 0);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 c{rng.next_float(), rng.next_float(), rng.next_float()};
    expect_near(hsv_to_rgb(rgb_to_hsv(c)), c, 1e-5f);
    expect_near(hsl_to_rgb(rgb_to_hsl(c)), c, 1e-5f);
  }
  expect_near(rgb_to_hsv({0.5f, 0.25f, 0.25f}), {0.0f, 0.5f, 0.5f});
  expect_near(rgb_to_hsv({0.0f, 0.0f, 1.0f}), {2.0f / 3.0f, 1.0f, 1.0f});
  expect_near(rgb_to_hsl({1.0f, 0.5f, 0.5f}), {0.0f, 1.0f, 0.75f});
}

TEST(NodesColor, SimpleNodes) {
  expect_near(invert_node(1.0f, {0.2f, 0.5f, 1.0f}), {0.8f, 0.5f, 0.0f});
  expect_near(invert_node(0.25f, {0.2f, 0.5f, 1.0f}), {0.35f, 0.5f, 0.75f});
  expect_near(gamma_node({0.25f, -1.0f, 4.0f}, 0.5f), {0.5f, -1.0f, 2.0f});
  expect_near(gamma_node({0.25f, -1.0f, 4.0f}, 0.0f), {1.0f, 1.0f, 1.0f});
  expect_near(bright_contrast_node({0.5f, 0.0f, 1.0f}, 0.1f, 1.0f), {0.6f, 0.0f, 1.6f});
  const Vec3 c{0.2f, 0.6f, 0.9f};
  expect_near(hue_saturation_node(c, 0.5f, 1.0f, 1.0f, 1.0f), c);
  expect_near(hue_saturation_node({1.0f, 0.0f, 0.0f}, 0.5f + 1.0f / 3.0f, 1.0f, 0.5f, 1.0f), {0.0f, 0.5f, 0.0f});
  expect_near(hue_saturation_node(c, 0.5f, 0.0f, 1.0f, 1.0f), {0.9f, 0.9f, 0.9f});
  expect_near(hue_saturation_node(c, 0.9f, 0.3f, 2.0f, 0.0f), c);
}

TEST(NodesColor, TablesInterpolateStepAndExtrapolate) {
  std::array<Vec3, 257> table;
  std::array<float, 257> alpha;
  for (size_t i = 0; i < table.size(); ++i) {
    const float x = static_cast<float>(i) / 256.0f;
    table[i] = {2.0f * x, x * x, 1.0f - x};
    alpha[i] = x;
  }
  expect_near(ramp_lookup(table, 0.25f, false), {0.5f, 0.0625f, 0.75f});
  EXPECT_NEAR(ramp_lookup(alpha, 0.3333f, false), 0.3333f, 1e-6f);
  EXPECT_EQ(ramp_lookup(alpha, 0.3333f, true), 85.0f / 256.0f);
  EXPECT_EQ(ramp_lookup(alpha, 7.0f, false), 1.0f);
  EXPECT_EQ(ramp_lookup(alpha, -7.0f, false), 0.0f);
  EXPECT_EQ(ramp_lookup(alpha, NAN, false), 0.0f);
  // min x = 1, max x = 3: 2 is the middle; outside the end slopes go on
  expect_near(curve_lookup_node(table, 1.0f, {2.0f, 2.0f, 2.0f}, 1.0f, 3.0f), {1.0f, 0.25f, 0.5f}, 1e-5f);
  expect_near(curve_lookup_node(table, 1.0f, {5.0f, 0.0f, 5.0f}, 1.0f, 3.0f), {4.0f, -0.5f / 256.0f, -1.0f}, 1e-4f);
  expect_near(curve_lookup_node(table, 0.0f, {5.0f, 0.0f, 5.0f}, 1.0f, 3.0f), {5.0f, 0.0f, 5.0f}, 1e-5f);
}

}  // namespace
}  // namespace cistern
