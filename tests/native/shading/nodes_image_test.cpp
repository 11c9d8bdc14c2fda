#include "shading/nodes_image.h"

#include <gtest/gtest.h>

#include <limits>

#include "shading/nodes_scene.h"

namespace cistern {
namespace {

/// One row of two grey texels.
std::shared_ptr<const Image> make_tile(float left, float right) {
  auto image = std::make_shared<Image>();
  image->name = "tile";
  image->width = 2, image->height = 1, image->channels = 1;
  image->format = PixelFormat::FLOAT;
  const auto kept = std::make_shared<std::vector<float>>(std::vector<float>{left, right});
  image->pixels = std::shared_ptr<const void>(kept, kept->data());
  return image;
}

constexpr int32_t kStaysMultiplied = 1 << 16;  // by alpha; of IMAGE's projection

/// What tiles 1001 (grey 1, 2), 1002 (3, 4), 1003 (missing) and 1012 (5, 6) give at (u, v).
class TiledImage : public ::testing::Test {
 protected:
  Texel at(float u, float v, Extension extension = Extension::REPEAT,
           Interpolation interpolation = Interpolation::CLOSEST) const {
    const int32_t parameters[] = {0, static_cast<int32_t>(interpolation), static_cast<int32_t>(extension),
                                  kStaysMultiplied};
    return tiled_image_node({scene_, program_, point_, path_, true}, parameters, {u, v, 0.0f}, {});
  }

  MaterialProgram make_program() const {
    MaterialProgram program;
    program.images = {2, 0, 1};
    program.tile_tables = {std::vector<int>(12, -1)};
    program.tile_tables[0][0] = 1, program.tile_tables[0][1] = 2, program.tile_tables[0][11] = 0;
    return program;
  }

  static bool is_missing(const Texel& texel) { return texel.color == Rgb(1.0f, 0.0f, 1.0f) && texel.alpha == 1.0f; }

  Scene scene_ = [] {
    Scene scene;
    scene.images = {make_tile(1.0f, 2.0f), make_tile(3.0f, 4.0f), make_tile(5.0f, 6.0f)};
    return scene;
  }();
  MaterialProgram program_ = make_program();
  SurfacePoint point_;
  PathState path_;
};

TEST_F(TiledImage, TheWholePartChoosesTheTile) {
  EXPECT_EQ(at(0.2f, 0.5f).color.r, 1.0f);
  EXPECT_EQ(at(0.8f, 0.5f).color.r, 2.0f);
  EXPECT_EQ(at(1.0f, 0.0f).color.r, 3.0f);
  EXPECT_EQ(at(1.8f, 0.99f).color.r, 4.0f);
  EXPECT_EQ(at(1.2f, 1.0f).color.r, 5.0f);
  EXPECT_EQ(at(1.8f, 1.5f).color.r, 6.0f);
}

TEST_F(TiledImage, WhatIsNotThereIsMagenta) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), huge = 3e38f;
  const Vec2 outside[] = {{2.5f, 0.5f},  {0.5f, 1.5f}, {9.5f, 99.5f}, {10.0f, 0.5f}, {0.5f, 100.0f}, {-1.0f, 0.5f},
                          {0.5f, -1.0f}, {huge, 0.5f}, {-huge, 0.5f}, {0.5f, huge},  {nan, 0.5f},    {0.5f, nan}};
  for (const Vec2 uv : outside) EXPECT_TRUE(is_missing(at(uv.x, uv.y))) << uv.x << " " << uv.y;
}

TEST_F(TiledImage, ExtensionsApplyInTheTileAlone) {
  const Interpolation linear = Interpolation::LINEAR;
  EXPECT_NEAR(at(1.0f, 0.5f, Extension::REPEAT, linear).color.r, 3.5f, 1e-5f);  // its own other end
  EXPECT_NEAR(at(1.0f, 0.5f, Extension::EXTEND, linear).color.r, 3.0f, 1e-5f);
  EXPECT_NEAR(at(1.0f, 0.5f, Extension::CLIP, linear).color.r, 1.5f, 1e-5f);
  // below 0, down to -1, as Cycles 5.0 has it
  EXPECT_EQ(at(-0.2f, 0.5f).color.r, 2.0f);
  EXPECT_EQ(at(-0.2f, 0.5f, Extension::EXTEND).color.r, 1.0f);
  EXPECT_EQ(at(-0.2f, 0.5f, Extension::CLIP).alpha, 0.0f);
}

}  // namespace
}  // namespace cistern
