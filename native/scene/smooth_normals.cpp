#include "scene/smooth_normals.h"

#include <algorithm>
#include <cmath>

namespace cistern {

std::vector<Vec3> smooth_normals(const Mesh& mesh) {
  std::vector<Vec3> sums(mesh.positions.size());
  for (size_t t = 0; t < mesh.triangle_count(); ++t) {
    const std::array<Vec3, 3> p = mesh.triangle_positions(t);
    const Vec3 normal = normalize_or(cross(p[1] - p[0], p[2] - p[0]), {});
    for (size_t j = 0; j < 3; ++j) {
      const Vec3 a = normalize_or(p[(j + 1) % 3] - p[j], {}), b = normalize_or(p[(j + 2) % 3] - p[j], {});
      sums[mesh.vertices[t][j]] += std::acos(std::clamp(dot(a, b), -1.0f, 1.0f)) * normal;
    }
  }
  for (Vec3& sum : sums) sum = normalize_or(sum, {0.0f, 0.0f, 1.0f});
  return sums;
}

}  // namespace cistern
