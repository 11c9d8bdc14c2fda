#pragma once

#include "base/vec.h"

namespace cistern {

enum class NoiseType : uint8_t { FBM, MULTIFRACTAL, HYBRID_MULTIFRACTAL, RIDGED_MULTIFRACTAL, HETERO_TERRAIN };

struct NoiseSettings {
  float detail = 2.0f;      // octaves - 1, fractions blend the last one in
  float roughness = 0.5f;   // amplitude ratio of octaves
  float lacunarity = 2.0f;  // frequency ratio of octaves
  float offset = 0.0f;      // of the last three types, which add it to each octave
  float gain = 1.0f;        // of HYBRID_MULTIFRACTAL and RIDGED_MULTIFRACTAL: how much an octave weighs the next
  float distortion = 0.0f;
  NoiseType type = NoiseType::FBM;
  bool normalize = true;  // FBM only: to [0, 1]
};

/// Blender's Noise Texture in 1 (w), 2 (x, y), 3 or 4 (x, y, z, w) dimensions, coordinates already scaled.
float noise_node(Vec3 p, float w, int dimensions, const NoiseSettings& settings);
Vec3 noise_color_node(Vec3 p, float w, int dimensions, const NoiseSettings& settings);

/// Signed gradient noise in [-1, 1] in 3 dimensions. [Perlin 2002, Improving Noise]
float signed_noise(Vec3 p);

}  // namespace cistern
