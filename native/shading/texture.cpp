#include "shading/texture.h"

#include <immintrin.h>

#include <array>
#include <cstring>

#include "base/angle.h"
#include "base/srgb.h"

namespace cistern {
namespace {

/// Red, green, blue, alpha: one lane each.
using Rgba = __m128;

constexpr float kMaxTexel = 1e9f;  // coordinates beyond it, and NaN, read texel 0: they have no meaning as int

// --- Stored values ---

template <PixelFormat F>
float stored_value(const void* pixels, size_t i) {
  if constexpr (F == PixelFormat::U8)
    return static_cast<float>(static_cast<const uint8_t*>(pixels)[i]) * (1.0f / 255.0f);
  if constexpr (F == PixelFormat::U16)
    return static_cast<float>(static_cast<const uint16_t*>(pixels)[i]) * (1.0f / 65535.0f);
  if constexpr (F == PixelFormat::HALF) return _cvtsh_ss(static_cast<const uint16_t*>(pixels)[i]);
  if constexpr (F == PixelFormat::FLOAT) return static_cast<const float*>(pixels)[i];
}

/// Three channels from `i` on; the last lane is 0.
template <PixelFormat F>
Rgba three_channels(const void* pixels, size_t i) {
  if constexpr (F == PixelFormat::U8) {
    const uint8_t* p = static_cast<const uint8_t*>(pixels) + i;
    uint16_t low;
    std::memcpy(&low, p, sizeof(low));
    const __m128i bytes = _mm_cvtsi32_si128(low | p[2] << 16);
    return _mm_cvtepi32_ps(_mm_cvtepu8_epi32(bytes)) * _mm_set1_ps(1.0f / 255.0f);
  } else {
    return _mm_setr_ps(stored_value<F>(pixels, i), stored_value<F>(pixels, i + 1), stored_value<F>(pixels, i + 2),
                       0.0f);
  }
}

template <PixelFormat F>
Rgba four_channels(const void* pixels, size_t i) {
  if constexpr (F == PixelFormat::U8) {
    int32_t bytes;
    std::memcpy(&bytes, static_cast<const uint8_t*>(pixels) + i, sizeof(bytes));
    return _mm_cvtepi32_ps(_mm_cvtepu8_epi32(_mm_cvtsi32_si128(bytes))) * _mm_set1_ps(1.0f / 255.0f);
  } else if constexpr (F == PixelFormat::FLOAT) {
    return _mm_loadu_ps(static_cast<const float*>(pixels) + i);
  } else {
    return _mm_setr_ps(stored_value<F>(pixels, i), stored_value<F>(pixels, i + 1), stored_value<F>(pixels, i + 2),
                       stored_value<F>(pixels, i + 3));
  }
}

/// The texels of an image as filters read them. What all of them have in common is looked up once.
template <PixelFormat F>
class Texels {
 public:
  Texels(const Image& image, Extension extension)
      : pixels_(image.pixels.get()),
        width_(image.width),
        height_(image.height),
        channels_(image.channels),
        has_alpha_((channels_ == 2 || channels_ == 4) && image.alpha != AlphaMode::IGNORED),
        multiplies_(has_alpha_ && image.alpha == AlphaMode::STRAIGHT),
        clips_(extension == Extension::CLIP) {}

  /// Outside of the image, where CLIP alone asks: transparent black.
  Rgba operator()(int x, int y) const {
    if (clips_ && (x < 0 || y < 0 || x >= width_ || y >= height_)) return _mm_setzero_ps();
    const size_t i = (static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)) *
                     static_cast<size_t>(channels_);
    const Rgba color = read(i);
    if (!has_alpha_) return _mm_blend_ps(color, _mm_set1_ps(1.0f), kAlphaLane);
    return multiplies_ ? _mm_blend_ps(color * _mm_permute_ps(color, 0xff), color, kAlphaLane) : color;
  }

 private:
  static constexpr int kAlphaLane = 8;

  Rgba read(size_t i) const {
    if (channels_ == 4) return four_channels<F>(pixels_, i);
    if (channels_ == 3) return three_channels<F>(pixels_, i);
    const Rgba grey = _mm_set1_ps(stored_value<F>(pixels_, i));
    return has_alpha_ ? _mm_blend_ps(grey, _mm_set1_ps(stored_value<F>(pixels_, i + 1)), kAlphaLane) : grey;
  }

  const void* pixels_;
  int width_, height_, channels_;
  bool has_alpha_, multiplies_, clips_;
};

// --- Where texels lie ---

int wrap(int i, int size, Extension extension) {
  if (i >= 0 && i < size) return i;  // nearly always; spares the division below
  switch (extension) {
    case Extension::REPEAT: {
      const int m = i % size;
      return m < 0 ? m + size : m;
    }
    case Extension::EXTEND:
      return std::clamp(i, 0, size - 1);
    case Extension::MIRROR: {
      const int m = (i < 0 ? -(i + 1) : i) % (2 * size);
      return m < size ? m : 2 * size - 1 - m;
    }
    case Extension::CLIP:
      break;
  }
  return i;
}

struct TexelPosition {
  int index;
  float fraction;
};

TexelPosition texel_position(float coordinate) {
  if (!(std::abs(coordinate) < kMaxTexel)) return {0, 0.0f};
  const float whole = std::floor(coordinate);
  return {static_cast<int>(whole), coordinate - whole};
}

// --- Filters ---

template <PixelFormat F>
Rgba filter_closest(const Image& image, float u, float v, Extension extension) {
  const Texels<F> texels(image, extension);
  const int x = wrap(texel_position(u * static_cast<float>(image.width)).index, image.width, extension);
  const int y = wrap(texel_position(v * static_cast<float>(image.height)).index, image.height, extension);
  return texels(x, y);
}

/// Bilinear; texel centres lie at half-integers.
template <PixelFormat F>
Rgba filter_linear(const Image& image, float u, float v, Extension extension) {
  const Texels<F> texels(image, extension);
  const TexelPosition px = texel_position(u * static_cast<float>(image.width) - 0.5f);
  const TexelPosition py = texel_position(v * static_cast<float>(image.height) - 0.5f);
  const int x0 = wrap(px.index, image.width, extension), x1 = wrap(px.index + 1, image.width, extension);
  const int y0 = wrap(py.index, image.height, extension), y1 = wrap(py.index + 1, image.height, extension);
  const float tx = px.fraction, ty = py.fraction;
  const auto row = [&](int y) { return (1.0f - tx) * texels(x0, y) + tx * texels(x1, y); };
  return (1.0f - ty) * row(y0) + ty * row(y1);
}

/// Uniform cubic B-spline: smooths, never overshoots.
std::array<float, 4> spline_weights(float t) {
  const float t2 = t * t, t3 = t2 * t;
  return {(1.0f - 3.0f * t + 3.0f * t2 - t3) / 6.0f, (4.0f - 6.0f * t2 + 3.0f * t3) / 6.0f,
          (1.0f + 3.0f * t + 3.0f * t2 - 3.0f * t3) / 6.0f, t3 / 6.0f};
}

template <PixelFormat F>
Rgba filter_cubic(const Image& image, float u, float v, Extension extension) {
  const Texels<F> texels(image, extension);
  const TexelPosition px = texel_position(u * static_cast<float>(image.width) - 0.5f);
  const TexelPosition py = texel_position(v * static_cast<float>(image.height) - 0.5f);
  const std::array<float, 4> wx = spline_weights(px.fraction), wy = spline_weights(py.fraction);
  Rgba sum = _mm_setzero_ps();
  for (int j = 0; j < 4; ++j) {
    const int y = wrap(py.index + j - 1, image.height, extension);
    Rgba row = _mm_setzero_ps();
    for (int i = 0; i < 4; ++i) {
      const int x = wrap(px.index + i - 1, image.width, extension);
      row = row + wx[static_cast<size_t>(i)] * texels(x, y);
    }
    sum = sum + wy[static_cast<size_t>(j)] * row;
  }
  return sum;
}

template <PixelFormat F>
Rgba filter(const Image& image, float u, float v, Interpolation interpolation, Extension extension) {
  switch (interpolation) {
    case Interpolation::LINEAR:
      return filter_linear<F>(image, u, v, extension);
    case Interpolation::CLOSEST:
      return filter_closest<F>(image, u, v, extension);
    default:
      return filter_cubic<F>(image, u, v, extension);
  }
}

// --- Decoding ---

// The curve's second derivative is below 3.1, so that linear interpolation is off by at most 3.1 / (8 * 512^2)
// = 1.5e-6.
constexpr int kCurveSegments = 512;

std::array<float, kCurveSegments + 1> make_srgb_curve() {
  std::array<float, kCurveSegments + 1> curve;
  for (size_t i = 0; i < curve.size(); ++i) curve[i] = srgb_to_linear_exact(static_cast<float>(i) / kCurveSegments);
  return curve;
}

/// Made on first use, not as the module is loaded (see nodes_blackbody.cpp).
const std::array<float, kCurveSegments + 1>& srgb_curve() {
  static const std::array<float, kCurveSegments + 1> curve = make_srgb_curve();
  return curve;
}

float srgb_to_linear(float c) {
  if (!(c > 0.0f && c < 1.0f)) return srgb_to_linear_exact(c);
  const float x = c * kCurveSegments;
  const size_t i = static_cast<size_t>(x);
  const auto& curve = srgb_curve();
  return lerp(curve[i], curve[i + 1], x - static_cast<float>(i));
}

/// From a filtered value. Encoded colours are divided by alpha before they are decoded, as in Cycles.
Texel decode(const Image& image, Rgba stored, ColorAlpha color_alpha) {
  Rgb color{stored[0], stored[1], stored[2]};
  const float alpha = stored[3];
  const bool has_factor = image.alpha != AlphaMode::INDEPENDENT && image.alpha != AlphaMode::IGNORED;
  const bool is_multiplied = has_factor && alpha != 0.0f && alpha != 1.0f;
  if (is_multiplied && color_alpha == ColorAlpha::DIVIDED) color = color / alpha;
  if (image.transfer == TransferCurve::SRGB)
    color = {srgb_to_linear(color.r), srgb_to_linear(color.g), srgb_to_linear(color.b)};
  if (image.has_colour_matrix) color = multiply(image.to_working_space, color);
  return {color, alpha};
}

}  // namespace

Texel lookup_image(const Image& image, float u, float v, Interpolation interpolation, Extension extension,
                   ColorAlpha color_alpha) {
  switch (image.format) {
    case PixelFormat::U8:
      return decode(image, filter<PixelFormat::U8>(image, u, v, interpolation, extension), color_alpha);
    case PixelFormat::U16:
      return decode(image, filter<PixelFormat::U16>(image, u, v, interpolation, extension), color_alpha);
    case PixelFormat::HALF:
      return decode(image, filter<PixelFormat::HALF>(image, u, v, interpolation, extension), color_alpha);
    default:
      return decode(image, filter<PixelFormat::FLOAT>(image, u, v, interpolation, extension), color_alpha);
  }
}

Texel lookup_equirectangular(const Image& image, Vec3 direction, Interpolation interpolation) {
  const float l = length(direction);
  if (!(l > 0.0f)) return lookup_image(image, 0.0f, 0.0f, interpolation, Extension::REPEAT, ColorAlpha::MULTIPLIED);
  const float u = 0.5f - azimuth_turns(direction.y, direction.x);
  const float v = 1.0f - inclination_half_turns(std::clamp(direction.z / l, -1.0f, 1.0f));
  return lookup_image(image, u, v, interpolation, Extension::REPEAT, ColorAlpha::MULTIPLIED);
}

Texel lookup_horizon(const Image& image, Vec3 direction, Interpolation interpolation) {
  const float elevation = elevation_half_turns(std::clamp(direction.z, -1.0f, 1.0f));
  const float u = 0.5f - azimuth_turns(direction.y, direction.x);
  const float v = 0.5f + std::copysign(std::sqrt(0.5f * std::abs(elevation)), elevation);
  // A row has no edge, but only two axes together can repeat: half a texel at either end comes from the other end.
  const float inset = 0.5f / static_cast<float>(image.height);
  return lookup_image(image, u, std::clamp(v, inset, 1.0f - inset), interpolation, Extension::REPEAT,
                      ColorAlpha::MULTIPLIED);
}

}  // namespace cistern
