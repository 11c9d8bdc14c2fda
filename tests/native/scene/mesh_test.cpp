#include "scene/mesh.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "base/warp.h"

namespace cistern::test {
namespace {

/// sin of the angle between two unit vectors.
float deviation(Vec3 a, Vec3 b) { return length(cross(a, b)); }

TEST(Octahedral, RoundTripIsAccurate) {
  constexpr float kTolerance = 8e-5f;  // half a step of 1/32767 in two axes, stretched by sqrt(3): 6.5e-5
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < 100000; ++i) {
    const Vec3 n = square_to_sphere(rng.next_vec2());
    const Vec3 decoded = decode_octahedral(encode_octahedral(n));
    ASSERT_LT(deviation(n, decoded), kTolerance);
    ASSERT_GT(dot(n, decoded), 0.0f);
    ASSERT_NEAR(length(decoded), 1.0f, 1e-6f);
  }
}

TEST(Octahedral, AxesAndDiagonalsAreExact) {
  for (const float sign : {-1.0f, 1.0f}) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 n{axis == 0 ? sign : 0.0f, axis == 1 ? sign : 0.0f, axis == 2 ? sign : 0.0f};
      EXPECT_EQ(decode_octahedral(encode_octahedral(n)), n);
    }
  }
}

TEST(Octahedral, EncodingIsStable) {
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const uint32_t code = encode_octahedral(square_to_sphere(rng.next_vec2()));
    const Vec3 decoded = decode_octahedral(code);
    EXPECT_LT(deviation(decode_octahedral(encode_octahedral(decoded)), decoded), 1e-6f);
  }
}

TEST(Octahedral, PlantedBugOfUnmirroredLowerHalfIsSeen) {
  // Forgetting to mirror the lower half outwards maps it onto the upper one.
  const Vec3 n = normalize({0.3f, 0.2f, -0.8f});
  const Vec3 wrong = decode_octahedral(encode_octahedral({n.x, n.y, -n.z}));
  EXPECT_GT(deviation(n, wrong), 0.1f);
}

TEST(Mesh, FindsAttributesByName) {
  Mesh mesh;
  mesh.attributes = {{"UVMap", Domain::CORNER, 2, nullptr, 0}, {"Color", Domain::POINT, 4, nullptr, 0}};
  EXPECT_EQ(mesh.find_attribute("UVMap"), 0);
  EXPECT_EQ(mesh.find_attribute("Color"), 1);
  EXPECT_EQ(mesh.find_attribute("color"), -1);
}

TEST(Mesh, MemoryCountsEverything) {
  Mesh mesh;
  mesh.positions.resize(100);
  mesh.vertices.resize(50);
  mesh.corner_count = 150;
  mesh.attributes = {{"UVMap", Domain::CORNER, 2, nullptr, 0}, {"Color", Domain::POINT, 4, nullptr, 0}};
  EXPECT_EQ(memory_bytes(mesh), 100u * 12u + 50u * 12u + 150u * 8u + 100u * 16u);
}

}  // namespace
}  // namespace cistern::test
