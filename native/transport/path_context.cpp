#include "transport/path_context.h"

#include <algorithm>

namespace cistern {
namespace {

constexpr uint8_t kScattered = kVisibleToDiffuse | kVisibleToGlossy | kVisibleToTransmission;

bool tells_kinds(uint8_t visibility) {
  return (visibility & kScattered) != 0 && (visibility & kScattered) != kScattered;
}

}  // namespace

bool scatter_kinds_matter(const Scene& scene, const PathLimits& limits) {
  const int least = std::min({limits.max_diffuse_bounces, limits.max_glossy_bounces, limits.max_transmission_bounces});
  if (least < limits.max_bounces) return true;
  const auto is_told = [](const auto& object) { return tells_kinds(object.visibility); };
  if (std::ranges::any_of(scene.instances, is_told) || std::ranges::any_of(scene.lights, is_told)) return true;
  if (is_told(scene.environment)) return true;
  return std::ranges::any_of(scene.materials,
                             [](const auto& material) { return material && material->reads_light_path; });
}

}  // namespace cistern
