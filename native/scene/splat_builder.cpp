#include "scene/splat_builder.h"

#include <tbb/parallel_sort.h>

#include "base/check.h"
#include "base/morton.h"

namespace cistern {
namespace {

constexpr float kSmallest = 1e-15f, kLargest = 1e15f;  // deviations, whose squares are numbers
constexpr float kFarthest = 1e18f;                     // as far as Embree goes
constexpr Vec3 kBrightest{1e4f, 1e4f, 1e4f};           // coefficients

void check_length(const SplatInput& input, const char* what, size_t length) {
  if (length == input.positions.size()) return;
  throw Error(input.name, std::string(what) + " have " + std::to_string(length) + " elements: must have " +
                              std::to_string(input.positions.size()));
}

void check_input(const SplatInput& input) {
  check_length(input, "scales", input.scales.size());
  check_length(input, "rotations", input.rotations.size());
  check_length(input, "radiance and opacity", input.radiance.size());
  if (!input.harmonics.empty()) check_length(input, "harmonics", input.harmonics.size());
  for (const MeshAttribute& attribute : input.attributes)
    if (attribute.domain != Domain::POINT || attribute.components < 1 || attribute.components > 4)
      throw Error(input.name, "attribute \"" + attribute.name + "\" must have 1 to 4 components, one for each splat");
}

Vec3 magnitude(Vec3 v) { return {std::abs(v.x), std::abs(v.y), std::abs(v.z)}; }

/// Columns of the matrix that turns by a quaternion w, x, y, z of any length but 0.
std::array<Vec3, 3> axes_of(const std::array<float, 4>& q) {
  const float scale = 1.0f / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const float w = scale * q[0], x = scale * q[1], y = scale * q[2], z = scale * q[3];
  return {Vec3{1.0f - 2.0f * (y * y + z * z), 2.0f * (x * y + w * z), 2.0f * (x * z - w * y)},
          Vec3{2.0f * (x * y - w * z), 1.0f - 2.0f * (x * x + z * z), 2.0f * (y * z + w * x)},
          Vec3{2.0f * (x * z + w * y), 2.0f * (y * z - w * x), 1.0f - 2.0f * (x * x + y * y)}};
}

int flattest_of(Vec3 deviations) {
  if (deviations.x <= deviations.y && deviations.x <= deviations.z) return 0;
  return deviations.y <= deviations.z ? 1 : 2;
}

/// Where the opacity of a Gaussian without direction has fallen to the least that is shown.
float radius_of(float opacity, Vec3 deviations) {
  return std::sqrt(2.0f * std::log(opacity / kLeastSplatOpacity)) *
         std::max(std::max(deviations.x, deviations.y), deviations.z);
}

/// None for what has no shape: deviations or a rotation of nothing, or no numbers.
std::optional<Gaussian> make_gaussian(const SplatInput& input, uint32_t splat) {
  const float opacity = input.radiance[splat][3];
  const std::array<Vec3, 3> axes = axes_of(input.rotations[splat]);
  const Vec3 deviations = magnitude(input.scales[splat]);
  const auto is_usable = [](float d) { return d >= kSmallest && d <= kLargest; };
  const bool has_shape = is_usable(deviations.x) && is_usable(deviations.y) && is_usable(deviations.z) &&
                         is_finite(axes[0]) && is_finite(axes[1]) && is_finite(axes[2]) && std::isfinite(opacity);
  Gaussian gaussian;
  gaussian.middle = input.positions[splat];
  const Vec3 from_origin = magnitude(gaussian.middle);
  const bool is_in_reach = std::max(std::max(from_origin.x, from_origin.y), from_origin.z) <= kFarthest &&
                           is_finite(from_origin) && opacity <= kLargest;
  if (!has_shape || !is_in_reach) return std::nullopt;
  gaussian.row_x = axes[0] * (1.0f / deviations.x);
  gaussian.row_y = axes[1] * (1.0f / deviations.y);
  gaussian.row_z = axes[2] * (1.0f / deviations.z);
  gaussian.opacity = opacity;
  gaussian.radius = radius_of(opacity, deviations);
  gaussian.splat = splat;
  gaussian.flattest = flattest_of(deviations);
  return gaussian;
}

/// Along Morton's curve, so that splats that a ray looks at are near each other in memory.
void sort_by_place(std::vector<Gaussian>& gaussians) {
  Bounds3 bounds;
  for (const Gaussian& gaussian : gaussians) bounds.extend(gaussian.middle);
  std::vector<std::pair<uint32_t, uint32_t>> order(gaussians.size());
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = {morton_code(gaussians[i].middle, bounds), i};
  tbb::parallel_sort(order);
  std::vector<Gaussian> sorted(gaussians.size());
  for (size_t i = 0; i < order.size(); ++i) sorted[i] = gaussians[order[i].second];
  gaussians = std::move(sorted);
}

}  // namespace

Mesh build_splats(const SplatInput& input) {
  check_input(input);
  const size_t count = input.positions.size();
  auto cloud = std::make_shared<SplatCloud>();
  auto colors = std::make_shared<SplatColors>();
  Mesh mesh;
  mesh.name = input.name;
  mesh.strand_shape = StrandShape::SPLATS;
  mesh.positions.assign(input.positions.begin(), input.positions.end());
  mesh.radii.resize(count);
  mesh.corner_count = static_cast<uint32_t>(count);
  mesh.vertices.reserve(count);
  mesh.polygons.reserve(count);
  cloud->gaussians.reserve(count);
  colors->base.reserve(count);
  for (uint32_t i = 0; i < count; ++i) {
    const std::array<float, 4>& radiance = input.radiance[i];
    colors->base.push_back(max(-kBrightest, min(kBrightest, Vec3{radiance[0], radiance[1], radiance[2]})));
    if (std::isfinite(radiance[3]) && !(radiance[3] > kLeastSplatOpacity)) continue;  // nothing to be seen
    const std::optional<Gaussian> gaussian = make_gaussian(input, i);
    if (!gaussian) {
      ++mesh.dropped_triangles;
      continue;
    }
    cloud->gaussians.push_back(*gaussian);
  }
  sort_by_place(cloud->gaussians);
  for (const Gaussian& gaussian : cloud->gaussians) {
    const uint32_t i = gaussian.splat;
    mesh.radii[i] = gaussian.radius;
    mesh.vertices.push_back({i, i, i});
    mesh.polygons.push_back(i);
    mesh.bounds.extend(gaussian.middle);
  }
  mesh.vertices.shrink_to_fit();
  mesh.polygons.shrink_to_fit();
  colors->harmonics.assign(input.harmonics.begin(), input.harmonics.end());
  colors->has_colour_matrix = input.to_working_space.has_value();
  if (input.to_working_space) colors->to_working_space = *input.to_working_space;
  cloud->colors = std::move(colors);
  mesh.splats = std::move(cloud);
  mesh.attributes = input.attributes;
  for (MeshAttribute& attribute : mesh.attributes) attribute.name_hash = attribute_name_hash(attribute.name);
  return mesh;
}

}  // namespace cistern
