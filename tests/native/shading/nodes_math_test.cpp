#include "shading/nodes_math.h"

#include <gtest/gtest.h>

// Expected values follow from the operations' definitions in Blender's manual.

namespace cistern {
namespace {

struct MathCase {
  int operation;
  float a, b, c, expected;
};

TEST(NodesMath, EveryIntegerOperationHasItsDefinition) {
  constexpr float kMost = 2147483648.0f;
  const MathCase cases[] = {
      {0, 2.9f, 3.9f, 0.0f, 5.0f},    {1, 2.0f, 3.0f, 0.0f, -1.0f},    {2, -2.0f, 3.0f, 0.0f, -6.0f},
      {3, -7.0f, 2.0f, 0.0f, -3.0f},  {3, 7.0f, 0.0f, 0.0f, 0.0f},     {4, 2.0f, 3.0f, 4.0f, 10.0f},
      {5, -2.0f, 0.0f, 0.0f, 2.0f},   {6, -2.0f, 0.0f, 0.0f, 2.0f},    {7, -2.0f, 5.0f, 0.0f, -32.0f},
      {7, -1.0f, -3.0f, 0.0f, -1.0f}, {7, 2.0f, -1.0f, 0.0f, 0.0f},    {7, 0.0f, 0.0f, 0.0f, 1.0f},
      {8, 2.0f, 3.0f, 0.0f, 2.0f},    {9, 2.0f, 3.0f, 0.0f, 3.0f},     {10, -5.0f, 0.0f, 0.0f, -1.0f},
      {11, 5.0f, 2.0f, 0.0f, 3.0f},   {11, -5.0f, 2.0f, 0.0f, -3.0f},  {11, -5.0f, -3.0f, 0.0f, 2.0f},
      {11, 5.0f, 0.0f, 0.0f, 0.0f},   {12, -7.0f, 2.0f, 0.0f, -4.0f},  {12, 7.0f, 2.0f, 0.0f, 3.0f},
      {13, -7.0f, 2.0f, 0.0f, -3.0f}, {13, 7.0f, 2.0f, 0.0f, 4.0f},    {13, 7.0f, 0.0f, 0.0f, 0.0f},
      {14, -5.0f, 3.0f, 0.0f, 1.0f},  {14, 5.0f, -3.0f, 0.0f, -1.0f},  {15, -5.0f, 3.0f, 0.0f, -2.0f},
      {15, 5.0f, 0.0f, 0.0f, 0.0f},   {16, 12.0f, -18.0f, 0.0f, 6.0f}, {17, -4.0f, 6.0f, 0.0f, 12.0f},
      {17, 0.0f, 6.0f, 0.0f, 0.0f},   {0, kMost, 1.0f, 0.0f, -kMost},  {0, std::nanf(""), 1.0f, 0.0f, 1.0f},
  };
  for (const MathCase& c : cases)
    EXPECT_EQ(integer_math_node(c.operation, c.a, c.b, c.c), c.expected) << "operation " << c.operation;
}

TEST(NodesMath, EveryOperationHasItsDefinition) {
  const MathCase cases[] = {
      {0, 2.0f, 3.0f, 0.0f, 5.0f},        {1, 2.0f, 3.0f, 0.0f, -1.0f},       {2, 2.0f, 3.0f, 0.0f, 6.0f},
      {3, 3.0f, 2.0f, 0.0f, 1.5f},        {3, 3.0f, 0.0f, 0.0f, 0.0f},        {4, 2.0f, 3.0f, 4.0f, 10.0f},
      {5, 2.0f, 3.0f, 0.0f, 8.0f},        {5, -2.0f, 3.0f, 0.0f, -8.0f},      {5, -2.0f, 0.5f, 0.0f, 0.0f},
      {5, 0.0f, 0.0f, 0.0f, 1.0f},        {6, 8.0f, 2.0f, 0.0f, 3.0f},        {6, -1.0f, 2.0f, 0.0f, 0.0f},
      {7, 9.0f, 0.0f, 0.0f, 3.0f},        {7, -9.0f, 0.0f, 0.0f, 0.0f},       {8, 4.0f, 0.0f, 0.0f, 0.5f},
      {9, -2.0f, 0.0f, 0.0f, 2.0f},       {10, 0.0f, 0.0f, 0.0f, 1.0f},       {11, 2.0f, 3.0f, 0.0f, 2.0f},
      {12, 2.0f, 3.0f, 0.0f, 3.0f},       {13, 2.0f, 3.0f, 0.0f, 1.0f},       {14, 2.0f, 3.0f, 0.0f, 0.0f},
      {15, -2.0f, 0.0f, 0.0f, -1.0f},     {15, 0.0f, 0.0f, 0.0f, 0.0f},       {16, 1.0f, 1.4f, 0.5f, 1.0f},
      {16, 1.0f, 1.6f, 0.5f, 0.0f},       {17, 1.0f, 1.0f, 0.6f, 0.9f},       {18, 1.0f, 1.0f, 0.6f, 1.1f},
      {19, 1.5f, 0.0f, 0.0f, 2.0f},       {19, -1.5f, 0.0f, 0.0f, -1.0f},     {20, -1.5f, 0.0f, 0.0f, -2.0f},
      {21, -1.5f, 0.0f, 0.0f, -1.0f},     {22, -1.5f, 0.0f, 0.0f, -1.0f},     {23, -1.25f, 0.0f, 0.0f, 0.75f},
      {24, -5.0f, 3.0f, 0.0f, -2.0f},     {25, -5.0f, 3.0f, 0.0f, 1.0f},      {26, 5.5f, 2.0f, 0.0f, 1.5f},
      {26, 5.5f, 2.0f, 2.0f, 2.0f},       {27, 5.5f, 2.0f, 0.0f, 4.0f},       {28, 3.5f, 2.0f, 0.0f, 0.5f},
      {29, kPi / 2.0f, 0.0f, 0.0f, 1.0f}, {30, 0.0f, 0.0f, 0.0f, 1.0f},       {31, kPi / 4.0f, 0.0f, 0.0f, 1.0f},
      {32, 2.0f, 0.0f, 0.0f, kPi / 2.0f}, {33, 2.0f, 0.0f, 0.0f, 0.0f},       {34, 1.0f, 0.0f, 0.0f, kPi / 4.0f},
      {35, 0.0f, 0.0f, 0.0f, 0.0f},       {35, 1.0f, 0.0f, 0.0f, kPi / 2.0f}, {36, 0.0f, 0.0f, 0.0f, 0.0f},
      {37, 0.0f, 0.0f, 0.0f, 1.0f},       {38, 100.0f, 0.0f, 0.0f, 1.0f},     {39, 180.0f, 0.0f, 0.0f, kPi},
      {40, kPi, 0.0f, 0.0f, 180.0f},
  };
  for (const MathCase& c : cases)
    EXPECT_NEAR(math_node(c.operation, c.a, c.b, c.c), c.expected, 2e-5f * (1.0f + std::abs(c.expected)))
        << "operation " << c.operation;
}

struct VectorCase {
  int operation;
  Vec3 expected;
};

TEST(NodesMath, EveryVectorOperationHasItsDefinition) {
  const Vec3 a{1.0f, -2.5f, 3.0f}, b{2.0f, 0.5f, 0.0f}, c{-1.0f, 1.0f, 1.0f};
  const float r = std::sqrt(4.25f);
  const Vec3 n{2.0f / r, 0.5f / r, 0.0f};
  const float an = dot(a, n);
  const VectorCase cases[] = {
      {0, {3.0f, -2.0f, 3.0f}},
      {1, {-1.0f, -3.0f, 3.0f}},
      {2, {2.0f, -1.25f, 0.0f}},
      {3, {0.5f, -5.0f, 0.0f}},
      {4, {1.0f, -0.25f, 1.0f}},
      {5, {-1.5f, 6.0f, 5.5f}},
      {6, {0.75f / 4.25f * 2.0f, 0.75f / 4.25f * 0.5f, 0.0f}},
      {7, {1.0f - 2.0f * an * n.x, -2.5f - 2.0f * an * n.y, 3.0f}},
      {9, {1.0f, -2.5f, 3.0f}},
      {10, {1.5f, -3.75f, 4.5f}},
      {11, normalize(a)},
      {12, {1.0f, 2.5f, 3.0f}},
      {13, {1.0f, -2.5f, 0.0f}},
      {14, {2.0f, 0.5f, 3.0f}},
      {15, {1.0f, -3.0f, 3.0f}},
      {16, {1.0f, -2.0f, 3.0f}},
      {17, {0.0f, 0.5f, 0.0f}},
      {18, {1.0f, 0.0f, 0.0f}},
      {19, {1.0f, 1.0f, 1.0f}},
      {20, {0.0f, -2.5f, 0.0f}},
      {21, {std::sin(1.0f), std::sin(-2.5f), std::sin(3.0f)}},
      {22, {std::cos(1.0f), std::cos(-2.5f), std::cos(3.0f)}},
      {23, {std::tan(1.0f), std::tan(-2.5f), std::tan(3.0f)}},
      {24, {1.0f, 0.0f, 1.0f}},
      {25, {1.0f, -1.0f, 1.0f}},
  };
  for (const VectorCase& v : cases) {
    const Vec3 found = vector_math_node(v.operation, a, b, c, 1.5f);
    EXPECT_LT(length(found - v.expected), 1e-5f)
        << "operation " << v.operation << ": " << found.x << " " << found.y << " " << found.z;
  }
  EXPECT_FLOAT_EQ(vector_math_value_node(0, a, b), 0.75f);
  EXPECT_FLOAT_EQ(vector_math_value_node(1, a, b), std::sqrt(1.0f + 9.0f + 9.0f));
  EXPECT_FLOAT_EQ(vector_math_value_node(2, b, a), r);
}

TEST(NodesMath, RefractionBendsBySnell) {
  // 30 degrees into a medium of index 1.5: sin t = 0.5 / 1.5
  const Vec3 incident{0.5f, 0.0f, -std::sqrt(0.75f)};
  const Vec3 t = vector_math_node(8, incident, {0.0f, 0.0f, 1.0f}, {}, 1.0f / 1.5f);
  EXPECT_NEAR(t.x, 1.0f / 3.0f, 1e-6f);
  EXPECT_NEAR(t.z, -std::sqrt(8.0f / 9.0f), 1e-6f);
  EXPECT_EQ(vector_math_node(8, incident, {0.0f, 0.0f, 1.0f}, {}, 3.0f), Vec3{});  // total internal reflection
}

TEST(NodesMath, MapRange) {
  EXPECT_FLOAT_EQ(map_range_node({0.25f, 0.0f, 1.0f, 10.0f, 20.0f, 0.0f}, 0, false), 12.5f);
  EXPECT_FLOAT_EQ(map_range_node({2.0f, 0.0f, 1.0f, 20.0f, 10.0f, 0.0f}, 0, true), 10.0f);  // clamps inverted ends
  EXPECT_FLOAT_EQ(map_range_node({2.0f, 0.0f, 1.0f, 10.0f, 20.0f, 0.0f}, 0, false), 30.0f);
  EXPECT_FLOAT_EQ(map_range_node({0.5f, 1.0f, 1.0f, 10.0f, 20.0f, 0.0f}, 0, false), 0.0f);  // empty range
  EXPECT_FLOAT_EQ(map_range_node({0.6f, 0.0f, 1.0f, 0.0f, 1.0f, 4.0f}, 1, false), 0.75f);   // floor(3) / 4
  EXPECT_FLOAT_EQ(map_range_node({0.25f, 0.0f, 1.0f, 0.0f, 1.0f, 0.0f}, 2, false), 0.15625f);
  EXPECT_FLOAT_EQ(map_range_node({0.25f, 1.0f, 0.0f, 0.0f, 1.0f, 0.0f}, 2, false), 0.84375f);
  EXPECT_FLOAT_EQ(map_range_node({0.25f, 0.0f, 1.0f, 0.0f, 1.0f, 0.0f}, 3, false), 0.103515625f);
  EXPECT_FLOAT_EQ(clamp_node(5.0f, 3.0f, 1.0f, 1), 3.0f);
  EXPECT_FLOAT_EQ(clamp_node(5.0f, 0.0f, 1.0f, 0), 1.0f);
}

}  // namespace
}  // namespace cistern
