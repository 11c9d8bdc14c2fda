#include "shading/displaced_scene.h"

#include <algorithm>
#include <map>

#include "shading/displace_mesh.h"
#include "subdivision/dice_mesh.h"
#include "subdivision/longest_edge.h"

namespace cistern {
namespace {

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
DisplacedMesh displaced_mesh(const std::vector<DisplacedMesh>& kept, const Scene& scene, uint32_t index) {
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
    displace_mesh(displaced, scene, index);
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
  const size_t own = scene.meshes.size() - scene.displaced_from.size(), other = static_cast<size_t>(handle);
  scene.displaced_from.push_back(other < own ? handle : scene.displaced_from[other - own]);
  scene.meshes.push_back(std::move(mesh));
  return static_cast<int>(scene.meshes.size() - 1);
}

/// Of each mesh with a cage, the instance that shows it largest.
std::map<int, uint32_t> largest_instances(const Scene& scene) {
  std::map<int, std::pair<float, uint32_t>> largest;
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (!can_be_displaced(scene, instance)) continue;
    const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
    if (!mesh.cage) continue;
    const float size = seen_size(*scene.dicing, mesh.bounds, instance.object_to_world);
    const auto [known, is_new] = largest.try_emplace(instance.mesh, size, i);
    if (!is_new && size > known->second.first) known->second = {size, i};
  }
  std::map<int, uint32_t> instances;
  for (const auto& [mesh, found] : largest) instances.emplace(mesh, found.second);
  return instances;
}

bool is_diced_alike(const DicedMesh& before, const DicedMesh& now) {
  return before.source == now.source && before.view == now.view &&
         (now.view.ignores_moves || before.object_to_world == now.object_to_world);
}

/// Replaces meshes with a cage by what they are diced to.
void dice_meshes(SceneBuilder& builder, Scene& scene, std::vector<std::string>& warnings) {
  std::vector<DicedMesh> made;
  std::map<int, int> handles;
  if (scene.dicing) {
    for (const auto& [handle, instance] : largest_instances(scene)) {
      DicedMesh& diced = made.emplace_back();
      diced.source = scene.meshes[static_cast<size_t>(handle)];
      diced.view = *scene.dicing;
      diced.object_to_world = scene.instances[instance].object_to_world;
      const auto known = std::ranges::find_if(builder.diced_meshes(),
                                              [&](const DicedMesh& before) { return is_diced_alike(before, diced); });
      if (known != builder.diced_meshes().end()) {
        diced = *known;
      } else {
        dice_mesh(diced);
      }
      if (!diced.warning.empty()) warnings.push_back(diced.warning);
      handles[handle] = add_in_place_of(handle, diced.mesh, scene);
    }
  }
  builder.diced_meshes() = std::move(made);
  for (Instance& instance : scene.instances)
    if (const auto found = handles.find(instance.mesh); found != handles.end()) instance.mesh = found->second;
}

void displace_meshes(SceneBuilder& builder, Scene& scene, std::vector<std::string>& warnings) {
  std::vector<DisplacedMesh> made;
  std::map<std::pair<int, int>, int> handles;  // by mesh and material set; -1: not displaced
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    Instance& instance = scene.instances[i];
    if (!can_be_displaced(scene, instance)) continue;
    const auto [known, is_new] = handles.try_emplace({instance.mesh, instance.material_set}, -1);
    if (is_new && std::ranges::any_of(moving_programs(scene, instance), displaces)) {
      made.push_back(displaced_mesh(builder.displaced_meshes(), scene, i));
      if (!made.back().warning.empty()) warnings.push_back(made.back().warning);
      known->second = add_in_place_of(instance.mesh, made.back().mesh, scene);
    }
    if (known->second >= 0) instance.mesh = known->second;
  }
  builder.displaced_meshes() = std::move(made);
}

bool is_shown_as_built(const Scene& scene) {
  const auto has_cage = [](const std::shared_ptr<const Mesh>& mesh) { return mesh && mesh->cage; };
  return std::ranges::none_of(scene.materials, displaces) &&
         !(scene.dicing && std::ranges::any_of(scene.meshes, has_cage));
}

}  // namespace

DisplacedScene displaced_snapshot(SceneBuilder& builder) {
  if (is_shown_as_built(builder.scene())) {
    builder.displaced_meshes().clear();
    builder.diced_meshes().clear();
    return {builder.snapshot(), {}};
  }
  DisplacedScene result;
  const auto shown = std::make_shared<Scene>(builder.scene());
  dice_meshes(builder, *shown, result.warnings);
  displace_meshes(builder, *shown, result.warnings);
  result.scene = shown;
  return result;
}

}  // namespace cistern
