// Writes the arrays that shading/albedo_tables.cpp includes: integrals of the GGX microfacet model over visible
// normals. The result depends on nothing but this file and the two headers, so every build makes the same tables.
#include <array>
#include <cstdio>
#include <vector>

#include "shading/fresnel.h"
#include "shading/ggx.h"

namespace {

using namespace cistern;

constexpr size_t kFine = 32, kCoarse = 16;
constexpr int kSamples = 10000;         // per node of a directional albedo
constexpr int kAverageSamples = 32768;  // per node of an average over mu
constexpr int kSchlickExponent = 5;
// Nodes at 0 and at an infinite index are singular: they are moved inwards by as much as in Cycles' own tables.
constexpr float kNearlyZero = 1e-4f;
constexpr float kLargestIorCoordinate = 0.99f;
constexpr float kIndexMatched = 1e-4f;  // closer indices do not deflect at all

float node(size_t i, size_t size) {
  return std::max(static_cast<float>(i) / static_cast<float>(size - 1), kNearlyZero);
}
float ior_of_node(size_t i) { return ior_from_f0(sqr(sqr(std::min(node(i, kCoarse), kLargestIorCoordinate)))); }

/// Point i of the Kronecker sequences in two and in three dimensions. [Roberts 2018, The Unreasonable Effectiveness of
/// Quasirandom Sequences]
template <size_t kDimensions>
std::array<float, kDimensions> quasi_random(const std::array<double, kDimensions>& steps, int i) {
  std::array<float, kDimensions> u;
  for (size_t k = 0; k < kDimensions; ++k) {
    const double x = 0.5 + steps[k] * (i + 1);
    u[k] = std::min(static_cast<float>(x - std::floor(x)), kOneMinusEpsilon);
  }
  return u;
}
constexpr std::array<double, 2> kSteps2{0.7548776662466927, 0.5698402909980532};
constexpr std::array<double, 3> kSteps3{0.8191725133961645, 0.6710436067037893, 0.5497004779019703};

/// A visible normal and what does not depend on the index: the reflected direction's shadowing (0 below the horizon).
struct VisibleNormal {
  GgxAlpha alpha;
  Vec3 wo, h;
  float cos_h;  // wo . h
  float shadowing;

  VisibleNormal(float roughness, float mu, float u1, float u2) : alpha{sqr(roughness), sqr(roughness)} {
    wo = {safe_sqrt(1.0f - mu * mu), 0.0f, mu};
    h = sample_ggx_visible_normal(alpha, wo, {u1, u2});
    cos_h = std::max(dot(wo, h), 0.0f);
    const Vec3 wi = reflect(wo, h);
    shadowing = wi.z > 0.0f ? shadowing_towards(wi) : 0.0f;
  }

  /// Masking and shadowing over masking.
  float shadowing_towards(Vec3 wi) const {
    const float lambda_o = ggx_lambda(alpha, wo);
    return (1.0f + lambda_o) / (1.0f + lambda_o + ggx_lambda(alpha, wi));
  }

  /// Rays that a tilted microfacet refracts without crossing the macrosurface count as transmitted here although no
  /// sample ever goes there: as in Cycles' tables, and it keeps the compensation bounded where rough glass is left at
  /// grazing angles (most of the energy is lost there, so that the compensated albedo stays below 1).
  float glass(float eta) const {
    if (std::abs(eta - 1.0f) < kIndexMatched) return 1.0f;
    float cos_t;
    const float reflectance = fresnel_dielectric(cos_h, eta, &cos_t);
    if (reflectance == 1.0f) return shadowing;
    const Vec3 wi = (cos_h / eta - cos_t) * h - (1.0f / eta) * wo;
    return reflectance * shadowing + (1.0f - reflectance) * shadowing_towards(wi);
  }

  float dielectric_fraction(float eta) const {
    return shadowing > 0.0f ? fresnel_fraction(fresnel_dielectric(cos_h, eta), eta) : 0.0f;
  }

  float schlick_fraction() const {
    return shadowing > 0.0f ? std::pow(clamp01(1.0f - cos_h), static_cast<float>(kSchlickExponent)) : 0.0f;
  }
};

void write_table(std::FILE* file, const char* name, const std::vector<double>& values, int samples) {
  std::fprintf(file, "constexpr float %s[%zu] = {\n", name, values.size());
  for (size_t i = 0; i < values.size(); ++i)
    std::fprintf(file, "%.7ff,%c", std::clamp(values[i] / samples, 0.0, 1.0), i % 16 == 15 ? '\n' : ' ');
  std::fprintf(file, "};\n");
}

void write_reflection_tables(std::FILE* file) {
  std::vector<double> albedo(kFine * kFine), average(kFine);
  for (size_t x = 0; x < kFine; ++x) {
    const float roughness = node(x, kFine);
    for (size_t y = 0; y < kFine; ++y)
      for (int i = 0; i < kSamples; ++i) {
        const auto u = quasi_random(kSteps2, i);
        albedo[y * kFine + x] += VisibleNormal(roughness, node(y, kFine), u[0], u[1]).shadowing;
      }
    for (int i = 0; i < kAverageSamples; ++i) {
      const auto u = quasi_random(kSteps3, i);
      const float mu = std::sqrt(u[2]);  // density 2 mu
      average[x] += VisibleNormal(roughness, mu, u[0], u[1]).shadowing;
    }
  }
  write_table(file, "kGgxAlbedo", albedo, kSamples);
  write_table(file, "kGgxAverage", average, kAverageSamples);
}

void write_dielectric_tables(std::FILE* file) {
  constexpr size_t kCells = kCoarse * kCoarse * kCoarse;
  std::vector<double> enter(kCells), leave(kCells), fraction(kCells), schlick(kCoarse * kCoarse);
  for (size_t x = 0; x < kCoarse; ++x)
    for (size_t y = 0; y < kCoarse; ++y)
      for (int i = 0; i < kSamples; ++i) {
        const auto u = quasi_random(kSteps2, i);
        const VisibleNormal normal(node(x, kCoarse), node(y, kCoarse), u[0], u[1]);
        schlick[y * kCoarse + x] += normal.schlick_fraction();
        for (size_t z = 0; z < kCoarse; ++z) {
          const float ior = ior_of_node(z);
          const size_t cell = (z * kCoarse + y) * kCoarse + x;
          enter[cell] += normal.glass(ior);
          leave[cell] += normal.glass(1.0f / ior);
          fraction[cell] += normal.dielectric_fraction(ior);
        }
      }
  write_table(file, "kGlassEnterAlbedo", enter, kSamples);
  write_table(file, "kGlassLeaveAlbedo", leave, kSamples);
  write_table(file, "kDielectricFraction", fraction, kSamples);
  write_table(file, "kSchlickFraction", schlick, kSamples);
}

void write_dielectric_averages(std::FILE* file) {
  constexpr size_t kCells = kCoarse * kCoarse;
  std::vector<double> enter(kCells), leave(kCells);
  for (size_t x = 0; x < kCoarse; ++x)
    for (int i = 0; i < kAverageSamples; ++i) {
      const auto u = quasi_random(kSteps3, i);
      const VisibleNormal normal(node(x, kCoarse), std::sqrt(u[2]), u[0], u[1]);
      for (size_t z = 0; z < kCoarse; ++z) {
        const size_t cell = z * kCoarse + x;
        enter[cell] += normal.glass(ior_of_node(z));
        leave[cell] += normal.glass(1.0f / ior_of_node(z));
      }
    }
  write_table(file, "kGlassEnterAverage", enter, kAverageSamples);
  write_table(file, "kGlassLeaveAverage", leave, kAverageSamples);
}

}  // namespace

int main(int argc, char** argv) {
  std::FILE* file = argc == 2 ? std::fopen(argv[1], "w") : nullptr;
  if (!file) {
    std::fprintf(stderr, "usage: generate_albedo_tables OUTPUT\n");
    return 1;
  }
  write_reflection_tables(file);
  write_dielectric_tables(file);
  write_dielectric_averages(file);
  return std::fclose(file) == 0 ? 0 : 1;
}
