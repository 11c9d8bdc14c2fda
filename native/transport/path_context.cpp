#include "transport/path_context.h"

#include <algorithm>
#include <cmath>

namespace cistern {
namespace {

constexpr uint8_t kScattered = kVisibleToReflected | kVisibleToTransmitted;

bool may_emit(const Scene& scene, const Instance& instance) {
  if (instance.mesh < 0) return false;
  const auto emits = [&](int material) {
    const auto& program = scene.materials[static_cast<size_t>(material)];
    return program && program->may_emit;
  };
  return std::ranges::any_of(scene.material_sets[static_cast<size_t>(instance.material_set)], emits);
}

}  // namespace

bool tells_kinds(uint8_t visibility) {
  return (visibility & kScattered) != 0 && (visibility & kScattered) != kScattered;
}

GlossLimits gloss_limits(const PathLimits& limits, uint8_t ray_kind, float least_pdf) {
  GlossLimits gloss;
  if ((ray_kind & (kVisibleToDiffuse | kVisibleToTranslucent)) != 0) {
    gloss.has_reflection = limits.caustics_reflective;
    gloss.has_refraction = limits.caustics_refractive;
  }
  constexpr float kMostAlpha = 0.5f;
  if (least_pdf < limits.filter_glossy)
    gloss.least_alpha = kMostAlpha * std::sqrt(1.0f - least_pdf / limits.filter_glossy);
  return gloss;
}

bool scatter_kinds_matter(const Scene& scene, const PathLimits& limits) {
  const int least = std::min({limits.max_diffuse_bounces, limits.max_glossy_bounces, limits.max_transmission_bounces});
  if (least < limits.max_bounces || !limits.caustics_reflective || !limits.caustics_refractive) return true;
  const auto is_told = [](const auto& object) { return tells_kinds(object.visibility); };
  const auto is_told_lamp = [&](const Light& light) { return is_told(light) && !is_portal(light); };
  if (std::ranges::any_of(scene.instances, is_told) || std::ranges::any_of(scene.lights, is_told_lamp)) return true;
  if (is_told(scene.environment)) return true;
  return std::ranges::any_of(scene.materials,
                             [](const auto& material) { return material && material->reads_light_path; });
}

bool emitters_tell_kinds(const Scene& scene) {
  if (tells_kinds(scene.environment.visibility)) return true;
  const auto is_lamp = [](const Light& light) {
    return !light.removed && light.use_mis && tells_kinds(light.visibility) && !is_portal(light);
  };
  const auto is_surface = [&](const Instance& instance) {
    return tells_kinds(instance.visibility) && may_emit(scene, instance);
  };
  return std::ranges::any_of(scene.lights, is_lamp) || std::ranges::any_of(scene.instances, is_surface);
}

bool shadow_rays_see_alike(const Scene& scene) {
  const auto is_alike = [](const Instance& instance) {
    const bool to_shadow = instance.visibility & kVisibleToShadow;
    const uint8_t to_scattered = instance.visibility & kScattered;
    return to_shadow ? to_scattered == kScattered : to_scattered == 0;
  };
  const auto is_even = [](const auto& program) {
    return !program || !program->may_be_transparent || (program->has_transparent_shadow && !program->reads_light_path);
  };
  return std::ranges::all_of(scene.instances, is_alike) && std::ranges::all_of(scene.materials, is_even);
}

LightGroup light_group_of(const PathContext& context, uint32_t emitter) {
  if (const auto lamp = context.lights.lamp_of(emitter)) return context.scene.lights[*lamp].light_group;
  if (const auto triangle = context.lights.triangle_of(emitter))
    return context.scene.instances[triangle->instance].light_group;
  return context.scene.environment.light_group;
}

}  // namespace cistern
