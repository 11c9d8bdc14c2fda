#pragma once

#include "base/rgb.h"
#include "scene/image.h"

namespace cistern {

enum class Interpolation : uint8_t { LINEAR, CLOSEST, CUBIC };
enum class Extension : uint8_t { REPEAT, EXTEND, CLIP, MIRROR };

struct Texel {
  Rgb color;  // scene-linear
  float alpha = 1.0f;
};

/// Whether looked-up colours are divided by alpha, or stay multiplied by it: as Cycles leaves them where nobody reads
/// the alpha. No difference for AlphaMode::INDEPENDENT and IGNORED.
enum class ColorAlpha : uint8_t { DIVIDED, MULTIPLIED };

/// Texture lookup at (u, v), v up, [0, 1] covering the image once. Outside of a CLIP image: transparent black.
Texel lookup_image(const Image& image, float u, float v, Interpolation interpolation, Extension extension,
                   ColorAlpha color_alpha = ColorAlpha::DIVIDED);

/// Equirectangular lookup: the image centre looks along +X, u = 1/2 - atan2(y, x)/2pi, v = 1 - acos(z)/pi from the top,
/// as in Cycles. `direction` need not be unit. Colours stay multiplied by alpha.
Texel lookup_equirectangular(const Image& image, Vec3 direction, Interpolation interpolation);

/// The same with v = 1/2 + sign(e) sqrt(|e| / 2 pi) for the elevation e above z = 0, and the top and bottom row
/// extended instead of repeated.
Texel lookup_horizon(const Image& image, Vec3 direction, Interpolation interpolation);

}  // namespace cistern
