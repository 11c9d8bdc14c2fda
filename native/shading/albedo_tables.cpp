#include "shading/albedo_tables.h"

#include <cmath>

#include "base/vec.h"

namespace cistern {
namespace {

// Arrays kGgxAlbedo[mu][roughness], kGgxAverage[roughness], kGlassEnter..., kGlassLeave...[z][mu][roughness],
// kDielectricFraction[z][mu][roughness], kSchlickFraction[mu][roughness]; made by tools/generate_albedo_tables.cpp.
#include "albedo_tables.inc"

constexpr int kFine = 32;    // grid of the reflection tables
constexpr int kCoarse = 16;  // grid of those that depend on the index too

/// Cell and position of `x` in a table of `size` nodes over [0, 1].
struct Cell {
  int low, high;
  float t;
  Cell(float x, int size) {
    const float scaled = clamp01(x) * static_cast<float>(size - 1);
    low = static_cast<int>(scaled);
    high = std::min(low + 1, size - 1);
    t = scaled - static_cast<float>(low);
  }
};

float lookup(const float* table, Cell x) { return lerp(table[x.low], table[x.high], x.t); }

float lookup(const float* table, int width, Cell x, Cell y) {
  const int low = y.low * width, high = y.high * width;
  return lerp(lookup(table + low, x), lookup(table + high, x), y.t);
}

float lookup(const float* table, Cell x, Cell y, Cell z) {
  constexpr int kSlice = kCoarse * kCoarse;
  const int low = z.low * kSlice, high = z.high * kSlice;
  return lerp(lookup(table + low, kCoarse, x, y), lookup(table + high, kCoarse, x, y), z.t);
}

}  // namespace

float ior_coordinate(float ior) { return std::sqrt(std::abs((ior - 1.0f) / (ior + 1.0f))); }

float ggx_albedo(float roughness, float mu) {
  return lookup(kGgxAlbedo, kFine, Cell(roughness, kFine), Cell(mu, kFine));
}

float ggx_average_albedo(float roughness) { return lookup(kGgxAverage, Cell(roughness, kFine)); }

float ggx_glass_albedo(float roughness, float mu, float ior) {
  return lookup(ior < 1.0f ? kGlassLeaveAlbedo : kGlassEnterAlbedo, Cell(roughness, kCoarse), Cell(mu, kCoarse),
                Cell(ior_coordinate(ior), kCoarse));
}

float ggx_glass_average_albedo(float roughness, float ior) {
  return lookup(ior < 1.0f ? kGlassLeaveAverage : kGlassEnterAverage, kCoarse, Cell(roughness, kCoarse),
                Cell(ior_coordinate(ior), kCoarse));
}

float ggx_dielectric_fresnel_fraction(float roughness, float mu, float ior) {
  return lookup(kDielectricFraction, Cell(roughness, kCoarse), Cell(mu, kCoarse), Cell(ior_coordinate(ior), kCoarse));
}

float ggx_schlick_fresnel_fraction(float roughness, float mu) {
  return lookup(kSchlickFraction, kCoarse, Cell(roughness, kCoarse), Cell(mu, kCoarse));
}

}  // namespace cistern
