#include <array>

#include "shading/color_matching.h"
#include "shading/nodes_color.h"

namespace cistern {
namespace {

constexpr double kSecondRadiation = 1.438776877e-2;  // hc/k in m K [CODATA 2018]
constexpr float kCoolest = 800.0f, kHottest = 12000.0f;
constexpr int kEntries = 257;  // uniform in 1/T, in which the colour is nearly linear

/// Planck's law through the matching functions, to Rec. 709 primaries with white D65, scaled to luminance 1.
Vec3 integrate_blackbody(double kelvin) {
  double x = 0.0, y = 0.0, z = 0.0;
  for (size_t i = 0; i < kColorMatching.size(); ++i) {
    const double wavelength = 1e-9 * matching_wavelength_nm(i);
    const double radiance = 1e-30 / (std::pow(wavelength, 5.0) * std::expm1(kSecondRadiation / (wavelength * kelvin)));
    x += radiance * static_cast<double>(kColorMatching[i].x);
    y += radiance * static_cast<double>(kColorMatching[i].y);
    z += radiance * static_cast<double>(kColorMatching[i].z);
  }
  x /= y;
  z /= y;
  const std::array<double, 3> rgb = rec709_from_xyz(x, 1.0, z);
  return {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])};
}

std::array<Vec3, kEntries> make_table() {
  std::array<Vec3, kEntries> table;
  for (int i = 0; i < kEntries; ++i) {
    const double t = static_cast<double>(i) / (kEntries - 1);
    const double inverse = (1.0 - t) / static_cast<double>(kCoolest) + t / static_cast<double>(kHottest);
    table[static_cast<size_t>(i)] = integrate_blackbody(1.0 / inverse);
  }
  return table;
}

/// Made on first use: code that ran as the module is loaded would run before binding/cpu_check.cpp has seen whether
/// this processor can.
const std::array<Vec3, kEntries>& blackbody_table() {
  static const std::array<Vec3, kEntries> table = make_table();
  return table;
}

}  // namespace

Vec3 blackbody_node(float kelvin) {
  const float t = kelvin > kCoolest ? std::min(kelvin, kHottest) : kCoolest;
  const float position = (1.0f / kCoolest - 1.0f / t) / (1.0f / kCoolest - 1.0f / kHottest);
  return max(ramp_lookup(blackbody_table(), position, false), Vec3{});
}

}  // namespace cistern
