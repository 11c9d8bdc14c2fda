#include "shading/color_matching.h"
#include "shading/nodes_color.h"

namespace cistern {
namespace {

constexpr double kScale = 1.0 / 2.52;  // Blender's, which keeps every channel below 1

}  // namespace

Vec3 wavelength_node(float nanometres) {
  constexpr size_t kLast = kColorMatching.size() - 1;
  const double place = (static_cast<double>(nanometres) - matching_wavelength_nm(0)) /
                       (matching_wavelength_nm(1) - matching_wavelength_nm(0));
  if (!(place >= 0.0 && place < static_cast<double>(kLast))) return {};
  const size_t below = static_cast<size_t>(place);
  const Vec3 xyz =
      lerp(kColorMatching[below], kColorMatching[below + 1], static_cast<float>(place - static_cast<double>(below)));
  const std::array<double, 3> rgb = rec709_from_xyz(
      kScale * static_cast<double>(xyz.x), kScale * static_cast<double>(xyz.y), kScale * static_cast<double>(xyz.z));
  return {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])};
}

}  // namespace cistern
