#include "shading/displaced_scene.h"

#include <algorithm>
#include <map>
#include <unordered_map>

#include "shading/displace_mesh.h"
#include "subdivision/dice_mesh.h"
#include "subdivision/longest_edge.h"

namespace cistern {
namespace {

using IsStopped = std::function<bool()>;
using Programs = std::vector<std::shared_ptr<const MaterialProgram>>;

bool displaces(const std::shared_ptr<const MaterialProgram>& program) { return program && program->displaces(); }

/// By slot; null for those that move nothing.
Programs moving_programs(const Scene& scene, const Instance& instance) {
  Programs programs;
  for (const int material : scene.material_sets[static_cast<size_t>(instance.material_set)]) {
    const std::shared_ptr<const MaterialProgram> program =
        material < 0 ? nullptr : scene.materials[static_cast<size_t>(material)];
    programs.push_back(displaces(program) ? program : nullptr);
  }
  return programs;
}

std::vector<std::shared_ptr<const Image>> images_of(const Scene& scene, const Programs& programs) {
  std::vector<std::shared_ptr<const Image>> images;
  for (const auto& program : programs) {
    if (!program) continue;
    for (const int handle : program->images)
      images.push_back(handle < 0 ? nullptr : scene.images[static_cast<size_t>(handle)]);
  }
  return images;
}

/// Whether a displacement depends on where its object is, not only on how it is turned and scaled.
bool reads_place(const Instruction& i) {
  constexpr int kVectorKind = 0;  // of VECTOR_TRANSFORM: points
  const bool moves_points = i.op == Op::VECTOR_TRANSFORM && i.parameters[0] == kVectorKind;
  return moves_points || i.op == Op::POSITION || i.op == Op::OBJECT_LOCATION;
}

bool reads_camera(const Instruction& i) {
  constexpr int kCameraSpace = 2;
  const bool transforms =
      i.op == Op::VECTOR_TRANSFORM && (i.parameters[1] == kCameraSpace || i.parameters[2] == kCameraSpace);
  return transforms || i.op == Op::CAMERA_COORDINATE || i.op == Op::WINDOW_COORDINATE;
}

bool reads_values(const Instruction& i) { return i.op == Op::INSTANCE_VALUE || i.op == Op::INSTANCE_VALUE_ALPHA; }

bool any_reads(const Programs& programs, bool (*reads)(const Instruction&)) {
  return std::ranges::any_of(
      programs, [&](const auto& p) { return p && std::ranges::any_of(p->displacement_instructions, reads); });
}

bool is_same_operand(const MaterialProgram& a, const MaterialProgram& b, size_t i, size_t j) {
  if (a.inputs[i].is_constant() != b.inputs[j].is_constant()) return false;
  return a.inputs[i].is_constant() ? a.input_values[i] == b.input_values[j] : a.inputs[i] == b.inputs[j];
}

/// Whether two programs move vertices alike, whatever else they do.
bool is_same_displacement(const std::shared_ptr<const MaterialProgram>& a,
                          const std::shared_ptr<const MaterialProgram>& b) {
  if (a == b) return true;
  if (!a || !b) return false;
  const auto is_same = [&](const Instruction& i, const Instruction& j) {
    if (i.op != j.op || i.input_count != j.input_count || i.output != j.output ||
        !std::ranges::equal(i.parameters, j.parameters))
      return false;
    for (size_t k = 0; k < i.input_count; ++k)
      if (!is_same_operand(*a, *b, i.first_input + k, j.first_input + k)) return false;
    return true;
  };
  return std::ranges::equal(a->displacement_instructions, b->displacement_instructions, is_same) &&
         a->attribute_names == b->attribute_names && a->tables == b->tables && a->table_alphas == b->table_alphas &&
         a->images == b->images && a->tile_tables == b->tile_tables;
}

bool is_same_linear(const Transform& a, const Transform& b) {
  return a.row_x == b.row_x && a.row_y == b.row_y && a.row_z == b.row_z;
}

/// Whether what was made of `before` is what would be made of `now`.
bool is_made_alike(const DisplacedMesh& before, const DisplacedMesh& now) {
  const Transform &was = before.placement.object_to_world, &is = now.placement.object_to_world;
  if (before.source != now.source || before.images != now.images || !is_same_linear(was, is) ||
      before.placement.random != now.placement.random || before.placement.object != now.placement.object ||
      !std::ranges::equal(before.programs, now.programs, is_same_displacement))
    return false;
  const bool sees_camera = any_reads(now.programs, reads_camera);
  if ((sees_camera || any_reads(now.programs, reads_place)) && was.translation != is.translation) return false;
  if (sees_camera && !(before.camera == now.camera)) return false;
  if (!any_reads(now.programs, reads_values)) return true;
  return before.values == now.values && before.placement.values == now.placement.values;
}

/// `scene` has the meshes as they are diced. Taken from those that are kept, or made now.
DisplacedMesh displaced_mesh(const std::vector<DisplacedMesh>& kept, const Scene& scene, uint32_t index,
                             const IsStopped& is_stopped) {
  const Instance& instance = scene.instances[index];
  DisplacedMesh displaced;
  displaced.source = scene.meshes[static_cast<size_t>(instance.mesh)];
  displaced.programs = moving_programs(scene, instance);
  displaced.images = images_of(scene, displaced.programs);
  displaced.placement = instance;
  displaced.values = scene.instance_values;
  displaced.camera = scene.camera;
  const auto known = std::ranges::find_if(kept, [&](const auto& before) { return is_made_alike(before, displaced); });
  if (known != kept.end()) {
    displaced.mesh = known->mesh;
    displaced.warning = known->warning;
  } else {
    displace_mesh(displaced, scene, index, is_stopped);
  }
  return displaced;
}

bool can_be_displaced(const Scene& scene, const Instance& instance) {
  if (instance.mesh < 0) return false;
  const std::shared_ptr<const Mesh>& mesh = scene.meshes[static_cast<size_t>(instance.mesh)];
  return mesh && !mesh->is_strands() && mesh->triangle_count() > 0;
}

/// Returns the handle of a mesh that is to be shown in place of another.
int add_in_place_of(int handle, std::shared_ptr<const Mesh> mesh, Scene& scene) {
  scene.displaced_from.push_back(scene.undisplaced(handle));
  scene.meshes.push_back(std::move(mesh));
  return static_cast<int>(scene.meshes.size() - 1);
}

using Dicings = std::map<int, Dicing>;  // by handle of the source

bool has_cage(const Scene& scene, const Instance& instance) {
  return can_be_displaced(scene, instance) && scene.meshes[static_cast<size_t>(instance.mesh)]->cage;
}

/// For the scene's own view, as the instance that shows a mesh largest is placed.
Dicings own_dicings(const Scene& scene) {
  std::map<int, float> largest;
  Dicings dicings;
  for (const Instance& instance : scene.instances) {
    if (!has_cage(scene, instance)) continue;
    const std::shared_ptr<const Mesh>& mesh = scene.meshes[static_cast<size_t>(instance.mesh)];
    const float size = seen_size(*scene.dicing, mesh->bounds, instance.object_to_world);
    const auto [known, is_new] = largest.try_emplace(instance.mesh, size);
    if (!is_new && !(size > known->second)) continue;
    known->second = size;
    dicings[instance.mesh] = {mesh, mesh, *scene.dicing, instance.object_to_world};
  }
  return dicings;
}

bool has_same_polygons(const Mesh& a, const Mesh& b) {
  return a.positions.size() == b.positions.size() && a.cage->offsets == b.cage->offsets &&
         a.cage->vertices == b.cage->vertices;
}

/// As `middle` shows the same instances.
Dicings dicings_as(const Scene& middle, const Scene& scene) {
  std::unordered_map<uint64_t, const Instance*> by_key;
  for (const Instance& instance : middle.instances)
    if (instance.key != 0) by_key.try_emplace(instance.key, &instance);
  Dicings dicings;
  for (const Instance& instance : scene.instances) {
    const auto found = has_cage(scene, instance) ? by_key.find(instance.key) : by_key.end();
    if (found == by_key.end() || found->second->mesh < 0 || dicings.contains(instance.mesh)) continue;
    const auto& then = middle.meshes[static_cast<size_t>(found->second->mesh)]->dicing;
    const std::shared_ptr<const Mesh>& mesh = scene.meshes[static_cast<size_t>(instance.mesh)];
    if (then && has_same_polygons(*then->cut_as, *mesh))
      dicings[instance.mesh] = {mesh, then->cut_as, then->view, then->object_to_world};
  }
  return dicings;
}

/// Whether what was diced is what it would be diced to now, or may stay.
bool is_diced_alike(const Dicing& before, const Dicing& now) {
  if (before.source != now.source || before.cut_as != now.cut_as) return false;
  const DicingView &was = before.view, &is = now.view;
  if (is.stays_diced)
    return was.rate == is.rate && was.offscreen_scale == is.offscreen_scale && was.most_levels == is.most_levels;
  return was == is && before.object_to_world == now.object_to_world;
}

/// Replaces meshes by what they are diced to; false once stopped.
bool dice_meshes(const Dicings& dicings, SceneBuilder& builder, DisplacedScene& result, Scene& scene,
                 const IsStopped& is_stopped) {
  std::vector<DicedMesh> made;
  std::map<int, int> handles;
  for (const auto& entry : dicings) {
    const int handle = entry.first;
    const Dicing& dicing = entry.second;
    const auto known = std::ranges::find_if(
        builder.diced_meshes(), [&](const DicedMesh& before) { return is_diced_alike(before.dicing, dicing); });
    if (known != builder.diced_meshes().end()) {
      made.push_back(*known);
    } else {
      dice_mesh(made.emplace_back(DicedMesh{dicing, {}, {}}), is_stopped);
    }
    if (!made.back().mesh) return false;
    if (!made.back().warning.empty()) result.warnings.push_back(made.back().warning);
    handles[handle] = add_in_place_of(handle, made.back().mesh, scene);
  }
  builder.diced_meshes() = std::move(made);
  for (Instance& instance : scene.instances)
    if (const auto found = handles.find(instance.mesh); found != handles.end()) instance.mesh = found->second;
  return true;
}

/// The same of displacement.
bool displace_meshes(SceneBuilder& builder, DisplacedScene& result, Scene& scene, const IsStopped& is_stopped) {
  std::vector<DisplacedMesh> made;
  std::map<std::pair<int, int>, int> handles;  // by mesh and material set; -1: not displaced
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    Instance& instance = scene.instances[i];
    if (!can_be_displaced(scene, instance)) continue;
    const auto [known, is_new] = handles.try_emplace({instance.mesh, instance.material_set}, -1);
    if (is_new && std::ranges::any_of(moving_programs(scene, instance), displaces)) {
      made.push_back(displaced_mesh(builder.displaced_meshes(), scene, i, is_stopped));
      if (!made.back().mesh) return false;
      if (!made.back().warning.empty()) result.warnings.push_back(made.back().warning);
      known->second = add_in_place_of(instance.mesh, made.back().mesh, scene);
    }
    if (known->second >= 0) instance.mesh = known->second;
  }
  builder.displaced_meshes() = std::move(made);
  return true;
}

}  // namespace

DisplacedScene displaced_snapshot(SceneBuilder& builder, const Scene* middle, const IsStopped& is_stopped) {
  const Scene& scene = builder.scene();
  const Dicings dicings = middle != nullptr ? dicings_as(*middle, scene)
                          : scene.dicing    ? own_dicings(scene)
                                            : Dicings();
  if (dicings.empty() && std::ranges::none_of(scene.materials, displaces)) {
    builder.displaced_meshes().clear();
    builder.diced_meshes().clear();
    return {builder.snapshot(), {}};
  }
  DisplacedScene result;
  const auto shown = std::make_shared<Scene>(scene);
  if (!dice_meshes(dicings, builder, result, *shown, is_stopped)) return result;
  shown->tangents = builder.known_tangents().of(*shown);  // displacement may read them
  if (!displace_meshes(builder, result, *shown, is_stopped)) return result;
  shown->tangents = builder.known_tangents().of(*shown);
  result.scene = shown;
  return result;
}

}  // namespace cistern
