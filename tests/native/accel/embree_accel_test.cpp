#include <gtest/gtest.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <atomic>

#include "accel/top_level.h"
#include "accel_scenes.h"

namespace cistern::test {
namespace {

constexpr Transform kIdentity;

Ray random_ray(Rng& rng, float spread) {
  const Vec3 origin = random_point(rng, spread);
  return {origin, random_direction(rng)};
}

/// Closest hit in double precision by trying every triangle; t of nearly grazing or edge hits is left to the caller.
struct ReferenceHit {
  double t = INFINITY;
  uint32_t instance = 0, triangle = 0;
  double edge_distance = 1.0;  // smallest barycentric weight
};

struct Double3 {
  double x, y, z;
  explicit Double3(Vec3 v) : x(v.x), y(v.y), z(v.z) {}
  Double3(double a, double b, double c) : x(a), y(b), z(c) {}
  Double3 operator-(Double3 b) const { return {x - b.x, y - b.y, z - b.z}; }
};
double dot3(Double3 a, Double3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Double3 cross3(Double3 a, Double3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

/// [Möller and Trumbore 1997]
void intersect_reference(const Scene& scene, const Ray& ray, uint32_t instance_index, ReferenceHit& best) {
  const Instance& instance = scene.instances[instance_index];
  const Mesh& mesh = *scene.meshes[instance.mesh];
  for (uint32_t i = 0; i < mesh.triangle_count(); ++i) {
    const TriangleIndices v = mesh.vertices[i];
    const Double3 p0(instance.object_to_world.point(mesh.positions[v[0]]));
    const Double3 e1 = Double3(instance.object_to_world.point(mesh.positions[v[1]])) - p0;
    const Double3 e2 = Double3(instance.object_to_world.point(mesh.positions[v[2]])) - p0;
    const Double3 d(ray.direction), s = Double3(ray.origin) - p0;
    const Double3 h = cross3(d, e2), q = cross3(s, e1);
    const double inv = 1.0 / dot3(e1, h);
    const double u = dot3(s, h) * inv, w = dot3(d, q) * inv, t = dot3(e2, q) * inv;
    if (u < 0.0 || w < 0.0 || u + w > 1.0 || t <= ray.t_min || t >= std::min<double>(ray.t_max, best.t)) continue;
    best = {t, instance_index, i, std::min({u, w, 1.0 - u - w})};
  }
}

/// Three copies of one mesh (one mirrored) and a mesh used once.
std::shared_ptr<Scene> mixed_scene() {
  Rng rng(1, 0, 0, 0);
  const std::shared_ptr<Scene> scene = make_scene();
  scene->meshes = {random_triangles(rng, 60, 1.0f, 0.5f), random_triangles(rng, 60, 2.0f, 0.5f)};
  place(*scene, 0, random_transform(rng, {1.0f, 1.0f, 1.0f}, 1.0f));
  place(*scene, 1, random_transform(rng, {-1.0f, 0.5f, 2.0f}, 1.0f));
  place(*scene, 0, random_transform(rng, {-1.0f, 2.0f, 0.7f}, 1.0f));
  place(*scene, 0, random_transform(rng, {0.5f, 2.0f, 1.5f}, 1.0f));
  return scene;
}

TEST(Accel, TracesOneInstanceAlone) {
  const std::shared_ptr<Scene> scene = mixed_scene();
  const auto below = std::make_shared<MaterialProgram>();
  below->has_subsurface = true;
  scene->materials[0] = below;
  place(*scene, 0, scene->instances[2].object_to_world);  // just where another is
  const std::shared_ptr<const Accel> accel = Accel::build(scene);
  Rng rng(3, 0, 0, 0);
  int hits = 0, ties = 0;
  for (int i = 0; i < 1000; ++i) {
    const Ray ray = random_ray(rng, 2.0f);
    for (uint32_t instance = 0; instance < scene->instances.size(); ++instance) {
      ReferenceHit expected;
      intersect_reference(*scene, ray, instance, expected);
      if (expected.edge_distance < 1e-4) continue;
      const std::optional<Hit> hit = accel->intersect_instance(ray, instance);
      ASSERT_EQ(hit.has_value(), std::isfinite(expected.t)) << i << " " << instance;
      EXPECT_EQ(accel->obstructed_by_instance(ray, instance), hit.has_value());
      if (!hit) continue;
      ++hits;
      EXPECT_EQ(hit->instance, instance);
      EXPECT_EQ(hit->triangle, expected.triangle);
      EXPECT_NEAR(hit->t, expected.t, 1e-4);
    }
    const std::optional<Hit> first = accel->intersect_instance(ray, 2), second = accel->intersect_instance(ray, 4);
    if (first && second) ties += first->t == second->t;
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(ties, 100);
  const std::shared_ptr<Scene> plain = mixed_scene();
  EXPECT_FALSE(Accel::build(plain)->intersect_instance({{0, 0, 0}, {0, 0, 1}}, 1));  // flattened: nothing is found
}

RayLanes together(std::span<const Ray> rays) {
  RayLanes lanes;
  for (size_t i = 0; i < rays.size(); ++i) lanes.set(i, rays[i]);
  return lanes;
}

TEST(Accel, AgreesWithBruteForce) {
  const std::shared_ptr<Scene> scene = mixed_scene();
  const std::shared_ptr<const Accel> accel = Accel::build(scene);
  Rng rng(2, 0, 0, 0);
  int hits = 0;
  for (int i = 0; i < 4000; ++i) {
    Ray ray = random_ray(rng, 2.0f);
    if (i % 2 == 1) ray.t_max = 1.0f;
    ReferenceHit expected;
    for (uint32_t k = 0; k < 4; ++k) intersect_reference(*scene, ray, k, expected);
    const std::optional<Hit> hit = accel->intersect(ray, kVisibleToCamera);
    ASSERT_EQ(accel->occluded(ray), hit.has_value());
    ASSERT_EQ(accel->obstructed(together({&ray, 1}), kVisibleToCamera)[0], hit.has_value());
    if (hit && expected.t < INFINITY && hit->triangle == expected.triangle && hit->instance == expected.instance) {
      ++hits;
      EXPECT_NEAR(hit->t, expected.t, 1e-4 * (1.0 + expected.t));
      continue;
    }
    // Single precision may decide otherwise only within rounding of an edge.
    const bool is_near_edge = expected.edge_distance < 1e-4;
    EXPECT_TRUE(is_near_edge || (!hit && expected.t == INFINITY)) << "ray " << i;
  }
  EXPECT_GT(hits, 1000);
}

TEST(Accel, FlattenedAndInstancedAgree) {
  const std::shared_ptr<Scene> scene = make_scene();
  Rng rng(3, 0, 0, 0);
  for (int i = 0; i < 4; ++i) {
    scene->meshes.push_back(random_triangles(rng, 50, 1.0f, 0.5f));
    const Vec3 stretch{i % 2 == 0 ? 1.0f : -1.5f, 0.7f, i == 3 ? -1.0f : 1.3f};
    place(*scene, i, random_transform(rng, stretch, 2.0f));
  }
  ASSERT_TRUE(place_instances(*scene, false)[0].is_flattened);
  ASSERT_FALSE(place_instances(*scene, true)[0].is_flattened);
  const std::shared_ptr<const Accel> flattened = Accel::build(scene);
  const std::shared_ptr<const Accel> instanced = Accel::build(scene, {}, true);
  int hits = 0;
  for (int i = 0; i < 4000; ++i) {
    const Ray ray = random_ray(rng, 3.0f);
    const std::optional<Hit> a = flattened->intersect(ray, kVisibleToCamera);
    const std::optional<Hit> b = instanced->intersect(ray, kVisibleToCamera);
    if (!a || !b || a->triangle != b->triangle || a->instance != b->instance) continue;
    ++hits;
    EXPECT_NEAR(a->t, b->t, 1e-4f * (1.0f + a->t));
    EXPECT_NEAR(a->u, b->u, 2e-3f);
    EXPECT_NEAR(a->v, b->v, 2e-3f);
    EXPECT_GT(dot(normalize(a->normal), normalize(b->normal)), 0.999f) << "instance " << a->instance;
  }
  EXPECT_GT(hits, 400);
}

TEST(Accel, MirroredObjectKeepsItsOutside) {
  const std::shared_ptr<Scene> scene = make_scene();
  scene->meshes = {make_mesh({{-1.0f, -1.0f, 0.0f}, {1.0f, -1.0f, 0.0f}, {0.0f, 1.0f, 0.0f}})};  // faces +z
  Transform mirrored;
  mirrored.row_x.x = -1.0f;
  place(*scene, 0, mirrored);
  for (const bool keep_instances : {false, true}) {
    const Ray down{{0.0f, 0.0f, 2.0f}, {0.0f, 0.0f, -1.0f}};
    const std::optional<Hit> hit = Accel::build(scene, {}, keep_instances)->intersect(down, kVisibleToCamera);
    ASSERT_TRUE(hit);
    EXPECT_FLOAT_EQ(hit->t, 2.0f);
    EXPECT_GT(hit->normal.z, 0.0f);
  }
}

TEST(Accel, RaysSeeOnlyWhatIsVisibleToThem) {
  for (const bool keep_instances : {false, true}) {
    for (int bit = 0; bit < 5; ++bit) {
      const std::shared_ptr<Scene> scene = make_scene();
      scene->meshes = {make_mesh({{-1.0f, -1.0f, 0.0f}, {1.0f, -1.0f, 0.0f}, {0.0f, 1.0f, 0.0f}})};
      place(*scene, 0, kIdentity, static_cast<uint8_t>(1 << bit));
      const std::shared_ptr<const Accel> accel = Accel::build(scene, {}, keep_instances);
      const Ray ray{{0.0f, 0.0f, 2.0f}, {0.0f, 0.0f, -1.0f}};
      for (int kind = 0; kind < 5; ++kind) {
        EXPECT_EQ(accel->intersect(ray, static_cast<uint8_t>(1 << kind)).has_value(), kind == bit);
        EXPECT_EQ(accel->occluded(ray, static_cast<uint8_t>(1 << kind)), kind == bit);
        EXPECT_FALSE(accel->intersect_transparent(ray, static_cast<uint8_t>(1 << kind)));
      }
      EXPECT_EQ(accel->occluded(ray), bit == 4);
    }
  }
}

TEST(Accel, TransparentCastersAreApart) {
  const std::shared_ptr<Scene> scene = make_scene();
  scene->meshes = {make_mesh({{-1.0f, -1.0f, 0.0f}, {1.0f, -1.0f, 0.0f}, {0.0f, 1.0f, 0.0f}})};
  place(*scene, 0, kIdentity, kVisibleToAll, 1);
  Transform behind;
  behind.translation = {0.0f, 0.0f, -1.0f};
  place(*scene, 0, behind, kVisibleToAll, 0);
  const std::shared_ptr<const Accel> accel = Accel::build(scene);
  EXPECT_TRUE(accel->has_transparent_surfaces());
  Ray ray{{0.0f, 0.0f, 2.0f}, {0.0f, 0.0f, -1.0f}, 0.0f, 2.5f};
  EXPECT_FALSE(accel->occluded(ray));
  ASSERT_TRUE(accel->intersect_transparent(ray));
  EXPECT_EQ(accel->intersect_transparent(ray)->instance, 0u);
  EXPECT_TRUE(accel->obstructed(together({&ray, 1}), kVisibleToShadow)[0]);
  EXPECT_FALSE(accel->occluded(ray, kVisibleToDiffuse));
  EXPECT_TRUE(accel->intersect_transparent(ray, kVisibleToDiffuse));
  ray.t_max = 10.0f;
  EXPECT_TRUE(accel->occluded(ray));
  ray.t_min = 2.5f;
  EXPECT_FALSE(accel->intersect_transparent(ray));
  scene->instances[0].material_set = 0;
  EXPECT_FALSE(Accel::build(scene)->has_transparent_surfaces());
}

/// Packets of eight go through the tree another way; only rays that graze a triangle's edge may differ.
TEST(Accel, RaysTracedTogetherMeetWhatTheyMeetAlone) {
  Rng rng(9, 0, 0, 0);
  const auto scene = make_scene();
  scene->meshes = {random_triangles(rng, 400, 3.0f, 0.6f)};
  place(*scene, 0, kIdentity);
  place(*scene, 0, random_transform(rng, {1.0f, 1.0f, 1.0f}, 2.0f));
  const auto accel = Accel::build(scene);
  size_t different = 0, occluded = 0, total = 0;
  for (size_t count = 0; count <= kLanes; ++count) {
    for (int repeat = 0; repeat < 200; ++repeat, total += count) {
      std::vector<Ray> rays;
      for (size_t i = 0; i < count; ++i) rays.push_back(random_ray(rng, 4.0f));
      for (Ray& ray : rays) ray.t_max = 6.0f * rng.next_float();
      const LaneMask is_occluded = accel->occluded(together(rays), kVisibleToShadow);
      for (size_t i = 0; i < count; ++i) {
        const bool alone = accel->occluded(rays[i]);
        different += alone != is_occluded[i];
        occluded += alone;
      }
      for (size_t i = count; i < kLanes; ++i) EXPECT_FALSE(is_occluded[i]) << "of no ray";
    }
  }
  EXPECT_LE(different, 2u);
  EXPECT_GT(occluded, total / 5);
  EXPECT_LT(occluded, total * 4 / 5);
}

TEST(Accel, RaysThatAreNotNumbersMeetNothing) {
  const auto scene = make_scene();
  scene->meshes = {make_mesh({{-9, -9, 1}, {9, -9, 1}, {0, 9, 1}})};
  place(*scene, 0, kIdentity);
  const auto accel = Accel::build(scene);
  const Ray up{{0, 0, 0}, {0, 0, 1}};
  const float nan = std::nanf("");
  const std::array<Ray, 5> rays{up, Ray{{nan, 0, 0}, {0, 0, 1}}, Ray{{0, 0, 0}, {0, nan, 1}},
                                Ray{{0, 0, 0}, {0, 0, INFINITY}}, Ray{{0, 0, 0}, {0, 0, 1}, 0.0f, nan}};
  const LaneMask is_occluded = accel->occluded(together(rays), kVisibleToShadow);
  for (size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(accel->intersect(rays[i], kVisibleToCamera).has_value(), i == 0);
    EXPECT_EQ(accel->occluded(rays[i]), i == 0);
    EXPECT_EQ(is_occluded[i], i == 0);
  }
}

TEST(Accel, EmptyScenesAndMeshesAreHitByNothing) {
  const std::shared_ptr<Scene> scene = make_scene();
  const Ray ray{{0.0f, 0.0f, 2.0f}, {0.0f, 0.0f, -1.0f}};
  EXPECT_FALSE(Accel::build(scene)->intersect(ray, kVisibleToAll));
  scene->meshes = {make_mesh({}), nullptr};
  place(*scene, 0, kIdentity);
  place(*scene, 1, kIdentity);
  place(*scene, -1, kIdentity);
  const std::shared_ptr<const Accel> accel = Accel::build(scene);
  EXPECT_FALSE(accel->intersect(ray, kVisibleToAll));
  EXPECT_FALSE(accel->occluded(ray));
  EXPECT_TRUE(accel->bounds().is_empty());
}

TEST(Accel, MeshScenesAreSharedBetweenSnapshots) {
  const std::shared_ptr<Scene> scene = mixed_scene();
  const std::shared_ptr<const Accel> first = Accel::build(scene, {}, true);
  EXPECT_GT(first->memory_bytes(), 0u);
  const std::shared_ptr<Scene> moved = std::make_shared<Scene>(*scene);
  moved->instances[0].object_to_world.translation.x += 1.0f;
  const size_t before = first->memory_bytes();
  const std::shared_ptr<const Accel> second = Accel::build(moved, first, true);
  EXPECT_NEAR(static_cast<double>(second->memory_bytes()), static_cast<double>(before), 0.2 * before);
  const Ray ray{{0.0f, 0.0f, 5.0f}, {0.0f, 0.0f, -1.0f}};
  const std::optional<Hit> fresh = Accel::build(moved, {}, true)->intersect(ray, kVisibleToAll);
  const std::optional<Hit> shared = second->intersect(ray, kVisibleToAll);
  ASSERT_EQ(fresh.has_value(), shared.has_value());
  EXPECT_EQ(fresh.value_or(Hit{}).t, shared.value_or(Hit{}).t);
}

TEST(Accel, OutlivesWhatItWasBuiltFrom) {
  std::shared_ptr<const Accel> accel;
  {
    std::shared_ptr<const Accel> first = Accel::build(mixed_scene());
    std::shared_ptr<Scene> scene = std::make_shared<Scene>(*mixed_scene());
    accel = Accel::build(scene, first);
  }
  Rng rng(4, 0, 0, 0);
  int hits = 0;
  for (int i = 0; i < 100; ++i) hits += accel->intersect(random_ray(rng, 2.0f), kVisibleToAll).has_value() ? 1 : 0;
  EXPECT_GT(hits, 20);
}

TEST(Accel, ResultsDoNotDependOnThreads) {
  const std::shared_ptr<Scene> scene = mixed_scene();
  constexpr int kRays = 2000;
  const auto trace = [&](int threads) {
    std::vector<Hit> hits(kRays);
    tbb::task_arena(threads).execute([&] {
      const std::shared_ptr<const Accel> accel = Accel::build(scene);
      tbb::parallel_for(0, kRays, [&](int i) {
        Rng rng(5, static_cast<uint32_t>(i), 0, 0);
        hits[i] = accel->intersect(random_ray(rng, 2.0f), kVisibleToAll).value_or(Hit{});
      });
    });
    return hits;
  };
  const std::vector<Hit> one = trace(1), several = trace(4);
  for (int i = 0; i < kRays; ++i) {
    ASSERT_EQ(one[i].t, several[i].t);
    ASSERT_EQ(one[i].triangle, several[i].triangle);
    ASSERT_EQ(one[i].normal, several[i].normal);
  }
}

TEST(Accel, ClosedMeshIsWatertight) {
  // A sphere of small triangles far from the origin: no ray from the inside escapes.
  std::vector<Vec3> positions;
  const Vec3 center{1000.0f, -2000.0f, 500.0f};
  constexpr int kRings = 64;
  const auto at = [&](int ring, int segment) {
    const float theta = kPi * static_cast<float>(ring) / kRings;
    const float phi = 2.0f * kPi * static_cast<float>(segment % kRings) / kRings;
    const float radius = ring == 0 || ring == kRings ? 0.0f : std::sin(theta);
    return center + Vec3{radius * std::cos(phi), radius * std::sin(phi), std::cos(theta)};
  };
  for (int ring = 0; ring < kRings; ++ring) {
    for (int segment = 0; segment < kRings; ++segment) {
      const Vec3 quad[] = {at(ring, segment), at(ring + 1, segment), at(ring + 1, segment + 1), at(ring, segment + 1)};
      for (const int k : {0, 1, 2, 0, 2, 3}) positions.push_back(quad[k]);
    }
  }
  const std::shared_ptr<Scene> scene = make_scene();
  scene->meshes = {make_mesh(positions)};
  place(*scene, 0, kIdentity);
  const std::shared_ptr<const Accel> accel = Accel::build(scene);
  Rng rng(6, 0, 0, 0);
  int escaped = 0;
  for (int i = 0; i < 200000; ++i) {
    // Half of the rays aim at edges, where cracks would show.
    const Vec3 origin = center + random_point(rng, 0.3f);
    const size_t triangle = rng.next_uint32() % (positions.size() / 3);
    const Vec3 target = lerp(positions[3 * triangle], positions[3 * triangle + 1], rng.next_float());
    const Vec3 direction = i % 2 == 0 ? normalize(target - origin) : random_direction(rng);
    escaped += accel->intersect({origin, direction}, kVisibleToAll) ? 0 : 1;
  }
  EXPECT_EQ(escaped, 0);
}

/// Many triangles, by themselves or as instances.
class StoppedBuild : public testing::TestWithParam<bool> {};

TEST_P(StoppedBuild, EndsSoonAndLeavesNothing) {
  Rng rng(3, 0, 0, 0);
  const std::shared_ptr<Scene> scene = make_scene();
  scene->meshes = {random_triangles(rng, 100'000, 1.0f, 0.01f)};
  place(*scene, 0, kIdentity);
  std::atomic<int> asked{0};
  const auto first = Accel::build(mixed_scene());
  ASSERT_NE(Accel::build(scene, first, GetParam(), [&] { return ++asked < 0; }), nullptr);
  const int all = asked.exchange(0);
  EXPECT_GT(all, 100) << "asked all the time";
  EXPECT_EQ(Accel::build(scene, first, GetParam(), [&] { return ++asked > 10; }), nullptr);
  EXPECT_LT(asked, all / 2);
  const auto whole = Accel::build(scene, first, GetParam()), alone = Accel::build(scene, {}, GetParam());
  for (int i = 0; i < 1000; ++i) {
    const Ray ray = random_ray(rng, 1.0f);
    const std::optional<Hit> hit = whole->intersect(ray, kVisibleToAll), same = alone->intersect(ray, kVisibleToAll);
    ASSERT_EQ(hit.has_value(), same.has_value());
    if (hit) ASSERT_EQ(hit->t, same->t);
  }
}

INSTANTIATE_TEST_SUITE_P(Accel, StoppedBuild, testing::Bool());

TEST(Accel, VersionIsTheOneCompiledAgainst) { EXPECT_NO_THROW(check_embree_version()); }

TEST(FlushDenormals, IsUndoneAtTheEnd) {
  volatile float tiny = 1e-39f;
  {
    const FlushDenormals flush;
    EXPECT_EQ(tiny * 1.0f, 0.0f);
  }
  EXPECT_NE(tiny * 1.0f, 0.0f);
}

}  // namespace
}  // namespace cistern::test
