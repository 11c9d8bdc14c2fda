#include "scene/known_tangents.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <set>
#include <tuple>

namespace cistern {
namespace {

/// Ordered and without repetition.
struct Wish {
  int mesh, attribute;
  bool is_of_original;
  friend bool operator<(const Wish& a, const Wish& b) {
    return std::tie(a.mesh, a.attribute, a.is_of_original) < std::tie(b.mesh, b.attribute, b.is_of_original);
  }
};

void add_wishes(const Scene& scene, int mesh, int material_set, std::set<Wish>& wishes) {
  const Mesh& shape = *scene.meshes[static_cast<size_t>(mesh)];
  if (shape.is_strands()) return;
  for (const int material : scene.material_sets[static_cast<size_t>(material_set)]) {
    if (material < 0 || !scene.materials[static_cast<size_t>(material)]) continue;
    const MaterialProgram& program = *scene.materials[static_cast<size_t>(material)];
    for (const TangentUse& use : program.tangents) {
      const int attribute = find_tangent_map(shape, program, use.name);
      if (attribute == kNoUvMap || (attribute >= 0 && shape.attributes[static_cast<size_t>(attribute)].components >= 2))
        wishes.insert({mesh, attribute, use.is_of_original});
    }
  }
}

std::set<Wish> wishes_of(const Scene& scene) {
  std::set<Wish> wishes;
  const auto reads_tangents = [](const auto& program) { return program && !program->tangents.empty(); };
  if (std::ranges::none_of(scene.materials, reads_tangents)) return wishes;
  std::set<std::pair<int, int>> seen;  // meshes and material sets
  for (const Instance& instance : scene.instances)
    if (instance.mesh >= 0 && seen.insert({instance.mesh, instance.material_set}).second)
      add_wishes(scene, instance.mesh, instance.material_set, wishes);
  return wishes;
}

/// What has them: a mesh, or what it was before displacement.
const std::shared_ptr<const Mesh>& shape_of(const Scene& scene, size_t mesh, bool is_of_original) {
  const std::shared_ptr<const Mesh>& shown = scene.meshes[mesh];
  return is_of_original && shown->undisplaced ? shown->undisplaced : shown;
}

}  // namespace

KnownTangents::KnownTangents(const Scene& scene) {
  for (size_t mesh = 0; mesh < scene.tangents.size(); ++mesh) {
    for (const MeshTangents& tangents : scene.tangents[mesh]) {
      const std::shared_ptr<const Mesh>& shape = shape_of(scene, mesh, tangents.is_of_original);
      known_.try_emplace({shape.get(), tangents.attribute}, Known{shape, tangents.corners});
    }
  }
}

std::vector<std::vector<MeshTangents>> KnownTangents::of(const Scene& scene) {
  std::erase_if(known_, [](const auto& entry) { return entry.second.mesh.expired(); });
  const std::set<Wish> wishes = wishes_of(scene);
  std::vector<std::map<Key, Known>::value_type*> found, missing;
  for (const Wish& wish : wishes) {
    const std::shared_ptr<const Mesh>& shape = shape_of(scene, static_cast<size_t>(wish.mesh), wish.is_of_original);
    const auto [entry, is_new] = known_.try_emplace({shape.get(), wish.attribute}, Known{shape, nullptr});
    found.push_back(&*entry);
    if (is_new) missing.push_back(&*entry);
  }
  tbb::parallel_for(size_t{0}, missing.size(), [&](size_t i) {
    const auto [mesh, attribute] = missing[i]->first;
    missing[i]->second.corners = std::make_shared<const CornerTangents>(corner_tangents(*mesh, attribute));
  });
  std::vector<std::vector<MeshTangents>> result(wishes.empty() ? 0 : scene.meshes.size());
  auto entry = found.begin();
  for (const Wish& wish : wishes)
    result[static_cast<size_t>(wish.mesh)].push_back({wish.attribute, wish.is_of_original, (*entry++)->second.corners});
  return result;
}

}  // namespace cistern
