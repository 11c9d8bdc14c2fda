#include "lights/coincident_triangles.h"

#include <gtest/gtest.h>

#include "lights/light_scenes.h"
#include "lights/light_set.h"

namespace cistern::test {
namespace {

constexpr uint32_t kCount = 20;

/// Triangles that glow, `copies` times in one place.
Scene stacked(int copies) {
  Scene scene;
  for (int i = 0; i < copies; ++i)
    add_mesh(scene, scattered_triangles(1, kCount, 1.0f, 0.4f), constant_emission({2, 2, 2}));
  return scene;
}

/// What samples of one emitter after the other send to a place, over their probabilities.
double light_of(const Scene& scene, LightSampling sampling) {
  const LightSet lights(std::make_shared<Scene>(scene), sampling);
  const Vec3 receiver{0, 0, 3}, n{0, 0, -1};
  PathState path;
  path.depth = 1;
  double sum = 0.0;
  for (uint32_t emitter = 0; emitter < lights.emitter_count(); ++emitter) {
    const auto light = lights.evaluate({emitter, {0.3f, 0.6f}}, receiver, path, {}, nullptr);
    if (!light) continue;
    EXPECT_GT(lights.pmf(emitter, receiver, n, kEveryLight), 0.0f);
    sum += magnitude(light->radiance) / light->pdf;
  }
  return sum;
}

/// Emitters that a light sample may choose.
uint32_t count_of(const Scene& scene) {
  const LightSet lights(std::make_shared<Scene>(scene), LightSampling::POWER);
  uint32_t count = 0;
  for (uint32_t emitter = 0; emitter < lights.emitter_count(); ++emitter) {
    count += lights.receiver_free_pmf(emitter) > 0.0f ? 1 : 0;
  }
  return count;
}

TEST(CoincidentTriangles, ShineOnce) {
  for (const LightSampling sampling : {LightSampling::UNIFORM, LightSampling::POWER, LightSampling::TREE}) {
    EXPECT_EQ(light_of(stacked(3), sampling), light_of(stacked(1), sampling));
  }
  EXPECT_EQ(count_of(stacked(3)), kCount);
}

TEST(CoincidentTriangles, AreFoundWhereverTheirCornersBegin) {
  Scene scene = stacked(2);
  Mesh turned = *scene.meshes[1];
  for (auto& vertices : turned.vertices) vertices = {vertices[2], vertices[0], vertices[1]};
  scene.meshes[1] = std::make_shared<Mesh>(turned);
  EXPECT_EQ(count_of(scene), kCount);
  for (auto& vertices : turned.vertices) std::swap(vertices[0], vertices[1]);
  scene.meshes[1] = std::make_shared<Mesh>(turned);
  EXPECT_EQ(count_of(scene), kCount) << "wound the other way";
  scene.materials[0] = scene.materials[1] = one_sided_emission();
  EXPECT_EQ(count_of(scene), 2 * kCount) << "and dark on one side";
}

/// Emission by the place, times an object's random number.
std::shared_ptr<const MaterialProgram> uneven_emission() {
  ProgramWriter w;
  const Operand height = w.add(Op::SEPARATE_Z, {w.add(Op::POSITION, {}, {0})});
  const Operand far = w.add(Op::MATH, {height, w.constant(4.0f), w.constant(0.0f)}, {0, 0});
  return w.emit({1, 1, 1}, w.add(Op::MATH, {far, w.add(Op::OBJECT_RANDOM, {}), w.constant(0.0f)}, {2, 0}));
}

TEST(CoincidentTriangles, OfUnevenEmissionAreJoinedWhereTheyLookAlike) {
  Scene scene = stacked(2);
  scene.materials.push_back(uneven_emission());
  scene.material_sets.push_back({static_cast<int>(scene.materials.size()) - 1});
  for (Instance& instance : scene.instances) {
    instance.material_set = static_cast<int>(scene.material_sets.size()) - 1;
    instance.random = 0.7f;
  }
  EXPECT_EQ(count_of(scene), kCount);
  Mesh turned = *scene.meshes[1];
  for (auto& vertices : turned.vertices) vertices = {vertices[2], vertices[1], vertices[0]};
  scene.meshes[1] = std::make_shared<Mesh>(turned);
  EXPECT_EQ(count_of(scene), kCount) << "wound the other way";
  scene.instances[1].light_group = 3;
  EXPECT_EQ(count_of(scene), 2 * kCount) << "of another light group";
  scene.instances[1].light_group = kNoLightGroup;
  scene.instances[1].random = 0.6f;
  EXPECT_EQ(count_of(scene), 2 * kCount) << "of another strength by the object";
}

TEST(CoincidentTriangles, StandForEachOther) {
  const LightSet lights(std::make_shared<Scene>(stacked(2)), LightSampling::TREE);
  for (uint32_t t = 0; t < kCount; ++t) {
    EXPECT_EQ(lights.emitter_of(0, t), t);
    EXPECT_EQ(lights.emitter_of(1, t), t);
  }
}

TEST(CoincidentTriangles, ThatSendOtherLightOrToOthersAreEachByItself) {
  Scene brighter = stacked(2);
  brighter.materials[1] = constant_emission({2, 2, 2.5f});
  EXPECT_EQ(count_of(brighter), 2 * kCount);
  Scene linked = stacked(2);
  linked.instances[1].links.lit = 2;
  EXPECT_EQ(count_of(linked), 2 * kCount);
  Scene hidden = stacked(2);
  hidden.instances[1].visibility = kVisibleToAll & ~kVisibleToDiffuse;
  EXPECT_EQ(count_of(hidden), 2 * kCount);
  Scene moved = stacked(2);
  moved.instances[1].object_to_world.translation.z = 1e-6f;
  EXPECT_GT(count_of(moved), kCount);
}

}  // namespace
}  // namespace cistern::test
