#include "lights/light_set.h"

#include <gtest/gtest.h>

#include "lights/light_scenes.h"
#include "shading/material.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

/// Everything that shines: lamps of every shape (some that do not count), two emissive meshes, a glowing sky.
std::shared_ptr<Scene> full_scene() {
  auto scene = std::make_shared<Scene>();
  add_mesh(*scene, scattered_triangles(1, 60, 4.0f, 0.4f), constant_emission({2, 2, 2}));
  add_mesh(*scene, scattered_triangles(2, 40, 4.0f, 0.4f), one_sided_emission(),
           {{-1, 0, 0}, {0, 2, 0}, {0, 0, 1}, {0.5f, 0, 0}});
  add_mesh(*scene, scattered_triangles(3, 30, 4.0f, 0.4f), constant_emission({0, 0, 0}));
  SpotLight spot{{{0, 0, 3}, 0.3f, Rgb(20.0f), true}, {}, 0.8f, 0.2f};
  spot.world_to_local.translation = {0, 0, -3};
  scene->lights = {make_light(PointLight{{1, 2, 3}, 0.0f, Rgb(5.0f), true}),
                   make_light(PointLight{{-1, 2, 3}, 0.5f, Rgb(5.0f), true}),
                   make_light(PointLight{{1, -2, 3}, 0.5f, Rgb(5.0f), false}),
                   make_light(PointLight{{1, -2, 3}, 0.5f, Rgb(0.0f), false}),
                   make_light(spot),
                   make_light(SunLight{{0, 0.6f, 0.8f}, 0.2f, Rgb(1.0f)}),
                   make_light(AreaLight{{0, 0, 4}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, false, Rgb(4.0f), kPi})};
  scene->lights[1].removed = false;
  Light removed = scene->lights[1];
  removed.removed = true;
  scene->lights.push_back(removed);
  ProgramWriter w;
  const Operand z = w.add(Op::SEPARATE_Z, {w.add(Op::GENERATED, {}, {0})});
  const Operand strength = w.add(Op::MATH, {z, w.constant(0.0f), w.constant(0.0f)}, {12, 0});
  scene->materials.push_back(w.emit({1, 1, 1}, strength));
  scene->environment.material = static_cast<int>(scene->materials.size()) - 1;
  scene->environment.importance_width = 64;
  return scene;
}

constexpr uint32_t kLampCount = 6, kTriangleCount = 100, kEmitterCount = kLampCount + kTriangleCount + 1;
constexpr LightSampling kSamplings[] = {LightSampling::UNIFORM, LightSampling::POWER, LightSampling::TREE};

struct Receiver {
  Vec3 position, n;
};

Receiver random_receiver(Rng& rng) {
  const Vec2 xy = rng.next_vec2();
  const Vec3 position = 4.0f * Vec3{2.0f * xy.x - 1.0f, 2.0f * xy.y - 1.0f, 2.0f * rng.next_float() - 1.0f};
  return {position, rng.next_float() < 0.3f ? Vec3{} : square_to_sphere(rng.next_vec2())};
}

TEST(LightSet, CountsWhatShines) {
  const LightSet lights(full_scene(), LightSampling::POWER);
  EXPECT_EQ(lights.emitter_count(), kEmitterCount);
  EXPECT_EQ(lights.emitter_of(0, 0), kLampCount);
  EXPECT_EQ(lights.emitter_of(1, 5), kLampCount + 65);
  EXPECT_FALSE(lights.emitter_of(2, 0)) << "constant zero emission";
  EXPECT_EQ(lights.environment_emitter(), kEmitterCount - 1);
  EXPECT_TRUE(lights.has_visible_lamps());
  EXPECT_TRUE(LightSet(std::make_shared<Scene>(), LightSampling::TREE).is_empty());
  EXPECT_FALSE(LightSet(std::make_shared<Scene>(), LightSampling::TREE).choose({}, {}, 0.5f, {}));
}

TEST(LightSet, FindsTheEmittingTrianglesOfAMixedMesh) {
  auto scene = std::make_shared<Scene>();
  auto mesh = std::make_shared<Mesh>(*scattered_triangles(1, 10, 4.0f, 0.4f));
  mesh->material_slots = {0, 1, 0, 1, 1, 0, 0, 0, 0, 7};
  add_mesh(*scene, mesh, constant_emission({0, 0, 0}));
  scene->materials.push_back(constant_emission({1, 1, 1}));
  scene->material_sets[0] = {0, 1};
  scene->instances.push_back(scene->instances[0]);
  scene->instances[1].object_to_world.translation.x = 1.0f;
  const LightSet lights(scene, LightSampling::TREE);
  EXPECT_EQ(lights.emitter_count(), 8u);
  EXPECT_FALSE(lights.emitter_of(0, 0));
  EXPECT_EQ(lights.emitter_of(0, 3), 1u);
  EXPECT_EQ(lights.emitter_of(1, 9), 7u);  // slots beyond the set take its last material
}

TEST(LightSet, InstancesThatScatteredRaysDoNotSeeLeaveOthersOfTheMeshAlone) {
  Scene scene;
  add_mesh(scene, scattered_triangles(1, 3, 1.0f, 0.1f), constant_emission({1, 1, 1}));
  scene.instances.push_back(scene.instances[0]);
  scene.instances[0].visibility = kVisibleToCamera;
  const LightSet lights(std::make_shared<Scene>(scene), LightSampling::TREE);
  EXPECT_EQ(lights.emitter_count(), 3u);
  EXPECT_EQ(lights.emitter_of(0, 0), std::nullopt);
  EXPECT_EQ(lights.emitter_of(1, 2), 2u);
}

TEST(LightSet, ProbabilitiesSumToOne) {
  for (const LightSampling sampling : kSamplings) {
    const LightSet lights(full_scene(), sampling);
    Rng rng(1, 0, 0, 0);
    for (int i = 0; i < 100; ++i) {
      const Receiver r = random_receiver(rng);
      double sum = 0.0;
      for (uint32_t e = 0; e < kEmitterCount; ++e) sum += lights.pmf(e, r.position, r.n);
      EXPECT_NEAR(sum, 1.0, 1e-4);
    }
  }
}

double choice_p_value(const LightSet& lights, Receiver r, float planted_factor = 1.0f) {
  constexpr int kDraws = 40000;
  std::vector<double> observed(kEmitterCount), expected(kEmitterCount);
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < kDraws; ++i) {
    const auto choice = lights.choose(r.position, r.n, rng.next_float(), {});
    ++observed[choice->sample.emitter];
  }
  for (uint32_t e = 0; e < kEmitterCount; ++e) expected[e] = kDraws * double{lights.pmf(e, r.position, r.n)};
  expected[kEmitterCount - 1] *= planted_factor;
  return chi_square_p_value(observed, expected);
}

TEST(LightSet, DrawsWithItsProbabilities) {
  const double rate = shared_rate(10);
  for (const LightSampling sampling : kSamplings) {
    const LightSet lights(full_scene(), sampling);
    Rng rng(3, 0, 0, 0);
    for (int i = 0; i < 3; ++i) EXPECT_GT(choice_p_value(lights, random_receiver(rng)), rate);
  }
  const LightSet lights(full_scene(), LightSampling::TREE);
  EXPECT_LT(choice_p_value(lights, {{0, 0, 0}, {}}, 0.8f), rate) << "planted: share of the environment";
}

TEST(LightSet, EveryContributionHasAProbability) {
  for (const LightSampling sampling : kSamplings) {
    const LightSet lights(full_scene(), sampling);
    Rng rng(4, 0, 0, 0);
    int lit = 0;
    for (int i = 0; i < 40000; ++i) {
      const Receiver r = random_receiver(rng);
      const auto e = std::min(static_cast<uint32_t>(rng.next_float() * kEmitterCount), kEmitterCount - 1);
      const auto light = lights.evaluate({e, rng.next_vec2()}, r.position, {});
      if (!light || (r.n != Vec3{} && dot(r.n, light->wi) <= 0.0f)) continue;
      ++lit;
      EXPECT_GT(lights.pmf(e, r.position, r.n), 0.0f);
    }
    EXPECT_GT(lit, 10000);
  }
}

/// Light arriving at a point that takes it from all sides alike, unoccluded: the same for every sampler.
TEST(LightSet, SamplersAgree) {
  const Receiver r{{0.2f, 0.1f, -1.0f}, {0, 0, 1}};
  std::vector<Moments> estimates;
  for (const LightSampling sampling : kSamplings) {
    const LightSet lights(full_scene(), sampling);
    Moments moments;
    Rng rng(5, 0, 0, 0);
    for (int i = 0; i < 100000; ++i) {
      const auto choice = lights.choose(r.position, r.n, rng.next_float(), rng.next_vec2());
      const auto light = lights.evaluate(choice->sample, r.position, {});
      const float cosine = light ? std::max(dot(light->wi, r.n), 0.0f) : 0.0f;
      moments.add(light ? light->radiance.r * cosine / (light->pdf * choice->pmf) : 0.0);
    }
    estimates.push_back(moments);
  }
  const double rate = shared_rate(2);
  EXPECT_GT(same_mean_p_value(estimates[0], estimates[1]), rate);
  EXPECT_GT(same_mean_p_value(estimates[0], estimates[2]), rate);
  EXPECT_LT(estimates[2].variance(), estimates[0].variance());
}

/// What next-event estimation finds, a scattered ray finds with the same radiance and density.
TEST(LightSet, RaysAndSamplesAgree) {
  const auto scene = full_scene();
  const LightSet lights(scene, LightSampling::TREE);
  Rng rng(6, 0, 0, 0);
  std::vector<LampHit> hits;
  int lamps = 0, lost = 0, triangles = 0, skies = 0, strays = 0;
  for (int i = 0; i < 20000; ++i) {
    const Receiver r = random_receiver(rng);
    const auto choice = lights.choose(r.position, r.n, rng.next_float(), rng.next_vec2());
    const auto light = lights.evaluate(choice->sample, r.position, {});
    if (!light || light->is_delta) continue;
    const uint32_t e = choice->sample.emitter;
    if (e < kLampCount) {
      hits.clear();
      lights.intersect_lamps(Ray{r.position, light->wi}, PathState{kVisibleToDiffuse}, hits);
      const auto hit = std::find_if(hits.begin(), hits.end(), [&](const LampHit& h) { return h.emitter == e; });
      if (hit == hits.end()) {
        ++lost;
        continue;
      }
      ++lamps;
      EXPECT_NEAR(hit->pdf / light->pdf, 1.0f, 5e-3f);
    } else if (e < kEmitterCount - 1) {
      ++triangles;
      const uint32_t k = e - kLampCount;
      SurfacePoint point;
      point.position = r.position + light->wi * light->distance;
      point.instance = k < 60 ? 0 : 1;
      point.triangle = k < 60 ? k : k - 60;
      EXPECT_EQ(lights.emitter_of(point.instance, point.triangle), e);
      EXPECT_NEAR(lights.surface_pdf(point, r.position) / light->pdf, 1.0f, 1e-2f);
    } else {
      ++skies;
      // Directions on the edge of a texel may be looked up in its neighbour, by rounding.
      strays += std::abs(lights.environment_pdf(light->wi, r.position) / light->pdf - 1.0f) > 1e-3f;
    }
  }
  EXPECT_LT(lost, 20);
  EXPECT_GT(lamps, 1000);
  EXPECT_GT(triangles, 1000);
  EXPECT_GT(skies, 500);
  EXPECT_LT(strays, skies / 100);
}

TEST(LightSet, OneSidedEmissionLightsOneSide) {
  auto scene = std::make_shared<Scene>();
  auto mesh = std::make_shared<Mesh>();
  mesh->positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh->vertices = {{0, 1, 2}};
  for (const Vec3 p : mesh->positions) mesh->bounds.extend(p);
  for (const bool is_mirrored : {false, true}) {
    Scene one = *scene;
    add_mesh(one, mesh, one_sided_emission(), {{is_mirrored ? -1.0f : 1.0f, 0, 0}, {0, 1, 0}, {0, 0, 1}, {}});
    const LightSet lights(std::make_shared<Scene>(one), LightSampling::TREE);
    EXPECT_TRUE(lights.evaluate({0, {0.5f, 0.4f}}, {0, 0, 2}, {})) << is_mirrored;
    EXPECT_FALSE(lights.evaluate({0, {0.5f, 0.4f}}, {0, 0, -2}, {})) << is_mirrored;
  }
}

TEST(LightSet, TheTreeLeavesOutWhatTurnsItsDarkSide) {
  auto mesh = std::make_shared<Mesh>();
  mesh->positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh->vertices = {{0, 1, 2}, {0, 2, 1}};  // back to back
  for (const Vec3 p : mesh->positions) mesh->bounds.extend(p);
  for (const bool is_mirrored : {false, true}) {
    auto scene = std::make_shared<Scene>();
    add_mesh(*scene, mesh, one_sided_emission(), {{is_mirrored ? -1.0f : 1.0f, 0, 0}, {0, 1, 0}, {0, 0, 1}, {}});
    const LightSet lights(scene, LightSampling::TREE);
    for (const Vec3 receiver : {Vec3{0.1f, 0.2f, 2.0f}, Vec3{0.1f, 0.2f, -2.0f}}) {
      const bool is_above = receiver.z > 0.0f;
      for (uint32_t e = 0; e < 2; ++e) {
        const bool is_lit = (e == 0) == is_above;
        EXPECT_EQ(lights.evaluate({e, {0.5f, 0.4f}}, receiver, {}).has_value(), is_lit) << is_mirrored;
        EXPECT_FLOAT_EQ(lights.pmf(e, receiver, {}), is_lit ? 1.0f : 0.0f) << is_mirrored;
      }
    }
  }
}

/// Emission that varies over an object is evaluated where it is met; all other is known beforehand, and the same.
TEST(LightSet, UniformEmissionIsThatOfTheProgram) {
  auto scene = std::make_shared<Scene>();
  const auto by_object = [] {
    ProgramWriter writer;
    return writer.emit(writer.constant(Vec3{1.0f, 2.0f, 3.0f}), writer.add(Op::OBJECT_RANDOM, {}));
  }();
  const auto by_place = [] {
    ProgramWriter writer;
    return writer.emit(writer.add(Op::POSITION, {}), writer.constant(1.0f));
  }();
  EXPECT_TRUE(by_object->emission_is_uniform && !by_object->emission_is_constant);
  EXPECT_FALSE(by_place->emission_is_uniform);
  for (const auto& material : {by_object, by_object, by_place, one_sided_emission()})
    add_mesh(*scene, scattered_triangles(scene->instances.size(), 4, 1.0f, 0.5f), material);
  for (size_t i = 0; i < scene->instances.size(); ++i) scene->instances[i].random = 0.2f + 0.1f * static_cast<float>(i);
  const LightSet lights(scene, LightSampling::TREE);
  Rng rng(9, 0, 0, 0);
  for (int i = 0; i < 400; ++i) {
    const auto e = std::min(static_cast<uint32_t>(rng.next_float() * 16.0f), 15u);
    const Vec3 receiver{4.0f * rng.next_float(), 2.0f, 4.0f * rng.next_float() - 2.0f};
    const auto light = lights.evaluate({e, rng.next_vec2()}, receiver, {});
    if (!light) continue;
    const auto triangle = lights.triangle_of(e);
    const Mesh& mesh = *scene->meshes[static_cast<size_t>(scene->instances[triangle->instance].mesh)];
    const TriangleIndices& v = mesh.vertices[triangle->triangle];
    const Vec3 normal = cross(mesh.positions[v[1]] - mesh.positions[v[0]], mesh.positions[v[2]] - mesh.positions[v[0]]);
    SurfacePoint point;
    point.instance = triangle->instance;
    point.triangle = triangle->triangle;
    point.material = scene->material_of(scene->instances[point.instance], point.triangle);
    point.position = receiver + light->wi * light->distance;
    point.wo = -light->wi;
    point.is_backface = dot(normal, point.wo) < 0.0f;
    const Rgb expected = evaluate_emission(*scene, point, {});
    EXPECT_NEAR(light->radiance.r, expected.r, 1e-4f);
    EXPECT_NEAR(light->radiance.b, expected.b, 1e-4f);
  }
}

/// Where an instance begins with a triangle whose emission varies, what is known of the one before must not stay.
TEST(LightSet, UniformEmissionIsThatOfItsInstance) {
  auto mesh = std::make_shared<Mesh>(*scattered_triangles(3, 2, 1.0f, 0.5f));
  mesh->material_slots = {0, 1};
  ProgramWriter varying, uniform;
  const auto by_place = varying.emit(varying.add(Op::POSITION, {}), varying.constant(1.0f));
  const auto by_object = uniform.emit(Vec3{1.0f, 1.0f, 1.0f}, uniform.add(Op::OBJECT_RANDOM, {}));
  auto scene = std::make_shared<Scene>();
  for (const float random : {0.25f, 0.75f}) {
    add_mesh(*scene, mesh, by_place);
    scene->materials.push_back(by_object);
    scene->material_sets.back().push_back(static_cast<int>(scene->materials.size()) - 1);
    scene->instances.back().random = random;
  }
  const LightSet lights(scene, LightSampling::TREE);
  ASSERT_EQ(lights.emitter_count(), 4u);
  for (uint32_t instance = 0; instance < 2; ++instance) {
    const auto light = lights.evaluate({2 * instance + 1, {0.5f, 0.4f}}, {0.3f, 0.2f, 7.0f}, {});
    ASSERT_TRUE(light);
    EXPECT_FLOAT_EQ(light->radiance.g, scene->instances[instance].random);
  }
}

TEST(LightSet, LampsThatTakeLightAwayAreEmitters) {
  auto scene = std::make_shared<Scene>();
  scene->lights = {make_light(PointLight{{0, 0, 1}, 0.5f, Rgb(-1.0f), false}),
                   make_light(PointLight{{0, 0, 1}, 0.5f, Rgb(0.0f), false}),
                   make_light(PointLight{{0, 0, 1}, 0.5f, {0.7152f, -0.2126f, 0.0f}, false})};  // luminance 0
  const LightSet lights(scene, LightSampling::TREE);
  ASSERT_EQ(lights.emitter_count(), 2u);
  for (uint32_t i = 0; i < 2; ++i) EXPECT_GT(lights.pmf(i, {}, {0, 0, 1}), 0.1f);
  const auto light = lights.evaluate({0, {0.5f, 0.5f}}, {}, {});
  ASSERT_TRUE(light);
  EXPECT_LT(light->radiance.g, 0.0f);
}

TEST(LightSet, LampFlagsReachTheCaller) {
  auto scene = std::make_shared<Scene>();
  scene->lights = {make_light(PointLight{{0, 0, 1}, 0.5f, Rgb(1.0f), false})};
  Light& light = scene->lights[0];
  light.max_bounces = 2, light.casts_shadow = false, light.visibility = kVisibleToGlossy;
  const LightSet lights(scene, LightSampling::TREE);
  PathState path;
  path.depth = 3;  // two bounces to the receiver and the one there
  const auto incident = lights.evaluate({0, {0.5f, 0.5f}}, {}, path);
  ASSERT_TRUE(incident);
  EXPECT_FALSE(incident->casts_shadow);
  EXPECT_TRUE(incident->use_mis);
  EXPECT_EQ(incident->visibility, kVisibleToGlossy);
  path.depth = 4;
  EXPECT_FALSE(lights.evaluate({0, {0.5f, 0.5f}}, {}, path));

  std::vector<LampHit> hits;
  lights.intersect_lamps(Ray{{}, {0, 0, 1}}, PathState{kVisibleToDiffuse}, hits);
  EXPECT_TRUE(hits.empty());
  lights.intersect_lamps(Ray{{}, {0, 0, 1}}, PathState{kVisibleToGlossy}, hits);
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_EQ(hits[0].max_bounces, 2);
  EXPECT_FALSE(hits[0].casts_shadow);
  EXPECT_FLOAT_EQ(hits[0].distance, 0.5f);

  EXPECT_TRUE(lights.has_visible_lamps_without_shadow());

  auto without_mis = std::make_shared<Scene>(*scene);
  without_mis->lights[0].use_mis = false;
  const LightSet unseen(without_mis, LightSampling::TREE);
  EXPECT_FALSE(unseen.has_visible_lamps());
  EXPECT_FALSE(unseen.has_visible_lamps_without_shadow());
}

TEST(LightSet, LampMaterialsMultiply) {
  auto scene = std::make_shared<Scene>();
  add_mesh(*scene, scattered_triangles(1, 1, 1.0f, 1.0f), constant_emission({0, 0, 0}));
  scene->materials.push_back(constant_emission({2, 3, 4}));
  ProgramWriter w;
  const Operand z = w.add(Op::SEPARATE_Z, {w.add(Op::POSITION, {}, {0})});
  scene->materials.push_back(w.emit({1, 1, 1}, z));
  const Light plain = make_light(PointLight{{0, 0, 2}, 0.0f, Rgb(4.0f), true});
  scene->lights = {plain, plain};
  scene->lights[0].material = 1, scene->lights[1].material = 2;
  const LightSet lights(scene, LightSampling::POWER);
  EXPECT_EQ(lights.evaluate({0, {}}, {}, {})->radiance, Rgb(2.0f, 3.0f, 4.0f));
  EXPECT_FLOAT_EQ(lights.evaluate({1, {}}, {}, {})->radiance.g, 2.0f);
}

TEST(LightSet, ManyLampsAreFoundAsInALoop) {
  auto scene = std::make_shared<Scene>();
  Rng rng(7, 0, 0, 0);
  for (int i = 0; i < 300; ++i) {
    scene->lights.push_back(
        make_light(PointLight{random_receiver(rng).position, 0.1f + 0.4f * rng.next_float(), Rgb(1.0f), i % 2 == 0}));
  }
  const LightSet lights(scene, LightSampling::POWER);
  std::vector<LampHit> hits, looped;
  size_t found = 0;
  for (int i = 0; i < 2000; ++i) {
    const Ray ray{random_receiver(rng).position, square_to_sphere(rng.next_vec2()), 0.0f, i % 2 ? INFINITY : 3.0f};
    hits.clear();
    lights.intersect_lamps(ray, PathState{kVisibleToDiffuse}, hits);
    looped.clear();
    for (const Light& light : scene->lights) {
      auto alone = std::make_shared<Scene>();
      const PointLight& p = std::get<PointLight>(light.shape);
      const Vec3 to_center = p.position - ray.origin;
      // Only lamps near the ray's line can be hit; building a set for each of the others would be slow.
      if (length(cross(to_center, ray.direction)) > p.radius * 1.01f) continue;
      alone->lights = {light};
      LightSet(alone, LightSampling::UNIFORM).intersect_lamps(ray, PathState{kVisibleToDiffuse}, looped);
    }
    ASSERT_EQ(hits.size(), looped.size());
    for (size_t k = 0; k < hits.size(); ++k) EXPECT_EQ(hits[k].distance, looped[k].distance);
    found += hits.size();
  }
  EXPECT_GT(found, 1000u);
}

TEST(LightSet, MemoryPerTriangleIsStated) {
  auto scene = std::make_shared<Scene>();
  constexpr uint32_t kCount = 20000;
  add_mesh(*scene, scattered_triangles(8, kCount, 50.0f, 0.3f), constant_emission({1, 1, 1}));
  EXPECT_LT(LightSet(scene, LightSampling::TREE).memory_bytes(), kCount * size_t{185});
  EXPECT_LT(LightSet(scene, LightSampling::POWER).memory_bytes(), kCount * size_t{75});
}

}  // namespace
}  // namespace cistern::test
