#pragma once

#include <span>

#include "base/rgb.h"

namespace cistern {

// Colour nodes; blend numbers are those of op_table.cpp. Colours travel in Vec3 as registers do.

/// Factor and result are not clamped here.
Vec3 mix_color_node(int blend, float factor, Vec3 a, Vec3 b);
Vec3 invert_node(float factor, Vec3 color);
/// Components that are not positive stay; gamma 0 gives white.
Vec3 gamma_node(Vec3 color, float gamma);
Vec3 bright_contrast_node(Vec3 color, float bright, float contrast);
Vec3 hue_saturation_node(Vec3 color, float hue, float saturation, float value, float factor);

// Hue in [0, 1).
Vec3 rgb_to_hsv(Vec3 rgb);
Vec3 hsv_to_rgb(Vec3 hsv);
Vec3 rgb_to_hsl(Vec3 rgb);
Vec3 hsl_to_rgb(Vec3 hsl);

/// Table over [0, 1] at `position`, clamped; `is_constant` steps instead of interpolating.
Vec3 ramp_lookup(std::span<const Vec3> table, float position, bool is_constant);
float ramp_lookup(std::span<const float> table, float position, bool is_constant);
/// Each channel of `color` through its channel of the table over [min_x, max_x], continued linearly outside.
Vec3 curve_lookup_node(std::span<const Vec3> table, float factor, Vec3 color, float min_x, float max_x);

/// Linear Rec. 709 colour of a black body at `kelvin`, luminance 1, components >= 0; constant outside 800..12000 K.
Vec3 blackbody_node(float kelvin);

/// Linear Rec. 709 colour of a spectral line, components at most 1 and some below 0; black where nothing is seen.
Vec3 wavelength_node(float nanometres);

}  // namespace cistern
