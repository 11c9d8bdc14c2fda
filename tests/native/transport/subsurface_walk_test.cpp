#include "transport/subsurface_walk.h"

#include <gtest/gtest.h>

#include "accel/accel_scenes.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

/// A box of half size 1 about the origin, outsides facing out.
std::shared_ptr<Mesh> box() {
  const Vec3 corners[8] = {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                           {-1, -1, 1},  {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};
  const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  std::vector<Vec3> positions;
  for (const auto& q : quads)
    for (const int i : {0, 1, 2, 0, 2, 3}) positions.push_back(corners[q[i]]);
  return make_mesh(std::move(positions));
}

/// The box, and one of another object that pierces it.
struct BoxScene {
  std::shared_ptr<Scene> scene = make_scene();
  std::shared_ptr<const Accel> accel;
  SurfacePoint entry;  // in the middle of the box's top

  explicit BoxScene(float height) {
    const auto below = std::make_shared<MaterialProgram>();
    below->has_subsurface = true;
    scene->materials[0] = below;
    scene->meshes = {box(), box()};
    place(*scene, 0, {{1, 0, 0}, {0, 1, 0}, {0, 0, height}, {}});
    place(*scene, 1, {{0.5f, 0, 0}, {0, 0.5f, 0}, {0, 0, 0.5f}, {0.3f, 0.2f, 0.1f}});
    accel = Accel::build(scene);
    const Ray ray{{0.1f, 0.05f, 3.0f}, {0, 0, -1}};
    entry = make_surface_point(*scene, ray, *accel->intersect_instance(ray, 0));
    entry.wo = normalize(Vec3{0.5f, 0.2f, 0.8f});
  }
};

Subsurface below(float albedo, float g, SubsurfaceMethod method = SubsurfaceMethod::RANDOM_WALK_LEGACY) {
  const float free_path = method == SubsurfaceMethod::RANDOM_WALK ? 0.25f * kInvPi : 1.0f;
  Subsurface subsurface{{0, 0, 1}, Rgb(1.0f), Rgb(albedo), free_path * Rgb(3.0f, 1.5f, 6.0f)};
  subsurface.anisotropy = g;
  subsurface.method = method;
  return subsurface;
}

/// Of what leaves, by channel; walks that bring nothing count as 0.
std::array<Moments, 3> walk_often(const BoxScene& box, const Subsurface& subsurface, int walks = 40000) {
  std::array<Moments, 3> weights;
  for (int i = 0; i < walks; ++i) {
    PathSampler sampler(5, static_cast<uint32_t>(i), 0, SampleSequence::RANDOM);
    const auto exit = walk_below(*box.accel, box.entry, subsurface, 0, sampler);
    if (exit) EXPECT_EQ(exit->hit.instance, 0u);
    const Rgb weight = exit ? exit->weight : Rgb();
    weights[0].add(weight.r), weights[1].add(weight.g), weights[2].add(weight.b);
  }
  return weights;
}

// A medium that absorbs a millionth of what it scatters, in which light seldom goes on for a hundred scatterings, lets
// out what got in: whatever techniques and channels the walk was sampled with.
TEST(SubsurfaceWalk, LosesNothingInAWhiteMedium) {
  constexpr auto kWalk = SubsurfaceMethod::RANDOM_WALK, kLegacy = SubsurfaceMethod::RANDOM_WALK_LEGACY;
  for (const float height : {1.0f, 0.1f})
    for (const auto& [method, g] :
         {std::pair{kLegacy, 0.0f}, {kLegacy, 0.5f}, {kLegacy, 0.8f}, {kWalk, -0.7f}, {kWalk, 0.8f}}) {
      const BoxScene box(height);
      const auto weights = walk_often(box, below(1.0f, g, method));
      for (const Moments& weight : weights)
        EXPECT_GT(mean_p_value(weight, 1.0), shared_rate(30)) << height << " " << g << " " << weight.mean();
      // Planted bug: a medium that absorbs.
      EXPECT_LT(mean_p_value(walk_often(box, below(0.2f, g, method))[2], 1.0), shared_rate(30)) << height << " " << g;
    }
}

TEST(SubsurfaceWalk, BringsTheAlbedoOutOfDeepMedia) {
  // The fit says which medium has the albedo; where light enters by a rough boundary it is up to an eighth off.
  const BoxScene box(1.0f);
  for (const float albedo : {0.2f, 0.5f, 0.8f}) {
    Subsurface dense = below(albedo, 0.0f);
    dense.radius = Rgb(0.1f);
    const double mean = walk_often(box, dense)[0].mean();
    EXPECT_NEAR(mean / albedo, 1.0, 0.2) << albedo;
  }
}

TEST(SubsurfaceWalk, TakesTheRadiusForTheFreePathAndKeepsTheAlbedoAtAnyAnisotropy) {
  // Light that falls on the surface evenly, as the fit has it, is refracted by a boundary that bends it little.
  const BoxScene box(1.0f);
  for (const float g : {-0.5f, 0.0f, 0.8f}) {
    Subsurface dense = below(0.5f, g, SubsurfaceMethod::RANDOM_WALK);
    dense.radius = Rgb(0.01f);
    dense.ior = 1.01f;
    EXPECT_NEAR(walk_often(box, dense)[0].mean() / 0.5, 1.0, 0.2) << g;
    dense.anisotropy = 0.0f;
    const SubsurfaceMedium other = subsurface_medium(dense);
    dense.anisotropy = g;
    EXPECT_EQ(subsurface_medium(dense).sigma_t, other.sigma_t);
    EXPECT_NEAR(other.sigma_t.r, 100.0f, 1e-3f);
  }
}

TEST(SubsurfaceWalk, GoesStraightThroughThinMedia) {
  const BoxScene box(1.0f);
  Subsurface thin = below(0.5f, 0.0f);
  thin.radius = Rgb(1e7f);
  thin.alpha = 0.0f;
  PathSampler sampler(5, 0, 0, SampleSequence::RANDOM);
  const auto exit = walk_below(*box.accel, box.entry, thin, 0, sampler);
  ASSERT_TRUE(exit);
  const Vec3 inside = -exit->ray.direction;
  EXPECT_NEAR(length(cross(inside, {0, 0, 1})), length(cross(box.entry.wo, {0, 0, 1})) / thin.ior, 1e-4f);
  EXPECT_NEAR(exit->weight.g, 1.0f, 1e-5f);
  const SurfacePoint point = make_surface_point(*box.scene, exit->ray, exit->hit);
  EXPECT_FALSE(point.is_backface);
  EXPECT_NEAR(length(point.position - (exit->ray.origin + exit->hit.t * exit->ray.direction)), 0.0f, 1e-4f);
}

TEST(SubsurfaceWalk, DoesNotEnterFromBehind) {
  BoxScene box(1.0f);
  box.entry.wo = {0, 0, -1};
  PathSampler sampler(5, 0, 0, SampleSequence::RANDOM);
  EXPECT_FALSE(walk_below(*box.accel, box.entry, below(0.8f, 0.0f), 0, sampler));
}

}  // namespace
}  // namespace cistern::test
