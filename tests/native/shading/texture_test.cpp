#include "shading/texture.h"

#include <gtest/gtest.h>
#include <immintrin.h>

namespace cistern {
namespace {

template <typename T>
Image make_image(int width, int height, int channels, PixelFormat format, const std::vector<T>& values) {
  Image image;
  image.name = "test";
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.format = format;
  const auto kept = std::make_shared<std::vector<T>>(values);
  image.pixels = std::shared_ptr<const void>(kept, kept->data());
  return image;
}

/// One row of grey texels 1, 2, 4.
Image row_image() { return make_image<float>(3, 1, 1, PixelFormat::FLOAT, {1.0f, 2.0f, 4.0f}); }

float grey(const Image& image, float u, Extension extension, Interpolation interpolation = Interpolation::LINEAR) {
  return lookup_image(image, u, 0.5f, interpolation, extension, ColorAlpha::MULTIPLIED).color.r;
}

TEST(Texture, BilinearAgainstHandComputedValues) {
  const Image image = make_image<float>(2, 2, 1, PixelFormat::FLOAT, {0.0f, 1.0f, 2.0f, 5.0f});  // row 0 is the bottom
  const auto at = [&](float u, float v) {
    return lookup_image(image, u, v, Interpolation::LINEAR, Extension::EXTEND).color.r;
  };
  EXPECT_FLOAT_EQ(at(0.25f, 0.25f), 0.0f);
  EXPECT_FLOAT_EQ(at(0.75f, 0.25f), 1.0f);
  EXPECT_FLOAT_EQ(at(0.25f, 0.75f), 2.0f);
  EXPECT_FLOAT_EQ(at(0.5f, 0.5f), 2.0f);
  // weights 3/4, 1/4 along u and 1/4, 3/4 along v
  EXPECT_FLOAT_EQ(at(0.375f, 0.625f), 0.25f * (0.75f * 0.0f + 0.25f * 1.0f) + 0.75f * (0.75f * 2.0f + 0.25f * 5.0f));
  EXPECT_FLOAT_EQ(at(-3.0f, -3.0f), 0.0f);
  EXPECT_FLOAT_EQ(at(9.0f, 9.0f), 5.0f);
}

TEST(Texture, ExtensionModes) {
  const Image image = row_image();
  const float third = 1.0f / 3.0f;
  // u = 1: half way between the last texel and the one after it
  EXPECT_NEAR(grey(image, 1.0f, Extension::REPEAT), 2.5f, 1e-5f);
  EXPECT_NEAR(grey(image, 1.0f, Extension::EXTEND), 4.0f, 1e-5f);
  EXPECT_NEAR(grey(image, 1.0f, Extension::CLIP), 2.0f, 1e-5f);
  EXPECT_NEAR(grey(image, 1.0f, Extension::MIRROR), 4.0f, 1e-5f);
  // centres of texels -1 and 4
  EXPECT_NEAR(grey(image, -0.5f * third, Extension::REPEAT), 4.0f, 1e-4f);
  EXPECT_NEAR(grey(image, 4.5f * third, Extension::REPEAT), 2.0f, 1e-4f);
  EXPECT_NEAR(grey(image, -0.5f * third, Extension::MIRROR), 1.0f, 1e-4f);
  EXPECT_NEAR(grey(image, -1.5f * third, Extension::MIRROR), 2.0f, 1e-4f);
  EXPECT_NEAR(grey(image, 4.5f * third, Extension::MIRROR), 2.0f, 1e-4f);
  EXPECT_NEAR(grey(image, 6.5f * third, Extension::MIRROR), 1.0f, 1e-4f);
  EXPECT_NEAR(grey(image, -0.5f * third, Extension::CLIP), 0.0f, 1e-4f);
  const Texel outside = lookup_image(image, 2.0f, 0.5f, Interpolation::LINEAR, Extension::CLIP);
  EXPECT_EQ(outside.alpha, 0.0f);
  EXPECT_EQ(outside.color, Rgb());
}

TEST(Texture, ClosestTakesTheTexelThatCovers) {
  const Image image = row_image();
  for (const Extension extension : {Extension::REPEAT, Extension::EXTEND, Extension::CLIP, Extension::MIRROR}) {
    EXPECT_EQ(grey(image, 0.32f, extension, Interpolation::CLOSEST), 1.0f);
    EXPECT_EQ(grey(image, 0.34f, extension, Interpolation::CLOSEST), 2.0f);
  }
  EXPECT_EQ(grey(image, -0.01f, Extension::REPEAT, Interpolation::CLOSEST), 4.0f);
  EXPECT_EQ(grey(image, -0.01f, Extension::CLIP, Interpolation::CLOSEST), 0.0f);
}

TEST(Texture, CubicIsTheBSpline) {
  // at a texel centre: (left + 4 middle + right) / 6
  EXPECT_NEAR(grey(row_image(), 0.5f, Extension::EXTEND, Interpolation::CUBIC), (1.0f + 8.0f + 4.0f) / 6.0f, 1e-5f);
  // half way between two texels: (1, 23, 23, 1) / 48
  EXPECT_NEAR(grey(row_image(), 2.0f / 3.0f, Extension::EXTEND, Interpolation::CUBIC),
              (1.0f + 23.0f * 2.0f + 23.0f * 4.0f + 4.0f) / 48.0f, 1e-5f);
}

TEST(Texture, FormatsAgree) {
  const Image u8 = make_image<uint8_t>(1, 1, 4, PixelFormat::U8, {51, 102, 255, 127});
  const Image u16 = make_image<uint16_t>(1, 1, 4, PixelFormat::U16, {13107, 26214, 65535, 32639});
  const Image half = make_image<uint16_t>(
      1, 1, 4, PixelFormat::HALF,
      {static_cast<uint16_t>(_cvtss_sh(0.2f, 0)), static_cast<uint16_t>(_cvtss_sh(0.4f, 0)),
       static_cast<uint16_t>(_cvtss_sh(1.0f, 0)), static_cast<uint16_t>(_cvtss_sh(127.0f / 255.0f, 0))});
  for (const Image& image : {u8, u16, half}) {
    const Texel t = lookup_image(image, 0.3f, 0.7f, Interpolation::LINEAR, Extension::REPEAT);
    EXPECT_NEAR(t.color.r, 0.2f, 2e-4f);
    EXPECT_NEAR(t.color.g, 0.4f, 4e-4f);
    EXPECT_NEAR(t.color.b, 1.0f, 1e-6f);
    EXPECT_NEAR(t.alpha, 127.0f / 255.0f, 3e-4f);
  }
}

TEST(Texture, SrgbCurveIsAccurate) {
  double worst = 0.0;
  for (int i = 0; i <= 65535; ++i) {
    const Image image = make_image<uint16_t>(1, 1, 1, PixelFormat::U16, {static_cast<uint16_t>(i)});
    Image encoded = image;
    encoded.transfer = TransferCurve::SRGB;
    const double c = i / 65535.0;
    const double exact = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    const float found = lookup_image(encoded, 0.5f, 0.5f, Interpolation::CLOSEST, Extension::EXTEND).color.r;
    worst = std::max(worst, std::abs(static_cast<double>(found) - exact));
  }
  EXPECT_LT(worst, 1e-5);
}

TEST(Texture, DecodesAfterFilteringAndAfterUnpremultiplying) {
  Image image = make_image<uint8_t>(2, 1, 4, PixelFormat::U8, {0, 0, 0, 0, 102, 102, 102, 102});
  image.transfer = TransferCurve::SRGB;
  image.alpha = AlphaMode::PREMULTIPLIED;
  // half way: stored colour 0.2 and alpha 0.2, colour 1 after division
  const Texel t = lookup_image(image, 0.5f, 0.5f, Interpolation::LINEAR, Extension::EXTEND);
  EXPECT_NEAR(t.alpha, 0.2f, 1e-6f);
  EXPECT_NEAR(t.color.r, 1.0f, 1e-5f);
  const auto half_way = [&](AlphaMode alpha, ColorAlpha color_alpha) {
    image.alpha = alpha;
    return lookup_image(image, 0.5f, 0.5f, Interpolation::LINEAR, Extension::EXTEND, color_alpha);
  };
  constexpr float kLinear02 = 0.0331048f, kLinear008 = 0.0071944f, kLinear04 = 0.1328683f;
  EXPECT_NEAR(half_way(AlphaMode::PREMULTIPLIED, ColorAlpha::MULTIPLIED).color.r, kLinear02, 1e-5f);
  // the transparent black texel does not darken: (0 + 0.4 * 0.4) / 2 over 0.2
  EXPECT_NEAR(half_way(AlphaMode::STRAIGHT, ColorAlpha::DIVIDED).color.r, kLinear04, 1e-5f);
  EXPECT_NEAR(half_way(AlphaMode::STRAIGHT, ColorAlpha::MULTIPLIED).color.r, kLinear008, 1e-5f);
  EXPECT_NEAR(half_way(AlphaMode::INDEPENDENT, ColorAlpha::DIVIDED).color.r, kLinear02, 1e-5f);
  EXPECT_NEAR(half_way(AlphaMode::IGNORED, ColorAlpha::DIVIDED).color.r, kLinear02, 1e-5f);
  EXPECT_EQ(half_way(AlphaMode::IGNORED, ColorAlpha::DIVIDED).alpha, 1.0f);
}

TEST(Texture, ColourMatrixIsAppliedToLinearValues) {
  Image image = make_image<float>(1, 1, 3, PixelFormat::FLOAT, {1.0f, 2.0f, 3.0f});
  image.has_colour_matrix = true;
  image.to_working_space = {0, 1, 0, 0, 0, 1, 2, 0, 0};
  EXPECT_EQ(lookup_image(image, 0.1f, 0.1f, Interpolation::LINEAR, Extension::REPEAT).color, Rgb(2.0f, 3.0f, 2.0f));
}

TEST(Texture, StrangeCoordinatesAreSafe) {
  const Image image = row_image();
  for (const float bad : {NAN, INFINITY, -INFINITY, 1e30f, -1e30f})
    for (const Extension e : {Extension::REPEAT, Extension::EXTEND, Extension::CLIP, Extension::MIRROR})
      for (const Interpolation i : {Interpolation::LINEAR, Interpolation::CLOSEST, Interpolation::CUBIC}) {
        const Texel t = lookup_image(image, bad, bad, i, e);
        EXPECT_TRUE(is_finite(t.color));
      }
}

TEST(Texture, EquirectangularLooksAlongXInTheMiddle) {
  std::vector<float> values;  // 8 x 4, value = column + 10 row
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 8; ++x) values.push_back(static_cast<float>(x + 10 * y));
  const Image image = make_image<float>(8, 4, 1, PixelFormat::FLOAT, values);
  const auto at = [&](Vec3 d) { return lookup_equirectangular(image, d, Interpolation::LINEAR).color.r; };
  EXPECT_NEAR(at({1.0f, 0.0f, 0.0f}), 3.5f + 15.0f, 1e-4f);   // u = 1/2, v = 1/2
  EXPECT_NEAR(at({0.0f, 2.0f, 0.0f}), 1.5f + 15.0f, 1e-4f);   // u = 1/4
  EXPECT_NEAR(at({0.0f, -1.0f, 0.0f}), 5.5f + 15.0f, 1e-4f);  // u = 3/4
  EXPECT_NEAR(at({1.0f, 0.0f, 1.0f}), 3.5f + 25.0f, 1e-4f);   // v = 3/4: looking up reads higher rows
  EXPECT_TRUE(std::isfinite(at({0.0f, 0.0f, 0.0f})));
}

TEST(Texture, HorizonLookupHasDenseRowsThereAndExtendsAtThePoles) {
  std::vector<float> rows(64);
  for (int y = 0; y < 64; ++y) rows[static_cast<size_t>(y)] = static_cast<float>(y);
  const Image image = make_image<float>(1, 64, 1, PixelFormat::FLOAT, rows);
  const auto row_at = [&](float elevation) {
    return lookup_horizon(image, {0.0f, std::cos(elevation), std::sin(elevation)}, Interpolation::LINEAR).color.r;
  };
  EXPECT_NEAR(row_at(0.0f), 31.5f, 1e-3f);
  EXPECT_NEAR(row_at(kPi / 8.0f), 47.5f, 1e-3f);  // a quarter of the way up, half of the rows
  EXPECT_NEAR(row_at(-kPi / 8.0f), 15.5f, 1e-3f);
  EXPECT_NEAR(row_at(kPi / 2.0f), 63.0f, 1e-2f);
  EXPECT_NEAR(row_at(-kPi / 2.0f), 0.0f, 1e-2f);
  const float high = lookup_horizon(image, {0.0f, 0.1f, 2.0f}, Interpolation::LINEAR).color.r;
  EXPECT_NEAR(high, 63.0f, 1e-2f) << "as in Cycles, the height of vectors longer than 1 is what counts";
}

}  // namespace
}  // namespace cistern
