#pragma once

#include "base/vec.h"

namespace cistern {

// Arithmetic nodes. Operation numbers are those of op_table.cpp. Divisions by zero, roots and logarithms of negative
// numbers give 0, as in Blender.

float math_node(int operation, float a, float b, float c);
/// Of 32 bits, which wrap around: the whole parts of the arguments.
float integer_math_node(int operation, float a, float b, float c);
Vec3 vector_math_node(int operation, Vec3 a, Vec3 b, Vec3 c, float scale);
float vector_math_value_node(int operation, Vec3 a, Vec3 b);
/// `type` 1 (RANGE) allows lower > upper.
float clamp_node(float value, float lower, float upper, int type);

struct MapRangeInput {
  float value, from_min, from_max, to_min, to_max, steps;
};
float map_range_node(const MapRangeInput& in, int interpolation, bool clamps);

inline float safe_divide(float a, float b) { return b != 0.0f ? a / b : 0.0f; }
inline Vec3 safe_divide(Vec3 a, Vec3 b) {
  return {safe_divide(a.x, b.x), safe_divide(a.y, b.y), safe_divide(a.z, b.z)};
}
/// 3t^2 - 2t^3 of t clamped to [0, 1].
inline float smoothstep01(float t) {
  t = clamp01(t);
  return t * t * (3.0f - 2.0f * t);
}

}  // namespace cistern
