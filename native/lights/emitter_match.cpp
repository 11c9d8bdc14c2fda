#include "lights/emitter_match.h"

#include <algorithm>
#include <unordered_map>

#include "base/parallel.h"
#include "lights/emissive_triangles.h"

namespace cistern {
namespace {

constexpr size_t kBlockSize = 4096;

/// The earlier index of one of several things, by the match that a SceneChange has of them.
std::optional<uint32_t> earlier_index(const std::vector<uint32_t>& matches, uint32_t index) {
  if (matches.empty()) return index;
  if (matches[index] == SceneChange::kNone) return std::nullopt;
  return matches[index];
}

/// Earlier emitter of each light; an earlier lamp that did not emit has none.
std::unordered_map<uint32_t, uint32_t> lamp_emitters(const LightSet& lights) {
  std::unordered_map<uint32_t, uint32_t> emitters;
  for (uint32_t e = 0; e < lights.emitter_count() && lights.lamp_of(e); ++e) emitters.emplace(*lights.lamp_of(e), e);
  return emitters;
}

bool emits(const Scene& scene, const Instance& instance) {
  if (instance.mesh < 0) return false;
  return std::ranges::any_of(scene.material_sets[static_cast<size_t>(instance.material_set)],
                             [&](int material) { return is_emitter(scene, material); });
}

const Mesh* mesh_of(const Scene& scene, const Instance& instance) {
  return instance.mesh < 0 ? nullptr : scene.meshes[static_cast<size_t>(instance.mesh)].get();
}

}  // namespace

bool has_same_emitters(const Scene& earlier, const Scene& later, const SceneChange& change) {
  const bool is_shaded_anew = change.materials || (change.camera && change.camera_is_shaded);
  if (is_shaded_anew || change.lamps || change.environment) return false;
  if (!change.surfaces) return true;
  return std::ranges::equal(earlier.instances, later.instances, [&](const Instance& a, const Instance& b) {
    const bool is_same = a == b && mesh_of(earlier, a) == mesh_of(later, b);
    return is_same || (!emits(earlier, a) && !emits(later, b));
  });
}

EmitterMatch::EmitterMatch(const LightSet& earlier, const LightSet& later, const SceneChange& change)
    : earlier_of_(later.emitter_count(), kNone), later_of_(earlier.emitter_count(), kNone) {
  const std::unordered_map<uint32_t, uint32_t> earlier_lamps = lamp_emitters(earlier);
  const auto find = [&](uint32_t emitter) -> std::optional<uint32_t> {
    if (const auto light = later.lamp_of(emitter)) {
      const auto before = earlier_index(change.earlier_lights, *light);
      const auto found = before ? earlier_lamps.find(*before) : earlier_lamps.end();
      return found == earlier_lamps.end() ? std::nullopt : std::optional(found->second);
    }
    if (const auto t = later.triangle_of(emitter)) {
      const auto before = earlier_index(change.earlier_instances, t->instance);
      const auto found = before ? earlier.emitter_of(*before, t->triangle) : std::nullopt;
      // What another one stood for has no samples of its own.
      const bool is_own = found && earlier.triangle_of(*found) == LightSet::Triangle{*before, t->triangle};
      return is_own ? found : std::nullopt;
    }
    return change.environment ? std::nullopt : earlier.environment_emitter();
  };
  parallel_blocks(earlier_of_.size(), kBlockSize, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const std::optional<uint32_t> before = find(static_cast<uint32_t>(i));
      if (!before) continue;
      earlier_of_[i] = *before;
      later_of_[*before] = static_cast<uint32_t>(i);  // no two emitters have the same earlier one
    }
  });
}

}  // namespace cistern
