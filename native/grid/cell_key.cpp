#include "grid/cell_key.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <string>

#include "base/check.h"
#include "base/frame.h"
#include "base/rng.h"

namespace cistern {
namespace {

using Vector = std::array<double, 3>;  // doubles: 100 km in millimetres are 10^8 steps, a float has 1.7 10^7

constexpr double kMinSizePerDistance = 0x1p-14;    // a point is at most 2^15 cells from the camera: 17 bits are unique
constexpr double kMinSizePerCoordinate = 0x1p-40;  // far below what a float coordinate resolves; fits 64-bit cells
constexpr double kMaxCellAngle = 0.25 * std::numbers::pi;  // a cell as large as its distance; the tangent stays finite
constexpr double kMaxOffset = 0x1p32;                      // cells of level 0: random to level 32, with 21 bits below
constexpr int kMaxLevel = (1 << kLevelBits) - 1;
constexpr uint32_t kNoPixel = ~0u;
constexpr uint32_t kLayoutStream = 0x67726964;

// Offset of layouts that are the same in all frames. Irrational, so that walls at round numbers lie inside cells at
// every level: fractions of the golden ratio and of the square roots of 2 and 3.
constexpr Vector kFixedOffset{0.6180339887498949 * kMaxOffset, 0.4142135623730951 * kMaxOffset,
                              0.7320508075688773 * kMaxOffset};

std::string number(double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

void check_size(const char* setting, float value, bool zero_allowed) {
  if (std::isfinite(value) && (value > 0.0f || (zero_allowed && value == 0.0f))) return;
  throw Error(setting, number(value) + " is not allowed: a finite number " + (zero_allowed ? ">=" : ">") + " 0");
}

double uniform(Rng& rng) { return (rng.next_uint32() + rng.next_double()) * 0x1p-32; }

/// Uniform over all rotations. [Shoemake 1992, Uniform Random Rotations]
std::array<Vector, 3> random_rotation(Rng& rng) {
  const double u = uniform(rng), a = 2.0 * std::numbers::pi * uniform(rng), b = 2.0 * std::numbers::pi * uniform(rng);
  const double x = std::sqrt(1.0 - u) * std::sin(a), y = std::sqrt(1.0 - u) * std::cos(a);
  const double z = std::sqrt(u) * std::sin(b), w = std::sqrt(u) * std::cos(b);
  return {{{1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)},
           {2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)},
           {2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)}}};
}

// floor(log2(x)) for x >= 1, and 2^-level: exact, and several times as fast as their names in the library.
constexpr int kMantissaBits = 52, kExponentBias = 1023;
int exponent(double x) { return static_cast<int>(std::bit_cast<uint64_t>(x) >> kMantissaBits) - kExponentBias; }
double inverse_power(int level) {
  return std::bit_cast<double>(static_cast<uint64_t>(kExponentBias - level) << kMantissaBits);
}

bool is_finite_vec(Vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// The level of a finite point.
int cell_level(const GridLayout& layout, Vec3 position) {
  double distance2 = 0.0, largest = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double d = position[i] - layout.camera_position[i];
    distance2 += d * d;
    largest = std::max(largest, std::abs(static_cast<double>(position[i])));
  }
  const double size = std::max(
      {layout.size_everywhere, std::sqrt(distance2) * layout.size_per_distance, largest * kMinSizePerCoordinate});
  const double ratio = size / layout.min_cell_size;
  const int level = ratio >= 1.0 ? exponent(ratio) : 0;
  if (level <= kMaxLevel) return level;
  throw Error("min_cell_size", number(layout.min_cell_size) + " m is too small for a point at (" + number(position.x) +
                                   ", " + number(position.y) + ", " + number(position.z) + "): at least " +
                                   number(std::ldexp(size, -kMaxLevel)) + " m");
}

/// A cell coordinate in its bits. The level keeps all points within 2^15 cells of the camera, so the coordinate modulo
/// 2^17 says which it is. Folded so that small coordinates of either sign have zeros in front: fewer digits to sort.
uint64_t coordinate_bits(double cell) {
  constexpr int64_t kHalf = int64_t{1} << (kCellCoordinateBits - 1);
  const int64_t wrapped = ((static_cast<int64_t>(cell) + kHalf) & (2 * kHalf - 1)) - kHalf;
  return static_cast<uint64_t>((wrapped << 1) ^ (wrapped >> 63));
}

}  // namespace

float pixel_angle(float vertical_fov, int width, int height) {
  const double w = width, h = height;
  return static_cast<float>(vertical_fov * std::max(1.0 / h, h / (w * w)));
}

float default_min_cell_size(Vec3 box_min, Vec3 box_max) {
  constexpr float kShareOfDiagonal = 0.01f;
  constexpr float kSmallest = 1e-6f, kLargest = 1e6f;  // metres
  if (box_max.x < box_min.x) return kSmallest;
  return std::clamp(kShareOfDiagonal * length(box_max - box_min), kSmallest, kLargest);
}

GridLayout make_grid_layout(const GridSettings& settings, const GridCamera& camera, uint64_t seed, uint32_t frame) {
  check_size("min_cell_size", settings.min_cell_size, false);
  check_size("cell_pixels", settings.cell_pixels, true);
  if (!is_finite_vec(camera.position)) throw Error("Camera", "its position is not finite");
  check_size("Camera pixel angle", camera.pixel_angle, true);
  check_size("Camera pixel size", camera.pixel_size, true);
  GridLayout layout;
  layout.camera_position = {camera.position.x, camera.position.y, camera.position.z};
  layout.min_cell_size = settings.min_cell_size;
  const double angle = std::min(kMaxCellAngle, static_cast<double>(settings.cell_pixels) * camera.pixel_angle);
  layout.size_per_distance = std::max(std::tan(angle), kMinSizePerDistance);
  layout.size_everywhere = static_cast<double>(settings.cell_pixels) * camera.pixel_size;
  layout.use_normals = settings.use_normals;
  layout.rotation = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};
  layout.offset = kFixedOffset;
  if (settings.randomised) {
    Rng rng(seed, kNoPixel, frame, kLayoutStream);
    layout.rotation = random_rotation(rng);
    for (double& o : layout.offset) o = kMaxOffset * uniform(rng);
  }
  return layout;
}

CellKey cell_key(const GridLayout& layout, Vec3 position, Vec3 normal) {
  if (!is_finite_vec(position) || (layout.use_normals && !is_finite_vec(normal))) return kNoCell;
  const int level = cell_level(layout, position);
  const double scale = inverse_power(level), inverse_size = 1.0 / layout.min_cell_size;
  auto key = static_cast<CellKey>(level);
  for (int i = 0; i < 3; ++i) {
    const Vector& row = layout.rotation[i];
    const double steps = (row[0] * position.x + row[1] * position.y + row[2] * position.z) * inverse_size;
    // Only the fraction of the offset moves the planes; its whole cells would fill the bits in front.
    const double shift = layout.offset[i] * scale;
    key = (key << kCellCoordinateBits) | coordinate_bits(std::floor(steps * scale + (shift - std::floor(shift))));
  }
  return (key << kNormalBinBits) | static_cast<CellKey>(layout.use_normals ? normal_bin(normal) : kNoNormalBin);
}

float cell_size(const GridLayout& layout, Vec3 position) {
  if (!is_finite_vec(position)) return 0.0f;
  return static_cast<float>(std::ldexp(layout.min_cell_size, cell_level(layout, position)));
}

Vec3 jitter_in_tangent_plane(const GridLayout& layout, Vec3 position, Vec3 normal, Vec2 u) {
  const float size = cell_size(layout, position);
  const Frame frame(normal);
  return position + frame.s * (size * (u.x - 0.5f)) + frame.t * (size * (u.y - 0.5f));
}

int normal_bin(Vec3 normal) {
  constexpr float kMiddle = 0.26794919f;  // tan(15 degrees): thirds of a face by angle
  const float ax = std::abs(normal.x), ay = std::abs(normal.y), az = std::abs(normal.z);
  const int axis = ax >= ay && ax >= az ? 0 : (ay >= az ? 1 : 2);
  const float along = normal[axis];
  if (along == 0.0f) return kNoNormalBin;
  const float edge = kMiddle * std::abs(along);
  const auto third = [edge](float v) { return v < -edge ? 0 : (v > edge ? 2 : 1); };
  const int face = 2 * axis + (along < 0.0f ? 1 : 0);
  return 9 * face + 3 * third(normal[(axis + 1) % 3]) + third(normal[(axis + 2) % 3]);
}

Rgb cell_color(CellKey key) {
  if (key == kNoCell) return {};
  constexpr float kDarkest = 0.1f;
  const uint64_t bits = mix_bits(key);
  const auto channel = [bits](int shift) {
    return lerp(kDarkest, 1.0f, to_unit_float(static_cast<uint32_t>(bits >> shift)));
  };
  return {channel(0), channel(16), channel(32)};
}

}  // namespace cistern
