#include "shading/nodes_rays.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "shading/material.h"
#include "shading/nodes_scene.h"
#include "shading/program_builder.h"

namespace cistern {
namespace {

using test::ProgramBuilder;

/// The cube [0, 1]^3, faces outwards.
std::shared_ptr<Mesh> make_cube() {
  auto mesh = std::make_shared<Mesh>();
  mesh->name = "cube";
  for (int i = 0; i < 8; ++i)
    mesh->positions.push_back(
        {static_cast<float>(i & 1), static_cast<float>(i >> 1 & 1), static_cast<float>(i >> 2 & 1)});
  mesh->vertices = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const Vec3 p : mesh->positions) mesh->bounds.extend(p);
  return mesh;
}

/// A cube whose material emits what `write` makes.
struct CubeScene {
  std::shared_ptr<Scene> scene;
  std::shared_ptr<const Accel> accel;

  template <typename Write>
  explicit CubeScene(Write write, bool emits = true) {
    ProgramBuilder b;
    const Operand value = write(b);
    b.add(
        emits ? Op::CLOSURE_EMISSION : Op::CLOSURE_TRANSPARENT,
        emits ? std::vector<Operand>{b.constant(1), value, b.constant(1)} : std::vector<Operand>{b.constant(1), value});
    finish_program(b.program, 0);
    scene = std::make_shared<Scene>(test::make_scene(make_cube(), {}, b.program));
    accel = Accel::build(scene);
  }
  /// Where the ray from there along this direction meets the cube.
  SurfacePoint at(Vec3 origin, Vec3 direction) const {
    const Ray ray{origin, normalize(direction)};
    return make_surface_point(*scene, ray, accel->intersect(ray, kVisibleToCamera).value());
  }
  Rgb value(const SurfacePoint& point) const { return evaluate_emission(*scene, point, {}, accel.get()); }
};

Operand occlusion(ProgramBuilder& b, Operand distance, std::initializer_list<int32_t> parameters) {
  const Operand part = b.add(Op::AMBIENT_OCCLUSION, {distance, b.add(Op::NORMAL, {})}, parameters);
  return b.add(Op::BROADCAST, {part});
}

auto occluded_from(float distance, int rays, bool is_inside, bool is_local) {
  return [=](ProgramBuilder& b) { return occlusion(b, b.constant(distance), {rays, is_inside, is_local}); };
}
auto bevelled(float radius, int probes) {
  return [=](ProgramBuilder& b) { return b.add(Op::BEVEL, {b.constant(radius), b.add(Op::NORMAL, {})}, {probes}); };
}

const Vec3 kAbove{0.37f, 0.61f, 2.0f}, kDown{0.1f, 0.05f, -1.0f};

/// inf - inf.
Operand not_a_number(ProgramBuilder& b) {
  constexpr int kMultiply = 2, kSubtract = 1;
  const Operand large = b.constant(3e38f), zero = b.constant(0);
  const Operand infinite = b.add(Op::MATH, {large, large, zero}, {kMultiply, 0});
  return b.add(Op::MATH, {infinite, infinite, zero}, {kSubtract, 0});
}

TEST(RayNodes, AClosedBoxIsClosedInsideAndOpenOutside) {
  for (const bool is_local : {false, true}) {
    const CubeScene inside(occluded_from(10.0f, 16, true, is_local)),
        outside(occluded_from(10.0f, 16, false, is_local));
    EXPECT_EQ(inside.value(inside.at(kAbove, kDown)), Rgb(0.0f));
    EXPECT_EQ(outside.value(outside.at(kAbove, kDown)), Rgb(1.0f));
    // Seen from inside, the normal is on that side.
    EXPECT_EQ(outside.value(outside.at({0.5f, 0.4f, 0.5f}, kDown)), Rgb(0.0f));
  }
}

TEST(RayNodes, WithoutAnythingToTraceInNothingIsMet) {
  const CubeScene closed(occluded_from(10.0f, 16, true, false)), round(bevelled(0.3f, 4));
  EXPECT_EQ(evaluate_emission(*closed.scene, closed.at(kAbove, kDown), {}), Rgb(1.0f));
  EXPECT_EQ(evaluate_emission(*round.scene, round.at({0.85f, 0.5f, 2.0f}, kDown), {}), Rgb(0.0f, 0.0f, 1.0f));
}

/// What reuse relies on: from elsewhere, by another ray, as emission or as all of the material.
TEST(RayNodes, APointIsTheSameForAllWhoEvaluateIt) {
  const CubeScene open(occluded_from(0.5f, 16, true, false)), round(bevelled(0.3f, 4));
  for (const CubeScene* cube : {&open, &round}) {
    SurfacePoint point = cube->at({0.85f, 0.4f, 2.0f}, kDown);
    const Rgb first = cube->value(point);
    point.wo = normalize(Vec3{-0.5f, 0.2f, 0.3f});
    point.footprint = 0.1f;
    PathState other;
    other.ray_kind = kVisibleToDiffuse;
    other.depth = 3;
    other.ray_length = 5.0f;
    EXPECT_EQ(evaluate_emission(*cube->scene, point, other, cube->accel.get()), first);
    EXPECT_EQ(evaluate_material(*cube->scene, point, other, cube->accel.get()).emission, first);
  }
}

/// Planted bug for the test above, and what keeps a picture from the error of one pattern of rays.
TEST(RayNodes, NeighboursAreNot) {
  const CubeScene open(occluded_from(0.5f, 16, true, false));
  std::vector<float> found;
  for (int i = 0; i < 64; ++i)
    found.push_back(open.value(open.at({0.5f, 0.4f + 1e-5f * static_cast<float>(i), 2.0f}, kDown)).r);
  std::ranges::sort(found);
  EXPECT_GT(std::unique(found.begin(), found.end()) - found.begin(), 3);
}

/// At the middle of a face nothing inside is nearer than 1/2.
TEST(RayNodes, OcclusionEndsAtTheDistance) {
  const CubeScene near(occluded_from(0.49f, 16, true, true));
  EXPECT_EQ(near.value(near.at({0.5f, 0.5f, 2.0f}, {0.0f, 0.0f, -1.0f})), Rgb(1.0f));
}

TEST(RayNodes, TransparencySeesWhatTheMaterialDoes) {
  const CubeScene cube(occluded_from(0.7f, 8, true, false), false);
  const SurfacePoint point = cube.at(kAbove, kDown);
  const Rgb part = evaluate_transparency(*cube.scene, point, {}, cube.accel.get());
  EXPECT_EQ(part, evaluate_material(*cube.scene, point, {}, cube.accel.get()).transparency);
  EXPECT_LT(part.r, 1.0f);
}

TEST(RayNodes, BadNumbersAreOpenOrTheNormal) {
  for (const float distance : {0.0f, -1.0f}) {
    const CubeScene cube(occluded_from(distance, 16, true, false));
    EXPECT_EQ(cube.value(cube.at(kAbove, kDown)), Rgb(1.0f)) << distance;
  }
  for (const float radius : {0.0f, -0.5f}) {
    const CubeScene cube(bevelled(radius, 4));
    EXPECT_EQ(cube.value(cube.at({0.85f, 0.5f, 2.0f}, kDown)), Rgb(0.0f, 0.0f, 1.0f)) << radius;
  }
  const CubeScene by_nan([](ProgramBuilder& b) { return occlusion(b, not_a_number(b), {16, 1, 0}); });
  EXPECT_EQ(by_nan.value(by_nan.at(kAbove, kDown)), Rgb(1.0f));
  const CubeScene round_by_nan([](ProgramBuilder& b) {
    return b.add(Op::BEVEL, {not_a_number(b), b.add(Op::NORMAL, {})}, {4});
  });
  EXPECT_EQ(round_by_nan.value(round_by_nan.at({0.85f, 0.5f, 2.0f}, kDown)), Rgb(0.0f, 0.0f, 1.0f));
  // A normal that is none: the shading normal.
  const CubeScene no_normal([](ProgramBuilder& b) {
    const Operand bad = b.add(Op::BROADCAST, {not_a_number(b)});
    const Operand part = b.add(Op::AMBIENT_OCCLUSION, {b.constant(10), bad}, {16, 0, 0});
    return b.add(Op::BROADCAST, {part});
  });
  EXPECT_EQ(no_normal.value(no_normal.at(kAbove, kDown)), Rgb(1.0f));
}

TEST(RayNodes, RadiiWithoutBoundsStayFinite) {
  for (const float radius : {10.0f, 1e20f, 3e38f}) {
    const CubeScene cube(bevelled(radius, 128));
    const Rgb n = cube.value(cube.at({0.5f, 0.5f, 2.0f}, {0.0f, 0.0f, -1.0f}));
    EXPECT_TRUE(std::isfinite(n.r + n.g + n.b)) << radius;
  }
}

TEST(RayNodes, NumbersOfRaysAreChecked) {
  for (const int rays : {0, 129, -1}) {
    EXPECT_THROW(CubeScene(occluded_from(1.0f, rays, false, false)), Error) << rays;
    EXPECT_THROW(CubeScene(bevelled(0.1f, rays)), Error) << rays;
  }
}

TEST(RayNodes, OnlyWhatLooksAtItsOwnObjectIsTracedAlone) {
  const auto is_alone = [](const CubeScene& cube) { return cube.scene->materials[0]->looks_at_own_object; };
  EXPECT_FALSE(is_alone(CubeScene(occluded_from(1.0f, 4, true, false))));
  EXPECT_TRUE(is_alone(CubeScene(occluded_from(1.0f, 4, true, true))));
  EXPECT_TRUE(is_alone(CubeScene(bevelled(0.1f, 4))));
}

/// From there in that direction, up to that many lengths of it; 0 what was met, 1 the normal.
auto cast(Vec3 origin, Vec3 direction, float length, int what, bool is_local = false) {
  return [=](ProgramBuilder& b) {
    return b.add(Op::RAYCAST, {b.constant(origin), b.constant(direction), b.constant(length)}, {what, is_local, 0});
  };
}
Rgb seen(const CubeScene& cube) { return cube.value(cube.at(kAbove, kDown)); }

TEST(Raycast, MeetsTheCube) {
  const Vec3 from{3.0f, 0.3f, 0.4f}, along{-2.0f, 0.0f, 0.0f};
  for (const bool is_local : {false, true}) {
    EXPECT_EQ(seen(CubeScene(cast(from, along, 2.0f, 0, is_local))), Rgb(1.0f, 1.0f, 1.0f));
    EXPECT_EQ(seen(CubeScene(cast(from, along, 2.0f, 1, is_local))), Rgb(1.0f, 0.0f, 0.0f));
  }
  // Inside, the normal is on the side of the ray.
  EXPECT_EQ(seen(CubeScene(cast({0.5f, 0.3f, 0.4f}, along, 2.0f, 1))), Rgb(1.0f, 0.0f, 0.0f));
  // 0.9 lengths do not reach it.
  EXPECT_EQ(seen(CubeScene(cast(from, along, 0.9f, 0))), Rgb(0.0f, 0.0f, 0.9f));
  EXPECT_EQ(seen(CubeScene(cast(from, along, 0.9f, 1))), Rgb(0.0f));
}

TEST(Raycast, FromThePointItselfItLeavesTheSurface) {
  const auto from_here = [](Vec3 direction) {
    return [=](ProgramBuilder& b) {
      return b.add(Op::RAYCAST, {b.add(Op::POSITION, {}, {0}), b.constant(direction), b.constant(10.0f)}, {0, 0, 0});
    };
  };
  EXPECT_EQ(seen(CubeScene(from_here({0.0f, 0.0f, 1.0f}))), Rgb(0.0f, 0.0f, 10.0f));
  const Rgb through = seen(CubeScene(from_here({0.0f, 0.0f, -1.0f})));
  EXPECT_EQ(through.r, 1.0f);
  EXPECT_NEAR(through.b, 1.0f, 1e-5f);
}

TEST(Raycast, RaysThatAreNoRaysMeetNothing) {
  const Vec3 down{0.0f, 0.0f, -1.0f}, above{0.5f, 0.5f, 2.0f};
  const Rgb nothing(0.0f, 0.0f, 5.0f);
  for (const bool is_local : {false, true}) {
    EXPECT_EQ(seen(CubeScene(cast(above, {}, 5.0f, 0, is_local))), nothing);
    EXPECT_EQ(seen(CubeScene(cast(above, {0.0f, 0.0f, -3e38f}, 5.0f, 0, is_local))), nothing);
    EXPECT_EQ(seen(CubeScene(cast({3e38f, 0.0f, 0.0f}, down, 5.0f, 0, is_local))), nothing);
    EXPECT_EQ(seen(CubeScene(cast(above, down, -1.0f, 0, is_local))), Rgb(0.0f, 0.0f, -1.0f));
    EXPECT_EQ(seen(CubeScene(cast(above, down, 3e38f, 0, is_local))).r, 1.0f);
  }
  const CubeScene cube(cast(above, down, 5.0f, 0));
  EXPECT_EQ(evaluate_emission(*cube.scene, cube.at(kAbove, kDown), {}), nothing);  // no accel
}

TEST(Raycast, OnlyThoseThatMeetTheirOwnObjectNeedItAlone) {
  EXPECT_FALSE(CubeScene(cast({}, kDown, 1.0f, 0)).scene->materials[0]->looks_at_own_object);
  EXPECT_TRUE(CubeScene(cast({}, kDown, 1.0f, 0, true)).scene->materials[0]->looks_at_own_object);
}

}  // namespace
}  // namespace cistern
