#include "shading/dispersion.h"

#include <algorithm>
#include <array>

#include "shading/color_matching.h"

namespace cistern {
namespace {

/// Power of CIE standard illuminant D65 at the wavelengths of kColorMatching. [CIE 15:2018]
constexpr std::array<double, kColorMatching.size()> kD65{
    49.9755, 52.3118, 54.6482, 68.7015, 82.7549, 87.1204, 91.486,  92.4589, 93.4318, 90.057,  86.6823, 95.7736,
    104.865, 110.936, 117.008, 117.41,  117.812, 116.336, 114.861, 115.392, 115.923, 112.367, 108.811, 109.082,
    109.354, 108.578, 107.802, 106.296, 104.79,  106.239, 107.689, 106.047, 104.405, 104.225, 104.046, 102.023,
    100.0,   98.1671, 96.3342, 96.0611, 95.788,  92.2368, 88.6856, 89.3459, 90.0062, 89.8026, 89.5991, 88.6489,
    87.6987, 85.4936, 83.2886, 83.4939, 83.6992, 81.863,  80.0268, 80.1207, 80.2146, 81.2462, 82.2778, 80.281,
    78.2842, 74.0027, 69.7213, 70.6652, 71.6091, 72.979,  74.349,  67.9765, 61.604,  65.7448, 69.8856, 72.4863,
    75.087,  69.3398, 63.5927, 55.0054, 46.4182, 56.6118, 66.8054, 65.0941, 63.3828};

/// Linear in between, as a table: colours, and a density of about their size.
class Spectrum {
 public:
  Spectrum() {
    std::array<double, 3> white{};
    for (size_t i = 0; i < colors_.size(); ++i) {
      const Vec3 m = kColorMatching[i];
      colors_[i] = rec709_from_xyz(kD65[i] * double{m.x}, kD65[i] * double{m.y}, kD65[i] * double{m.z});
      const double share = i == 0 || i == kCells ? 0.5 : 1.0;
      for (size_t c = 0; c < 3; ++c) white[c] += share * colors_[i][c] / double{kCells};
    }
    for (auto& color : colors_)
      for (size_t c = 0; c < 3; ++c) color[c] /= white[c];
    const auto size = [&](size_t i) {
      return std::abs(colors_[i][0]) + std::abs(colors_[i][1]) + std::abs(colors_[i][2]);
    };
    double sum = 0.0;
    for (size_t i = 0; i < kCells; ++i) sum += density_[i] = size(i) + size(i + 1);
    for (double& density : density_) density *= double{kCells} / sum;
  }

  WavelengthSample sample(double u) const {
    double place = u * double{kCells};
    size_t cell = 0;
    while (cell + 1 < kCells && place >= density_[cell]) place -= density_[cell++];
    const double in_cell = std::clamp(place / density_[cell], 0.0, 1.0);
    const double nanometres = std::lerp(matching_wavelength_nm(cell), matching_wavelength_nm(cell + 1), in_cell);
    const auto channel = [&](size_t c) {
      return static_cast<float>(std::lerp(colors_[cell][c], colors_[cell + 1][c], in_cell) / density_[cell]);
    };
    return {static_cast<float>(1e-3 * nanometres), {channel(0), channel(1), channel(2)}};
  }

 private:
  static constexpr int kCells = static_cast<int>(kColorMatching.size()) - 1;
  std::array<std::array<double, 3>, kColorMatching.size()> colors_;
  std::array<double, kCells> density_{};  // of each cell, 1 in the mean
};

}  // namespace

float dispersed_ior(float ior, float inverse_abbe, float micrometres) {
  constexpr float kLineD = 0.5876f, kLineC = 0.6563f, kLineF = 0.4861f;  // helium, hydrogen
  constexpr float kPerSlope = 1.0f / (1.0f / (kLineF * kLineF) - 1.0f / (kLineC * kLineC));
  const float slope = (ior - 1.0f) * inverse_abbe * kPerSlope;
  return ior + slope * (1.0f / (micrometres * micrometres) - 1.0f / (kLineD * kLineD));
}

WavelengthSample sample_wavelength(float u) {
  static const Spectrum spectrum;
  return spectrum.sample(double{u});
}

std::string find_dispersive_material(const Scene& scene) {
  const bool is_any = std::ranges::any_of(scene.materials, [](const auto& m) { return m && m->disperses; });
  if (!is_any) return {};
  for (const Instance& instance : scene.instances) {
    if (instance.mesh < 0) continue;
    for (const int material : scene.material_sets[static_cast<size_t>(instance.material_set)]) {
      const auto& program = scene.materials[static_cast<size_t>(material)];
      if (program && program->disperses) return program->name;
    }
  }
  return {};
}

}  // namespace cistern
