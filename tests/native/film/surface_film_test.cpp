#include "film/surface_film.h"

#include <gtest/gtest.h>

#include <array>

#include "base/check.h"
#include "base/rng.h"
#include "render/render_scenes.h"

namespace cistern::test {
namespace {

const SurfaceLayer kMist{SurfaceLayer::Kind::MIST, 1}, kUv{SurfaceLayer::Kind::UV, 3};

/// A point on the first instance of small_room, `distance` in front of its camera.
SeenSurface seen_at(const Scene& scene, float distance, float throughput, float alpha) {
  SeenSurface seen;
  seen.point.position = scene.camera.camera_to_world.translation + Vec3{0.0f, distance, 0.0f};
  seen.throughput = throughput, seen.alpha = alpha, seen.contribution = throughput * alpha;
  return seen;
}

SurfacePasses mist(float falloff) {
  SurfacePasses passes;
  passes.mist = true;
  passes.mist_range = {1.0f, 4.0f, falloff};
  return passes;
}

TEST(SurfaceFilm, MistGrowsWithDistanceByItsFalloff) {
  const std::shared_ptr<const Scene> scene = small_room();
  for (const float falloff : {0.5f, 1.0f, 2.0f}) {
    SurfaceFilm film(mist(falloff), 3, 1, {});
    for (const float distance : {0.5f, 2.0f, 9.0f}) {
      const SeenSurface seen = seen_at(*scene, distance, 1.0f, 1.0f);
      film.add(distance < 1.0f ? 0 : (distance < 5.0f ? 1 : 2), *scene, {&seen, 1});
    }
    const std::vector<float> pixels = film.resolve(kMist);
    EXPECT_EQ(pixels[0], 0.0f);
    EXPECT_FLOAT_EQ(pixels[1], std::pow(0.25f, falloff));
    EXPECT_EQ(pixels[2], 1.0f);
  }
}

TEST(SurfaceFilm, MistIsBlendedOverWhatIsSeenThrough) {
  const std::shared_ptr<const Scene> scene = small_room();
  SurfaceFilm film(mist(1.0f), 1, 1, {});
  const SeenSurface both[] = {seen_at(*scene, 2.0f, 1.0f, 0.25f), seen_at(*scene, 4.0f, 0.75f, 1.0f)};
  film.add(0, *scene, both);
  film.add(0, *scene, {both, 1});  // then sky
  const float blended = 0.25f * 0.25f + 0.75f * 0.75f, sky = 0.25f * 0.25f + 0.75f;
  EXPECT_FLOAT_EQ(film.resolve(kMist)[0], 0.5f * (blended + sky));
}

TEST(SurfaceFilm, LateSamplesCountAsMuchAsEarlyOnes) {
  // See the test of Film: rounded to the nearest number, this was 1 % off.
  const std::shared_ptr<const Scene> scene = small_room();
  SurfaceFilm film(mist(1.0f), 1, 1, {});
  const SeenSurface seen = seen_at(*scene, 4.6f, 1.0f, 1.0f);  // Mist 0.9
  for (uint32_t k = 0; k < 1 << 20; ++k) film.add(0, *scene, {&seen, 1});
  EXPECT_NEAR(film.resolve(kMist)[0], 0.9f, 0.1f * 2.8e-4f);
}

// Of a ceiling at height h, rays of length d meet what is within an angle whose cosine is h / d: open is its square.
TEST(SurfaceFilm, OcclusionIsWhatIsNearOfTheHemisphere) {
  PathScene room;
  room.floor(0.0f, 1.0f, room.diffuse(0.5f));
  room.floor(1.0f, 1000.0f, room.diffuse(0.5f));
  const auto scene = room.builder.snapshot();
  const auto accel = Accel::build(scene);
  const int samples = 4096;
  for (const float distance : {0.5f, 1.25f, 2.0f}) {
    SurfacePasses passes;
    passes.occlusion = true;
    passes.occlusion_distance = distance;
    SurfaceFilm film(passes, 2, 1, {});
    Rng rng(1, 0, 0, 0);
    for (int i = 0; i < samples; ++i) {
      const Vec2 u = rng.next_vec2();
      const Ray down{{0.9f * (u.x - 0.5f), 0.9f * (u.y - 0.5f), 0.5f}, {0, 0, -1}};
      SeenSurface seen;
      seen.point = make_surface_point(*scene, down, *accel->intersect(down, kVisibleToCamera));
      seen.normal = seen.point.ng;
      film.add(0, *scene, {&seen, 1}, accel.get());
      seen.contribution = 0.5f;
      film.add(1, *scene, {&seen, 1}, accel.get());
    }
    const float open = std::min(1.0f / sqr(distance), 1.0f);
    const float tolerance = 5.0f * std::sqrt(open * (1.0f - open) / samples) + 1e-5f;  // 5 sigma of single rays
    const std::vector<float> pixels = film.resolve({SurfaceLayer::Kind::OCCLUSION, 3});
    EXPECT_NEAR(pixels[0], open, tolerance);
    EXPECT_EQ(pixels[0], pixels[2]);
    EXPECT_NEAR(pixels[3], 0.5f * open, tolerance);
    EXPECT_GT(std::abs(pixels[0] - (1.0f - 1.0f / distance)), tolerance) << "of the evenly covered hemisphere";
  }
}

TEST(SurfaceFilm, RoughnessIsThatOfTheFirstSurface) {
  const std::shared_ptr<const Scene> scene = small_room();
  SurfacePasses passes;
  passes.roughness = true;
  SurfaceFilm film(passes, 1, 1, {});
  SeenSurface seen[] = {seen_at(*scene, 1.0f, 1.0f, 0.25f), seen_at(*scene, 2.0f, 0.75f, 1.0f)};
  seen[0].roughness = 0.1f, seen[1].roughness = 0.7f;
  film.add(0, *scene, seen);
  EXPECT_FLOAT_EQ(film.resolve({SurfaceLayer::Kind::ROUGHNESS, 1})[0], 0.7f);
}

TEST(SurfaceFilm, VectorIsTheWayInPixelsFromTheFrameBeforeAndToTheNext) {
  Scene scene = *small_room();
  scene.camera.type = CameraType::ORTHOGRAPHIC;  // 1.2 m wide
  std::vector<Transform> rest;
  for (const Instance& instance : scene.instances) rest.push_back(instance.object_to_world);
  std::vector<Transform> moved = rest;
  moved[1].translation.x -= 0.12f;
  Camera raised = scene.camera;
  raised.camera_to_world.translation.z += 0.06f;
  scene.motion[0] = std::make_shared<const MotionStep>(MotionStep{scene.camera, moved, {}});
  scene.motion[1] = std::make_shared<const MotionStep>(MotionStep{raised, rest, {}});
  SurfacePasses passes;
  passes.motion = true;
  SurfaceFilm film(passes, 2, 1, {100.0f, 100.0f});
  SeenSurface seen;
  seen.point.instance = 1;
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(scene.instances[1].mesh)];
  seen.point.position = rest[1].point(mesh.triangle_positions(0)[0]);
  film.add(1, scene, {&seen, 1});
  film.add(1, scene, {});  // the sky does not move
  const std::vector<float> pixels = film.resolve(*find_surface_layer("Vector"));
  const std::array<float, 8> expected{0.0f, 0.0f, 0.0f, 0.0f, -10.0f, 0.0f, 0.0f, 5.0f};
  for (size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(pixels[i], expected[i], 1e-4f) << i;
}

TEST(SurfaceFilm, VectorFollowsPointsOfMeshesThatChangeTheirShape) {
  Scene scene = *small_room();
  scene.camera.type = CameraType::ORTHOGRAPHIC;  // 1.2 m wide
  std::vector<Transform> rest;
  for (const Instance& instance : scene.instances) rest.push_back(instance.object_to_world);
  const int handle = scene.instances[1].mesh;
  const std::shared_ptr<const Mesh> mesh = scene.meshes[static_cast<size_t>(handle)];
  std::vector<Vec3> bent = mesh->positions;
  bent[mesh->vertices[0][1]].x -= 0.24f;
  const auto vector = [&](std::vector<Vec3> positions, bool is_displaced) {
    Scene shown = scene;
    shown.motion[0] = std::make_shared<const MotionStep>(MotionStep{scene.camera, rest, {{handle, positions}}});
    if (is_displaced) {
      auto displaced = std::make_shared<Mesh>(*mesh);
      for (Vec3& p : displaced->positions) p.z += 0.05f;
      // In another order, with one more, as where normals differ.
      const auto count = static_cast<uint32_t>(displaced->positions.size());
      std::ranges::reverse(displaced->positions);
      displaced->positions.push_back(displaced->positions[0]);
      for (auto& triangle : displaced->vertices)
        for (uint32_t& vertex : triangle) vertex = count - 1 - vertex;
      shown.meshes.push_back(displaced);
      shown.displaced_from.push_back(handle);
      shown.instances[1].mesh = static_cast<int>(shown.meshes.size() - 1);
    }
    SurfacePasses passes;
    passes.motion = true;
    SurfaceFilm film(passes, 1, 1, {100.0f, 100.0f});
    SeenSurface seen;
    seen.point.instance = 1;
    seen.point.barycentric = {0.5f, 0.0f};
    const auto [a, b, c] = shown.meshes[static_cast<size_t>(shown.instances[1].mesh)]->triangle_positions(0);
    seen.point.position = rest[1].point(lerp(a, b, 0.5f));
    film.add(0, shown, {&seen, 1});
    return film.resolve(*find_surface_layer("Vector"))[0];
  };
  EXPECT_NEAR(vector(mesh->positions, false), 0.0f, 1e-4f);
  EXPECT_NEAR(vector(bent, false), -10.0f, 1e-4f);
  EXPECT_NEAR(vector(bent, true), -10.0f, 1e-4f) << "displaced";
  bent[mesh->vertices[0][1]].x = NAN;
  EXPECT_NEAR(vector(bent, false), 0.0f, 1e-4f) << "not finite";
  bent.pop_back();
  EXPECT_NEAR(vector(bent, false), 0.0f, 1e-4f) << "other points, as of a diced mesh";
}

TEST(SurfaceFilm, PixelsWithoutSamplesAreZero) {
  SurfacePasses passes = mist(1.0f);
  passes.uv = true;
  const SurfaceFilm film(passes, 1, 1, {});
  EXPECT_EQ(film.resolve(kMist)[0], 0.0f);
  EXPECT_EQ(film.resolve(kUv), std::vector<float>(3, 0.0f));
}

TEST(SurfaceFilm, RefusesWhatItDoesNotKeep) {
  const SurfaceFilm film(mist(1.0f), 1, 1, {});
  EXPECT_THROW(film.resolve(kUv), Error);
}

TEST(SurfaceFilm, NamesAndLayersAgree) {
  SurfacePasses passes;
  for (const char* name :
       {"Mist", "UV", "Vector", "AOV COLOR Tint", "AOV VALUE CryptoObject00", "CryptoObject00", "CryptoAsset00"}) {
    const std::optional<SurfaceLayer> layer = find_surface_layer(name);
    ASSERT_TRUE(layer);
    EXPECT_EQ(name_of(*layer), name);
    keep(*layer, passes);
    EXPECT_EQ(layers_of(passes).back(), *layer);
  }
  EXPECT_FALSE(find_surface_layer("CryptoObject08"));
  EXPECT_FALSE(find_surface_layer("Depth"));
}

}  // namespace
}  // namespace cistern::test
