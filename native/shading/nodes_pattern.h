#pragma once

#include "base/vec.h"

namespace cistern {

// Simple procedural textures of Blender; coordinates are already scaled, numbers in brackets are those of op_table.cpp.

/// Whether the unit cell of `p` shows colour 1.
bool checker_node(Vec3 p);
/// In [0, 1].
float gradient_node(Vec3 p, int type);

struct WaveSettings {
  int type = 0, direction = 0, profile = 0;
  float distortion = 0.0f, detail = 2.0f, detail_scale = 1.0f, detail_roughness = 0.5f, phase = 0.0f;
};
float wave_node(Vec3 p, const WaveSettings& settings);

float white_noise_node(Vec3 p, float w, int dimensions);
Vec3 white_noise_color_node(Vec3 p, float w, int dimensions);

struct BrickSettings {
  float mortar_size = 0.02f, mortar_smooth = 0.1f, bias = 0.0f, brick_width = 0.5f, row_height = 0.25f;
  float offset = 0.5f, squash = 1.0f;              // of the rows whose number divides by the frequency
  int offset_frequency = 2, squash_frequency = 2;  // 0: no row
};
struct BrickResult {
  float tint = 0.0f;    // between colour 1 and 2
  float mortar = 0.0f;  // 1 in the mortar
};
BrickResult brick_node(Vec3 p, const BrickSettings& settings);

/// `p` not scaled: the scale is applied after the coordinates are reduced.
Vec3 magic_node(Vec3 p, float scale, float distortion, int depth, bool wraps_scaled);

}  // namespace cistern
