#include "grid/cell_key.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <tuple>

#include "base/check.h"
#include "base/rng.h"
#include "base/warp.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr int kWidth = 1920, kHeight = 1080;
constexpr float kFov = 0.7f;  // radians, vertical
constexpr Vec3 kUp{0.0f, 0.0f, 1.0f};

GridLayout layout_of(float min_cell_size, Vec3 camera = {}, bool randomised = false, uint32_t frame = 0) {
  const GridSettings settings{min_cell_size, 16.0f, true, randomised};
  return make_grid_layout(settings, {camera, pixel_angle(kFov, kWidth, kHeight), 0.0f}, 1, frame);
}

float log_uniform(Rng& rng, float low, float high) { return low * std::pow(high / low, rng.next_float()); }

// --- size -------------------------------------------------------------------------------------------------------

/// Whether cells look between half of the wanted size and all of it, at any distance where that is above the minimum.
bool cells_look_right(float angle_of_pixel) {
  const GridSettings settings{1e-4f, 16.0f, true, false};
  const GridLayout layout = make_grid_layout(settings, {{1.0f, 2.0f, 3.0f}, angle_of_pixel, 0.0f}, 1, 0);
  const float true_angle = kFov / kHeight;  // of a square pixel
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const float distance = log_uniform(rng, 0.1f, 1e4f);
    const float pixels = cell_size(layout, Vec3{1.0f, 2.0f + distance, 3.0f}) / (distance * true_angle);
    if (pixels < 0.499f * settings.cell_pixels || pixels > 1.001f * settings.cell_pixels) return false;
  }
  return true;
}

TEST(CellKey, CellsLookAsLargeAsAsked) { EXPECT_TRUE(cells_look_right(pixel_angle(kFov, kWidth, kHeight))); }

TEST(CellKey, PlantedWidthForHeightIsCaught) {
  const float w = kWidth, h = kHeight;
  EXPECT_FALSE(cells_look_right(std::max(kFov / w, kFov * w / (h * h)))) << "[Zhang and Wang 2023] Eq. (11) as printed";
}

TEST(CellKey, PixelAngleOfPortraitsFollowsTheWidth) {
  EXPECT_FLOAT_EQ(pixel_angle(0.7f, 1000, 500), 0.7f / 500.0f);
  EXPECT_FLOAT_EQ(pixel_angle(0.7f, 500, 1000), 0.7f * 1000.0f / (500.0f * 500.0f));
}

TEST(CellKey, SizeIsTheMinimumTimesAPowerOfTwo) {
  const GridLayout layout = layout_of(0.03f);
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = square_to_sphere(rng.next_vec2()) * log_uniform(rng, 1e-3f, 1e5f);
    const int level = key_level(cell_key(layout, p, kUp));
    ASSERT_GE(level, 0);
    ASSERT_FLOAT_EQ(cell_size(layout, p), std::ldexp(0.03f, level));
  }
  EXPECT_FLOAT_EQ(cell_size(layout, {}), 0.03f) << "at the camera itself";
}

TEST(CellKey, ExtremeAnglesStayFinite) {
  for (const float cell_pixels : {0.0f, 1e3f, 1e9f}) {  // the argument of the tangent would pass pi / 2
    const GridLayout layout = make_grid_layout({0.01f, cell_pixels, true, false}, {{}, 0.01f, 0.0f}, 1, 0);
    const float size = cell_size(layout, Vec3{0.0f, 100.0f, 0.0f});
    EXPECT_GE(size, 0.01f * (1.0f - 1e-6f));
    EXPECT_LE(size, 100.0f);
  }
}

TEST(CellKey, OrthographicCellsHaveOneSize) {
  const GridLayout layout = make_grid_layout({0.001f, 16.0f, true, false}, {{}, 0.0f, 0.01f}, 1, 0);
  for (const float distance : {0.0f, 1.0f, 100.0f})
    EXPECT_FLOAT_EQ(cell_size(layout, Vec3{distance, 0.0f, 0.0f}), 0.128f);  // 0.001 2^7 <= 0.16
}

TEST(CellKey, DefaultMinimumSurvivesFlatAndEmptyScenes) {
  EXPECT_FLOAT_EQ(default_min_cell_size({-3.0f, -4.0f, 0.0f}, {3.0f, 4.0f, 0.0f}), 0.1f);
  EXPECT_FLOAT_EQ(default_min_cell_size({1.0f, 1.0f, 1.0f}, {1.0f, 1.0f, 1.0f}), 1e-6f);
  EXPECT_FLOAT_EQ(default_min_cell_size(Vec3{1.0f, 1.0f, 1.0f} * 1e30f, Vec3{1.0f, 1.0f, 1.0f} * -1e30f), 1e-6f)
      << "the box of nothing is inside out";
}

// --- exactness --------------------------------------------------------------------------------------------------

/// The cell worked out anew in long doubles, from the definition.
std::tuple<int, long long, long long, long long, int> cell_by_definition(const GridLayout& layout, Vec3 p, Vec3 n) {
  const double size = cell_size(layout, p);
  const int level = static_cast<int>(std::lround(std::log2(size / layout.min_cell_size)));
  long long c[3];
  for (int i = 0; i < 3; ++i) {
    const auto& row = layout.rotation[i];
    const long double along = static_cast<long double>(row[0]) * p.x + static_cast<long double>(row[1]) * p.y +
                              static_cast<long double>(row[2]) * p.z;
    const long double units = along / layout.min_cell_size + layout.offset[i];
    c[i] = static_cast<long long>(std::floor(std::ldexp(units, -level)));
  }
  return {level, c[0], c[1], c[2], normal_bin(n)};
}

/// Share of points for which equal keys do not mean equal cells, for points around `camera` at distances up to
/// `extent`, in pairs closer than a cell or so. Rounding may move a point across a plane: some 1e-6 at most.
template <class Key>
double share_of_wrong_keys(const GridLayout& layout, Vec3 camera, float extent, const Key& key_of) {
  constexpr int kPairs = 20000;
  std::map<uint64_t, std::tuple<int, long long, long long, long long, int>> cells;
  std::map<std::tuple<int, long long, long long, long long, int>, uint64_t> keys;
  Rng rng(3, 0, 0, 0);
  int wrong = 0;
  for (int i = 0; i < kPairs; ++i) {
    const Vec3 n = square_to_sphere(rng.next_vec2());
    const Vec3 p = camera + square_to_sphere(rng.next_vec2()) * log_uniform(rng, 1e-6f * extent, extent);
    const float size = cell_size(layout, p);
    for (const Vec3 q : {p, p + square_to_sphere(rng.next_vec2()) * size}) {
      const uint64_t key = key_of(layout, q, n);
      const auto cell = cell_by_definition(layout, q, n);
      if (cells.try_emplace(key, cell).first->second != cell || keys.try_emplace(cell, key).first->second != key)
        ++wrong;
    }
  }
  return static_cast<double>(wrong) / (2 * kPairs);
}

struct SceneCase {
  const char* name;
  float extent;
  Vec3 camera;
  float min_cell_size;
};
const SceneCase kScenes[] = {
    {"room", 10.0f, {0.3f, -2.0f, 1.7f}, 0.01f},
    {"a millimetre", 1e-3f, {1e-4f, 0.0f, 0.0f}, 1e-5f},
    {"100 km", 1e5f, {-200.0f, 300.0f, 2.0f}, 0.01f},
    {"100 km in steps of a micrometre", 1e5f, {}, 1e-6f},
    {"all coordinates negative", 50.0f, {-1000.0f, -1000.0f, -1000.0f}, 0.05f},
    {"far from the origin", 50.0f, {5e4f, -7e4f, 3e4f}, 0.5f},
};

TEST(CellKey, EqualKeysMeanEqualCells) {
  for (const SceneCase& scene : kScenes)
    for (const bool randomised : {false, true}) {
      const GridLayout layout = layout_of(scene.min_cell_size, scene.camera, randomised, 5);
      EXPECT_LT(share_of_wrong_keys(layout, scene.camera, scene.extent, cell_key), 1e-3) << scene.name;
    }
}

/// [Boissé 2021] Alg. 5 with its size taken as an unsigned integer, as a program does that adds a float to a hash.
uint64_t key_with_hashed_size(const GridLayout& layout, Vec3 p, Vec3 n) {
  const auto [level, x, y, z, bin] = cell_by_definition(layout, p, n);
  const auto size = static_cast<uint32_t>(cell_size(layout, p));
  const auto hash = [](uint64_t v) { return static_cast<uint32_t>(mix_bits(v)); };
  return (uint64_t{hash(size + hash(z + hash(y + hash(x))))} << 6) | static_cast<uint64_t>(bin);
}

TEST(CellKey, PlantedHashOfTheSizeIsCaught) {
  GridLayout layout = layout_of(1e-5f);
  layout.size_per_distance = 0.1;  // few cells to a level, in the same places at all levels
  layout.offset = {};
  EXPECT_LT(share_of_wrong_keys(layout, {}, 10.0f, cell_key), 1e-3);
  EXPECT_GT(share_of_wrong_keys(layout, {}, 10.0f, key_with_hashed_size), 1e-2)
      << "cells below a metre all have size 0: their levels share keys";
}

TEST(CellKey, LevelsNest) {
  GridLayout fine = layout_of(0.01f, {}, true), coarse = fine;
  fine.size_per_distance = coarse.size_per_distance = 0.0;
  coarse.size_everywhere = 0.08;
  std::map<CellKey, CellKey> parent;
  Rng rng(4, 0, 0, 0);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = Vec3{rng.next_float(), rng.next_float(), rng.next_float()} * 0.3f;
    const CellKey key = cell_key(coarse, p, kUp);
    ASSERT_EQ(key_level(key), 3);
    ASSERT_EQ(parent.try_emplace(cell_key(fine, p, kUp), key).first->second, key);
  }
}

TEST(CellKey, NothingHasTheReservedKey) {
  constexpr float kInf = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
  const GridLayout layout = layout_of(0.01f);
  for (const float bad : {kInf, -kInf, kNan})
    for (const Vec3 v : {Vec3{bad, 0.0f, 0.0f}, Vec3{0.0f, bad, 0.0f}, Vec3{0.0f, 0.0f, bad}}) {
      EXPECT_EQ(cell_key(layout, v, kUp), kNoCell);
      EXPECT_EQ(cell_key(layout, {}, v), kNoCell);
      EXPECT_EQ(cell_size(layout, v), 0.0f);
    }
  EXPECT_NE(cell_key(layout, {}, {}), kNoCell) << "a zero normal has a bin of its own";
  EXPECT_EQ(key_normal_bin(cell_key(layout, {}, {})), kNoNormalBin);
  EXPECT_NE(without_normal(cell_key(layout, Vec3{-1.0f, -1.0f, -1.0f} * 1e6f, kUp)), kNoCell);
}

std::string error_of(const GridSettings& settings, Vec3 position) {
  try {
    cell_key(make_grid_layout(settings, {{}, 0.001f, 0.0f}, 1, 0), position, kUp);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(CellKey, ErrorsNameTheSetting) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {0.0f, -1.0f, kNan, std::numeric_limits<float>::infinity()})
    EXPECT_NE(error_of({bad, 16.0f, true, true}, {}).find("min_cell_size"), std::string::npos) << bad;
  for (const float bad : {-1.0f, kNan})
    EXPECT_NE(error_of({0.1f, bad, true, true}, {}).find("cell_pixels"), std::string::npos) << bad;
  EXPECT_NE(error_of({1e-20f, 16.0f, true, true}, {1e30f, 0.0f, 0.0f}).find("min_cell_size"), std::string::npos);
  EXPECT_EQ(error_of({1e-3f, 16.0f, true, true}, {-1e15f, 1e15f, 1e15f}), "");
  EXPECT_THROW(make_grid_layout({0.1f}, {{kNan, 0.0f, 0.0f}, 0.001f, 0.0f}, 1, 0), Error);
  EXPECT_THROW(make_grid_layout({0.1f}, {{}, -0.001f, 0.0f}, 1, 0), Error);
}

/// Share of points on walls at multiples of half a cell that change cells when rounding moves the wall by a little.
double share_of_flickering_points(const GridLayout& layout) {
  constexpr int kPoints = 5000;
  constexpr float kRounding = 3e-7f;
  Rng rng(5, 0, 0, 0);
  int flickering = 0;
  for (int i = 0; i < kPoints; ++i) {
    const float wall = 0.125f * std::floor(100.0f * rng.next_float() - 50.0f);
    const float x = 20.0f * rng.next_float() - 10.0f, y = 20.0f * rng.next_float() - 10.0f;
    flickering += cell_key(layout, {x, y, wall - kRounding * std::abs(wall)}, kUp) !=
                  cell_key(layout, {x, y, wall + kRounding * std::abs(wall)}, kUp);
  }
  return static_cast<double>(flickering) / kPoints;
}

TEST(CellKey, WallsOnRoundCoordinatesDoNotFlicker) {
  GridLayout layout = layout_of(0.25f);
  EXPECT_LT(share_of_flickering_points(layout), 1e-3);
  layout.offset = {};
  EXPECT_GT(share_of_flickering_points(layout), 0.3) << "planted: planes of the grid at round coordinates";
}

// --- normals ----------------------------------------------------------------------------------------------------

/// Largest angle in radians between two of many random normals of the same bin.
template <class Bin>
float widest_bin(const Bin& bin_of) {
  std::map<int, std::vector<Vec3>> bins;
  Rng rng(6, 0, 0, 0);
  for (int i = 0; i < 10000; ++i) {
    const Vec3 n = square_to_sphere(rng.next_vec2());
    bins[bin_of(n)].push_back(n);
  }
  float least_cosine = 1.0f;
  for (const auto& [bin, normals] : bins)
    for (size_t i = 0; i < normals.size(); i += 4)
      for (const Vec3 n : normals) least_cosine = std::min(least_cosine, dot(normals[i], n));
  return std::acos(least_cosine);
}

TEST(NormalBin, HoldsNormalsOfOneDirection) {
  EXPECT_LT(widest_bin(normal_bin), 50.0f * kPi / 180.0f);
  std::set<int> bins;
  Rng rng(7, 0, 0, 0);
  for (int i = 0; i < 10000; ++i) bins.insert(normal_bin(square_to_sphere(rng.next_vec2())));
  EXPECT_EQ(bins.size(), size_t{kNormalBinCount});
  EXPECT_EQ(*bins.rbegin(), kNormalBinCount - 1);
}

/// [Zhang and Wang 2023] Eq. (10) as printed: components taken from [0, 1] in 2 bits, though normals have signs.
int bin_of_unsigned_normal(Vec3 n) {
  const auto chi = [](float v) { return static_cast<int>(clamp01(v) * 3.999f); };
  return (chi(n.x) << 4) | (chi(n.y) << 2) | chi(n.z);
}

TEST(NormalBin, PlantedUnsignedNormalsAreCaught) {
  EXPECT_GT(widest_bin(bin_of_unsigned_normal), 80.0f * kPi / 180.0f);
}

TEST(NormalBin, AxisAlignedNormalsNeverFlicker) {
  constexpr float kNoise = 0.2f;
  std::set<int> bins;
  Rng rng(8, 0, 0, 0);
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {-1.0f, 1.0f}) {
      const Vec3 n{axis == 0 ? sign : -0.0f, axis == 1 ? sign : 0.0f, axis == 2 ? sign : -0.0f};
      bins.insert(normal_bin(n));
      for (int i = 0; i < 1000; ++i)
        ASSERT_EQ(normal_bin(normalize(n + square_to_sphere(rng.next_vec2()) * kNoise)), normal_bin(n));
    }
  EXPECT_EQ(bins.size(), 6u);
}

TEST(NormalBin, KeysWithoutNormalsIgnoreThem) {
  GridLayout layout = layout_of(0.1f);
  const CellKey up = cell_key(layout, {1.0f, 2.0f, 3.0f}, kUp), down = cell_key(layout, {1.0f, 2.0f, 3.0f}, -kUp);
  EXPECT_NE(up, down);
  EXPECT_EQ(without_normal(up), without_normal(down));
  layout.use_normals = false;
  EXPECT_EQ(cell_key(layout, {1.0f, 2.0f, 3.0f}, kUp), without_normal(up));
  EXPECT_EQ(cell_key(layout, {1.0f, 2.0f, 3.0f}, -kUp), without_normal(up));
}

// --- random layouts ---------------------------------------------------------------------------------------------

TEST(GridLayout, DependsOnSeedAndFrameOnly) {
  const GridCamera camera{{}, 0.001f, 0.0f};
  const GridSettings settings{0.1f};
  const auto offset = [&](uint64_t seed, uint32_t frame) {
    return make_grid_layout(settings, camera, seed, frame).offset;
  };
  EXPECT_EQ(offset(1, 2), offset(1, 2));
  EXPECT_NE(offset(1, 2), offset(1, 3));
  EXPECT_NE(offset(1, 2), offset(2, 2));
}

/// Numbers in [0, 1) that are uniform if layouts are: where the planes stand at several levels, and the height of the
/// turned axes. `height` gives the latter.
template <class Height>
double p_value_of_layouts(int quantity, const Height& height) {
  constexpr int kFrames = 4000, kBins = 20;
  std::vector<double> observed(kBins), expected(kBins, kFrames / static_cast<double>(kBins));
  for (uint32_t frame = 0; frame < kFrames; ++frame) {
    const GridLayout layout = layout_of(0.1f, {}, true, frame);
    const double shift = std::ldexp(layout.offset[quantity % 3], -5 * (quantity / 3));
    const double u = quantity < 9 ? shift - std::floor(shift) : 0.5 * (height(layout, quantity - 9) + 1.0);
    ++observed[std::min(static_cast<int>(u * kBins), kBins - 1)];
  }
  return chi_square_p_value(observed, expected);
}

TEST(GridLayout, OffsetsAndRotationsAreUniform) {
  const auto height = [](const GridLayout& layout, int i) { return layout.rotation[i / 3][i % 3]; };
  for (int quantity = 0; quantity < 18; ++quantity)
    EXPECT_GT(p_value_of_layouts(quantity, height), shared_rate(18)) << quantity;
  const auto uniform_angle = [](const GridLayout& layout, int) {
    return std::cos(std::acos(-1.0) * (layout.offset[0] - std::floor(layout.offset[0])));
  };
  EXPECT_LT(p_value_of_layouts(9, uniform_angle), kFalseAlarmRate) << "planted: Euler angles drawn evenly";
}

TEST(GridLayout, RotationsKeepLengths) {
  for (uint32_t frame = 0; frame < 10; ++frame) {
    const auto r = layout_of(0.1f, {}, true, frame).rotation;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        EXPECT_NEAR(r[i][0] * r[j][0] + r[i][1] * r[j][1] + r[i][2] * r[j][2], i == j ? 1.0 : 0.0, 1e-12);
  }
}

TEST(GridLayout, JitterStaysInThePlaneAndWithinACell) {
  const GridLayout layout = layout_of(0.1f);
  Rng rng(9, 0, 0, 0);
  float farthest = 0.0f;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 n = square_to_sphere(rng.next_vec2());
    const Vec3 moved = jitter_in_tangent_plane(layout, {}, n, rng.next_vec2());
    ASSERT_NEAR(dot(moved, n), 0.0f, 1e-6f);
    farthest = std::max(farthest, length(moved));
  }
  EXPECT_LT(farthest, 0.1f * 0.70711f);
  EXPECT_GT(farthest, 0.1f * 0.6f);
}

TEST(CellColor, TellsNeighboursApart) {
  const GridLayout layout = layout_of(0.1f);
  const Rgb here = cell_color(cell_key(layout, {}, kUp)), there = cell_color(cell_key(layout, {0.1f, 0.0f, 0.0f}, kUp));
  EXPECT_NE(here, there);
  for (const Rgb c : {here, there})
    for (const float v : {c.r, c.g, c.b}) EXPECT_TRUE(v >= 0.1f && v <= 1.0f);
  EXPECT_TRUE(is_black(cell_color(kNoCell)));
}

}  // namespace
}  // namespace cistern::test
