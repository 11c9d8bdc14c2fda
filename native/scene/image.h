#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/transform.h"

namespace cistern {

enum class PixelFormat : uint8_t { U8, U16, HALF, FLOAT };

/// How stored values become scene-linear ones. Filtering happens on the stored values, decoding after it, as
/// Blender users know it from Cycles.
enum class TransferCurve : uint8_t { LINEAR, SRGB };

/// What the fourth (or second) channel means. Colours are filtered multiplied by alpha, so that what transparent texels
/// hold does not bleed into their neighbours, unless the channels are independent.
enum class AlphaMode : uint8_t {
  STRAIGHT,       // colours are stored without alpha
  PREMULTIPLIED,  // colours are stored multiplied by alpha
  INDEPENDENT,    // alpha is a mask of its own, or the image is data
  IGNORED         // alpha reads as 1
};

/// Pixels in their native depth. `pixels` may be memory of somebody else (a NumPy array) kept alive by the
/// shared pointer. Row 0 is the bottom row; channels are interleaved; 1 = grey, 2 = grey + alpha, 3 = RGB, 4 = RGBA.
struct Image {
  std::string name;
  int width = 0, height = 0, channels = 0;
  PixelFormat format = PixelFormat::U8;
  TransferCurve transfer = TransferCurve::LINEAR;
  /// Linear colours of the file -> working space; identity when equal. Applied after decoding.
  std::array<float, 9> to_working_space{1, 0, 0, 0, 1, 0, 0, 0, 1};
  bool has_colour_matrix = false;
  AlphaMode alpha = AlphaMode::STRAIGHT;
  std::shared_ptr<const void> pixels;
  /// The very same memory read in the same way; what it holds is not compared.
  friend bool operator==(const Image&, const Image&) = default;
};

}  // namespace cistern
