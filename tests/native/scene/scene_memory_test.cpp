#include "scene/scene_memory.h"

#include <gtest/gtest.h>

namespace cistern::test {
namespace {

TEST(SceneMemory, CountsWhatIsLargeAndSkipsWhatWasRemoved) {
  Scene scene;
  EXPECT_EQ(memory_bytes(scene), 0u);

  auto mesh = std::make_shared<Mesh>();
  mesh->vertices.resize(1000);
  scene.meshes = {nullptr, mesh};
  EXPECT_EQ(memory_bytes(scene), memory_bytes(*mesh));
  EXPECT_GE(memory_bytes(scene), 1000 * sizeof(TriangleIndices));

  const size_t before = memory_bytes(scene);
  auto image = std::make_shared<Image>();
  image->width = 64, image->height = 32, image->channels = 3;
  image->format = PixelFormat::HALF;
  scene.images = {image, nullptr};
  EXPECT_EQ(memory_bytes(scene) - before, 64u * 32 * 3 * 2);

  scene.instances.resize(10);
  EXPECT_GE(memory_bytes(scene) - before, 64u * 32 * 3 * 2 + 10 * sizeof(Instance));
}

}  // namespace
}  // namespace cistern::test
