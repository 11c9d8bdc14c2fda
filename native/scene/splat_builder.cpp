#include "scene/splat_builder.h"

#include "base/check.h"
#include "base/frame.h"

namespace cistern {
namespace {

constexpr float kSmallest = 1e-15f, kLargest = 1e15f;  // deviations, whose squares are numbers

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

/// Opacity 0 for what has no shape: deviations or a rotation of nothing, or no numbers.
Gaussian make_gaussian(Vec3 scale, const std::array<float, 4>& rotation, float opacity) {
  const std::array<Vec3, 3> axes = axes_of(rotation);
  const Vec3 deviations = magnitude(scale);
  const auto is_usable = [](float d) { return d >= kSmallest && d <= kLargest; };
  const bool has_shape = is_usable(deviations.x) && is_usable(deviations.y) && is_usable(deviations.z) &&
                         is_finite(axes[0]) && is_finite(axes[1]) && is_finite(axes[2]) && std::isfinite(opacity);
  if (!has_shape) return {};
  return {axes[0] * (1.0f / deviations.x), axes[1] * (1.0f / deviations.y), axes[2] * (1.0f / deviations.z), opacity,
          flattest_of(deviations)};
}

/// Where the opacity of a Gaussian without direction has fallen to the least that is shown; 0: nowhere above it.
float radius_of(float opacity, Vec3 scale) {
  if (!(opacity > kLeastSplatOpacity)) return 0.0f;
  const Vec3 deviations = magnitude(scale);
  return std::sqrt(2.0f * std::log(opacity / kLeastSplatOpacity)) *
         std::max(std::max(deviations.x, deviations.y), deviations.z);
}

}  // namespace

Mesh build_splats(const SplatInput& input) {
  check_input(input);
  const size_t count = input.positions.size();
  auto cloud = std::make_shared<SplatCloud>();
  Mesh mesh;
  mesh.name = input.name;
  mesh.strand_shape = StrandShape::SPLATS;
  mesh.positions.assign(input.positions.begin(), input.positions.end());
  mesh.radii.resize(count);
  mesh.corner_count = static_cast<uint32_t>(count);
  mesh.vertices.reserve(count);
  mesh.polygons.reserve(count);
  cloud->gaussians.resize(count);
  cloud->base.resize(count);
  for (uint32_t i = 0; i < count; ++i) {
    const std::array<float, 4>& radiance = input.radiance[i];
    cloud->base[i] = {radiance[0], radiance[1], radiance[2]};
    if (std::isfinite(radiance[3]) && !(radiance[3] > kLeastSplatOpacity)) continue;  // nothing to be seen
    cloud->gaussians[i] = make_gaussian(input.scales[i], input.rotations[i], radiance[3]);
    if (cloud->gaussians[i].opacity == 0.0f || !is_finite(input.positions[i])) {
      ++mesh.dropped_triangles;
      continue;
    }
    mesh.radii[i] = radius_of(radiance[3], input.scales[i]);
    mesh.vertices.push_back({i, i, i});
    mesh.polygons.push_back(i);
    mesh.bounds.extend(input.positions[i]);
  }
  mesh.vertices.shrink_to_fit();
  mesh.polygons.shrink_to_fit();
  cloud->harmonics.assign(input.harmonics.begin(), input.harmonics.end());
  cloud->has_colour_matrix = input.to_working_space.has_value();
  if (input.to_working_space) cloud->to_working_space = *input.to_working_space;
  mesh.splats = std::move(cloud);
  mesh.attributes = input.attributes;
  for (MeshAttribute& attribute : mesh.attributes) attribute.name_hash = attribute_name_hash(attribute.name);
  return mesh;
}

}  // namespace cistern
