#include "shading/nodes_pattern.h"

#include <utility>

#include "shading/nodes_hash.h"
#include "shading/nodes_math.h"
#include "shading/nodes_noise.h"

namespace cistern {
namespace {

constexpr float kTwoPi = 2.0f * kPi;

/// Blender's nudge off integer coordinates, where rounding would make checkers flicker.
Vec3 nudged(Vec3 p) { return (p + Vec3{0.000001f, 0.000001f, 0.000001f}) * 0.999999f; }

/// Whole number as int; saturates, NaN is 0.
int to_int(float whole) {
  constexpr float kLimit = 2e9f;
  return std::abs(whole) < kLimit ? static_cast<int>(whole)
                                  : (whole > 0.0f ? 2000000000 : (whole < 0.0f ? -2000000000 : 0));
}

bool is_odd_cell(float x) { return (to_int(std::floor(x)) & 1) != 0; }

}  // namespace

bool checker_node(Vec3 p) {
  const Vec3 q = nudged(p);
  return (is_odd_cell(q.x) == is_odd_cell(q.y)) == is_odd_cell(q.z);
}

namespace {

float gradient(Vec3 p, int type) {
  switch (type) {
    case 0:
      return p.x;
    case 1:
      return sqr(std::max(p.x, 0.0f));
    case 2:
      return smoothstep01(p.x);
    case 3:
      return 0.5f * (p.x + p.y);
    case 4:
      return std::atan2(p.y, p.x) / kTwoPi + 0.5f;
    default: {
      // just below 1, so that points of the unit sphere are exactly 0
      const float r = std::max(0.999999f - length(p), 0.0f);
      return type == 5 ? r * r : r;
    }
  }
}

}  // namespace

float gradient_node(Vec3 p, int type) { return clamp01(gradient(p, type)); }

float wave_node(Vec3 position, const WaveSettings& s) {
  const Vec3 p = nudged(position);
  float n = 0.0f;
  if (s.type == 0) {
    n = s.direction == 3 ? (p.x + p.y + p.z) * 10.0f : p[s.direction] * 20.0f;
  } else {
    const Vec3 keep{s.direction == 0 ? 0.0f : 1.0f, s.direction == 1 ? 0.0f : 1.0f, s.direction == 2 ? 0.0f : 1.0f};
    n = length(p * keep) * 20.0f;
  }
  n += s.phase;
  if (s.distortion != 0.0f) {
    NoiseSettings noise;
    noise.detail = s.detail;
    noise.roughness = s.detail_roughness;
    n += s.distortion * (noise_node(p * s.detail_scale, 0.0f, 3, noise) * 2.0f - 1.0f);
  }
  if (s.profile == 0) return 0.5f + 0.5f * std::sin(n - 0.5f * kPi);
  n /= kTwoPi;
  if (s.profile == 1) return n - std::floor(n);
  return std::abs(n - std::floor(n + 0.5f)) * 2.0f;
}

float white_noise_node(Vec3 p, float w, int dimensions) {
  switch (dimensions) {
    case 1:
      return hash_floats(w);
    case 2:
      return hash_floats(p.x, p.y);
    case 3:
      return hash_floats(p.x, p.y, p.z);
    default:
      return hash_floats(p.x, p.y, p.z, w);
  }
}

Vec3 white_noise_color_node(Vec3 p, float w, int dimensions) {
  switch (dimensions) {
    case 1:
      return hash_color(w);
    case 2:
      return {hash_floats(p.x, p.y), hash_floats(p.x, p.y, 1.0f), hash_floats(p.x, p.y, 2.0f)};
    case 3:
      return {hash_floats(p.x, p.y, p.z), hash_floats(p.x, p.y, p.z, 1.0f), hash_floats(p.x, p.y, p.z, 2.0f)};
    default:
      return {hash_floats(p.x, p.y, p.z, w), hash_floats(p.z, p.x, w, p.y), hash_floats(w, p.z, p.y, p.x)};
  }
}

namespace {

/// Integer noise in [0, 1] of Blender's bricks: the classic polynomial generator of Perlin-style value noise.
float brick_noise(uint32_t n) {
  n = (n + 1013u) & 0x7fffffffu;
  n ^= n >> 13;
  const uint32_t value = (n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7fffffffu;
  return 0.5f * (static_cast<float>(value) / 1073741824.0f);
}

}  // namespace

BrickResult brick_node(Vec3 p, const BrickSettings& s) {
  const int row = to_int(std::floor(safe_divide(p.y, s.row_height)));
  float width = s.brick_width, offset = 0.0f;
  if (s.offset_frequency != 0 && s.squash_frequency != 0) {
    if (row % s.squash_frequency == 0) width *= s.squash;
    if (row % s.offset_frequency == 0) offset = width * s.offset;
  }
  const int brick = to_int(std::floor(safe_divide(p.x + offset, width)));
  const float x = p.x + offset - width * static_cast<float>(brick);
  const float y = p.y - s.row_height * static_cast<float>(row);

  BrickResult result;
  const uint32_t key = (static_cast<uint32_t>(row) << 16) + (static_cast<uint32_t>(brick) & 0xffffu);
  result.tint = clamp01(brick_noise(key) + s.bias);
  const float to_edge = std::min(std::min(x, y), std::min(width - x, s.row_height - y));
  if (to_edge >= s.mortar_size) return result;
  result.mortar = s.mortar_smooth == 0.0f ? 1.0f : smoothstep01((1.0f - to_edge / s.mortar_size) / s.mortar_smooth);
  return result;
}

/// Sines of sines, one more per step of depth; the signs are what makes Blender's pattern.
Vec3 magic_node(Vec3 p, float scale, float distortion, int depth, bool wraps_scaled) {
  if (wraps_scaled) p = p * std::exchange(scale, 1.0f);
  const float px = std::fmod(p.x, kTwoPi), py = std::fmod(p.y, kTwoPi), pz = std::fmod(p.z, kTwoPi);
  float x = std::sin((px + py + pz) * 5.0f * scale);
  float y = std::cos((-px + py - pz) * 5.0f * scale);
  float z = -std::cos((-px - py + pz) * 5.0f * scale);
  if (depth > 0) {
    x *= distortion, y *= distortion, z *= distortion;
    y = -std::cos(x - y + z) * distortion;
  }
  if (depth > 1) x = std::cos(x - y - z) * distortion;
  if (depth > 2) z = std::sin(-x - y - z) * distortion;
  if (depth > 3) x = -std::cos(-x + y - z) * distortion;
  if (depth > 4) y = -std::sin(-x + y + z) * distortion;
  if (depth > 5) y = -std::cos(-x + y + z) * distortion;
  if (depth > 6) x = std::cos(x + y + z) * distortion;
  if (depth > 7) z = std::sin(x + y - z) * distortion;
  if (depth > 8) x = -std::cos(-x - y + z) * distortion;
  if (depth > 9) y = -std::sin(x - y + z) * distortion;
  const float divisor = distortion != 0.0f ? 2.0f * distortion : 1.0f;
  return Vec3{0.5f, 0.5f, 0.5f} - Vec3{x, y, z} / divisor;
}

}  // namespace cistern
