#include "scene/corner_tangents.h"

#include <gtest/gtest.h>

#include <numbers>

#include "scene/smooth_normals.h"
#include "shading/nodes_scene.h"

namespace cistern {
namespace {

constexpr uint32_t kTriangles = 4;
const std::array<Vec2, kTriangles> kRim{Vec2{1, 0}, Vec2{0, 1}, Vec2{-1, 0}, Vec2{0, -1}};

/// A pyramid of four triangles about a smooth point, whose map is what `to_map` makes of their places from above; its
/// triangles have points of their own.
Mesh pyramid(Vec2 (*to_map)(Vec2), bool is_smooth = true) {
  Mesh mesh;
  std::vector<float> map;
  for (uint32_t t = 0; t < kTriangles; ++t) {
    const std::array<Vec2, 3> places{Vec2{}, kRim[t], kRim[(t + 1) % kTriangles]};
    for (const Vec2 p : places) {
      mesh.positions.push_back({p.x, p.y, p == Vec2{} ? 1.0f : 0.0f});
      map.insert(map.end(), {to_map(p).x, to_map(p).y});
    }
    mesh.vertices.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  mesh.attributes = {test::make_attribute("UV", 2, map)};
  if (is_smooth) {
    mesh.normals_domain = Domain::POINT;
    for (const Vec3& p : mesh.positions) mesh.normals.push_back(encode_octahedral(normalize(p)));
  }
  return mesh;
}

Vec2 as_it_lies(Vec2 p) { return p; }
Vec2 folded(Vec2 p) { return {std::abs(p.x), p.y}; }

void expect_near(Vec3 found, Vec3 expected, float tolerance = 2e-4f) {
  EXPECT_NEAR(found.x, expected.x, tolerance);
  EXPECT_NEAR(found.y, expected.y, tolerance);
  EXPECT_NEAR(found.z, expected.z, tolerance);
}

Vec3 at_corner(const CornerTangents& tangents, uint32_t t, size_t j) {
  return decode_octahedral(tangents.directions[t][j]);
}

TEST(CornerTangents, AreOneAtASmoothPointThoughTrianglesShareNoPoints) {
  const CornerTangents tangents = corner_tangents(pyramid(as_it_lies), 0);
  for (uint32_t t = 0; t < kTriangles; ++t) {
    expect_near(at_corner(tangents, t, 0), {1, 0, 0});
    EXPECT_EQ(tangents.handedness(t, {0.3f, 0.3f}), 1.0f);
    for (size_t j = 1; j < 3; ++j) {
      const Vec2 rim = kRim[(t + j - 1) % kTriangles];
      EXPECT_NEAR(dot(at_corner(tangents, t, j), Vec3{rim.x, rim.y, 0.0f}), 0.0f, 2e-4f) << "in the normal's plane";
    }
  }
}

TEST(CornerTangents, OfFlatTrianglesAreTheirOwn) {
  const CornerTangents tangents = corner_tangents(pyramid(as_it_lies, false), 0);
  for (uint32_t t = 0; t < kTriangles; ++t)
    for (size_t j = 0; j < 3; ++j)
      expect_near(at_corner(tangents, t, j), normalize(Vec3{1.0f, 0.0f, t == 0 || t == 3 ? -1.0f : 1.0f}));
}

TEST(CornerTangents, AreApartWhereTheMapIsFolded) {
  const CornerTangents tangents = corner_tangents(pyramid(folded), 0);
  for (uint32_t t = 0; t < kTriangles; ++t) {
    const bool is_mirrored = t == 1 || t == 2;
    expect_near(at_corner(tangents, t, 0), {is_mirrored ? -1.0f : 1.0f, 0, 0});
    EXPECT_EQ(tangents.handedness(t, {0.3f, 0.3f}), is_mirrored ? -1.0f : 1.0f);
  }
}

TEST(CornerTangents, WeighByAngle) {
  Mesh mesh;  // two triangles on the ground about an edge, of 90 and 30 degrees there, whose maps are turned apart
  const float angle = std::numbers::pi_v<float> / 6.0f;
  mesh.positions = {{0, 0, 0}, {0, -1, 0}, {1, 0, 0}, {std::cos(angle), std::sin(angle), 0}};
  mesh.vertices = {{0, 1, 2}, {0, 2, 3}};
  mesh.corners = {{0, 1, 2}, {3, 4, 5}};
  mesh.corner_count = 6;
  const float turn = 0.4f, c = std::cos(turn), s = std::sin(turn);
  const auto turned = [&](Vec3 p) { return Vec2{c * p.x + s * p.y, -s * p.x + c * p.y}; };  // u runs along (c, s)
  std::vector<float> map{0, 0, 0, -1, 1, 0};
  for (const uint32_t v : mesh.vertices[1])
    map.insert(map.end(), {turned(mesh.positions[v]).x, turned(mesh.positions[v]).y});
  mesh.attributes = {test::make_attribute("UV", 2, map)};
  mesh.attributes[0].domain = Domain::CORNER;
  mesh.normals_domain = Domain::POINT;
  mesh.normals.assign(4, encode_octahedral({0, 0, 1}));
  const CornerTangents apart = corner_tangents(mesh, 0);  // at the edge's end the map differs: other vertices
  expect_near(at_corner(apart, 0, 2), {1, 0, 0});
  expect_near(at_corner(apart, 1, 1), {c, s, 0});
  // What they share is the first point alone, and no edge: each keeps its own there, too.
  expect_near(at_corner(apart, 0, 0), {1, 0, 0});
  expect_near(at_corner(apart, 1, 0), {c, s, 0});

  const std::vector<float> joined{0, 0, 0, -1, 1, 0, 0, 0, 1, 0, map[10], map[11]};
  mesh.attributes[0] = test::make_attribute("UV", 2, joined);
  mesh.attributes[0].domain = Domain::CORNER;
  const Vec2 end{map[10], map[11]};
  // dP/du of the second triangle, whose edges from the first point are (1, 0) at uv (1, 0) and `end`'s.
  const Vec3 own = normalize(end.y * Vec3{1, 0, 0});
  const CornerTangents together = corner_tangents(mesh, 0);
  expect_near(at_corner(together, 1, 0), normalize(0.5f * std::numbers::pi_v<float> * Vec3{1, 0, 0} + angle * own));
  EXPECT_EQ(together.directions[0][0], together.directions[1][0]);
}

TEST(CornerTangents, WithoutAreaTakeTheirNeighboursOrAFixedOne) {
  Mesh mesh = pyramid(as_it_lies);
  std::vector<float> map(mesh.attributes[0].values.get(), mesh.attributes[0].values.get() + 24);
  // The map of the second triangle is a line: both its edges at the top are where the neighbours have them.
  const std::array<Vec2, 4> rim{Vec2{1, 0}, Vec2{0, 1}, Vec2{0, 2}, Vec2{1, -1}};
  for (uint32_t t = 0; t < kTriangles; ++t)
    for (uint32_t j = 1; j < 3; ++j) {
      map[6 * t + 2 * j] = rim[(t + j - 1) % 4].x;
      map[6 * t + 2 * j + 1] = rim[(t + j - 1) % 4].y;
    }
  mesh.attributes = {test::make_attribute("UV", 2, map)};
  const CornerTangents some = corner_tangents(mesh, 0);
  EXPECT_EQ(some.directions[1][0], some.directions[0][0]);
  EXPECT_EQ(some.handedness(1, {}), some.handedness(0, {}));

  mesh.attributes = {test::make_attribute("UV", 2, std::vector<float>(24, 0.25f))};
  const CornerTangents none = corner_tangents(mesh, 0);
  expect_near(at_corner(none, 2, 1), {1, 0, 0});
  EXPECT_EQ(none.handedness(2, {0.2f, 0.2f}), -1.0f);
}

/// At the pole, whose longitude is 0, a step of half a turn goes back (as in Cycles): that triangle is mirrored.
TEST(CornerTangents, WithoutAMapGoAroundTheObject) {
  Mesh mesh = pyramid(as_it_lies);
  mesh.attributes.clear();
  const CornerTangents tangents = corner_tangents(mesh, kNoUvMap);
  for (uint32_t t = 0; t < kTriangles; ++t) {
    const float sign = tangents.handedness(t, {0.3f, 0.3f});
    EXPECT_EQ(sign, t == 0 ? -1.0f : 1.0f) << t;  // from longitude 0.25 to 0.5
    expect_near(at_corner(tangents, t, 1), sign * Vec3{-kRim[t].y, kRim[t].x, 0.0f});
  }
}

TEST(CornerTangents, NumbersThatAreNoneAreNoArea) {
  Mesh mesh = pyramid(as_it_lies);
  std::vector<float> map(24, std::numeric_limits<float>::quiet_NaN());
  mesh.attributes = {test::make_attribute("UV", 2, map)};
  expect_near(at_corner(corner_tangents(mesh, 0), 0, 0), {1, 0, 0});
}

TEST(CornerTangents, InterpolateWithoutNormalising) {
  CornerTangents tangents;
  tangents.directions = {{encode_octahedral({1, 0, 0}), encode_octahedral({0, 1, 0}), encode_octahedral({0, 0, 1})}};
  tangents.mirrored = {4};
  expect_near(tangents.tangent(0, {0.25f, 0.5f}), {0.25f, 0.25f, 0.5f});
  EXPECT_NEAR(tangents.handedness(0, {0.25f, 0.5f}), 0.0f, 1e-6f);
}

/// Stacks of equal triangles would take the square of their number with a search for the opposite of each edge.
TEST(CornerTangents, StacksOfTrianglesTakeLittleTime) {
  constexpr uint32_t kCount = 200000;
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.vertices.assign(kCount, {0, 1, 2});
  mesh.attributes = {test::make_attribute("UV", 2, {0, 0, 1, 0, 0, 1})};
  const CornerTangents tangents = corner_tangents(mesh, 0);
  expect_near(at_corner(tangents, kCount - 1, 0), {1, 0, 0});
}

}  // namespace
}  // namespace cistern
