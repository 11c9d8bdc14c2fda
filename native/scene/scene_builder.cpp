#include "scene/scene_builder.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/check.h"
#include "scene/mesh_builder.h"
#include "scene/scene_checks.h"
#include "scene/splat_builder.h"
#include "scene/strand_builder.h"
#include "scene/volume_builder.h"

namespace cistern {
namespace {

constexpr float kLeastDicingRate = 1e-3f;
constexpr int kMostDicingLevels = 20;  // halves of halves are told apart by floats
constexpr Vec3 kDefaultGrey{0.8f, 0.8f, 0.8f};

void check_handle(const std::string& owner, const char* what, int handle, size_t count) {
  if (handle >= 0 && static_cast<size_t>(handle) < count) return;
  throw Error(owner, std::string(what) + " handle is " + std::to_string(handle) +
                         ": must be at least 0 and less than " + std::to_string(count));
}

/// Puts `value` at the handle to replace, or at a new one.
template <class T>
int store(std::vector<T>& values, T value, std::optional<int> replace) {
  if (replace) {
    values[static_cast<size_t>(*replace)] = std::move(value);
    return *replace;
  }
  values.push_back(std::move(value));
  return static_cast<int>(values.size() - 1);
}

/// The same, but an equal object stays the very one it was.
template <class T, class IsSame>
int store_shared(std::vector<std::shared_ptr<const T>>& values, T value, std::optional<int> replace,
                 const IsSame& is_same) {
  if (replace) {
    const std::shared_ptr<const T>& old = values[static_cast<size_t>(*replace)];
    if (old && is_same(*old, value)) return *replace;
  }
  return store(values, std::make_shared<const T>(std::move(value)), replace);
}

void check_replace(const std::string& owner, const char* what, std::optional<int> replace, size_t count) {
  if (replace) check_handle(owner, what, *replace, count);
}

/// Grey diffuse, as Blender shades objects without a material.
MaterialProgram make_default_material() {
  MaterialProgram program;
  program.name = "Default Material";
  program.constants = {{1.0f, 0.0f, 0.0f}, kDefaultGrey, {}};
  const auto constant = [](int i) { return Operand{static_cast<uint16_t>(Operand::kConstantBit | i)}; };
  const Operand normal_register{0};
  program.register_count = 1;
  program.inputs = {constant(0), constant(1), constant(2), normal_register};
  Instruction normal, diffuse;
  normal.op = Op::NORMAL;
  diffuse.op = Op::CLOSURE_DIFFUSE;
  diffuse.input_count = 4;
  program.instructions = {normal, diffuse};
  return program;
}

void check_image(const Image& image) {
  if (image.width < 1 || image.height < 1) {
    throw Error(image.name, "is " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                                " pixels: must be at least 1 x 1");
  }
  if (image.channels < 1 || image.channels > 4) {
    throw Error(image.name, "has " + std::to_string(image.channels) + " channels: must have 1 to 4");
  }
  if (!image.pixels) throw Error(image.name, "has no pixels");
}

/// An instance that was left out because its matrix is singular keeps that matrix; a removed one does not.
bool is_left_out(const Instance& instance) { return instance.mesh < 0 && is_singular(instance.object_to_world); }

void remove_displaced(Scene& scene) {
  for (Instance& instance : scene.instances)
    if (instance.mesh >= 0) instance.mesh = scene.undisplaced(instance.mesh);
  scene.meshes.resize(scene.meshes.size() - scene.displaced_from.size());
  scene.displaced_from.clear();
}

}  // namespace

SceneBuilder::SceneBuilder(const Scene& earlier) : scene_(earlier), known_tangents_(earlier) {
  remove_displaced(scene_);
  scene_.tangents.clear();
  MaterialProgram grey = make_default_material();
  finish_program(grey, 0);
  for (size_t i = 0; i < scene_.materials.size() && default_material_ < 0; ++i)
    if (scene_.materials[i] && *scene_.materials[i] == grey) default_material_ = static_cast<int>(i);
  for (size_t i = 0; i < scene_.material_sets.size(); ++i)
    material_set_handles_.try_emplace(scene_.material_sets[i], static_cast<int>(i));
  for (size_t i = 0; i < scene_.object_names.size(); ++i)
    object_handles_.emplace(scene_.object_names[i], static_cast<int>(i));
  singular_instances_ = static_cast<int>(std::ranges::count_if(scene_.instances, is_left_out));
}

int SceneBuilder::add_mesh(const MeshInput& input, std::optional<int> replace) {
  check_replace(input.name, "mesh", replace, scene_.meshes.size());
  return store_shared(scene_.meshes, build_mesh(input), replace, is_same_mesh);
}

int SceneBuilder::add_strands(const StrandInput& input, std::optional<int> replace) {
  check_replace(input.name, "mesh", replace, scene_.meshes.size());
  return store_shared(scene_.meshes, build_strands(input), replace, is_same_mesh);
}

int SceneBuilder::add_splats(const SplatInput& input, std::optional<int> replace) {
  check_replace(input.name, "mesh", replace, scene_.meshes.size());
  return store_shared(scene_.meshes, build_splats(input), replace, is_same_mesh);
}

int SceneBuilder::add_volume(VolumeInput input, std::optional<int> replace) {
  check_replace(input.name, "mesh", replace, scene_.meshes.size());
  return store_shared(scene_.meshes, build_volume(std::move(input)), replace, is_same_mesh);
}

int SceneBuilder::add_mesh(std::shared_ptr<const Mesh> mesh) { return store(scene_.meshes, std::move(mesh), {}); }

int SceneBuilder::add_image(Image image, std::optional<int> replace) {
  check_replace(image.name, "image", replace, scene_.images.size());
  check_image(image);
  return store_shared(scene_.images, std::move(image), replace, std::equal_to<>());
}

int SceneBuilder::add_material(MaterialProgram program, std::optional<int> replace) {
  check_replace(program.name, "material", replace, scene_.materials.size());
  finish_program(program, static_cast<int>(scene_.images.size()));
  return store_shared(scene_.materials, std::move(program), replace, std::equal_to<>());
}

int SceneBuilder::add_material_set(std::vector<int> materials, const std::string& owner_name) {
  for (const int material : materials) {
    if (material != -1) check_handle(owner_name, "material", material, scene_.materials.size());
  }
  if (materials.empty()) materials.push_back(-1);
  if (default_material_ < 0 && std::ranges::find(materials, -1) != materials.end()) {
    default_material_ = add_material(make_default_material());
  }
  std::ranges::replace(materials, -1, default_material_);
  const auto [known, is_new] =
      material_set_handles_.try_emplace(materials, static_cast<int>(scene_.material_sets.size()));
  if (is_new) scene_.material_sets.push_back(std::move(materials));
  return known->second;
}

int SceneBuilder::add_object_name(std::string name, const ObjectLabel& label) {
  const auto [first, last] = object_handles_.equal_range(name);
  for (auto known = first; known != last; ++known)
    if (scene_.object_labels[static_cast<size_t>(known->second)] == label) return known->second;
  const int handle = store(scene_.object_names, std::move(name), {});
  scene_.object_labels.push_back(label);
  object_handles_.emplace(scene_.object_names.back(), handle);
  return handle;
}

int SceneBuilder::add_instance(const Instance& instance, std::optional<int> replace) {
  static const std::string kUnnamed = "instance";
  const bool has_name = instance.object >= 0 && static_cast<size_t>(instance.object) < scene_.object_names.size();
  const std::string& name = has_name ? scene_.object_names[static_cast<size_t>(instance.object)] : kUnnamed;
  check_replace(name, "instance", replace, scene_.instances.size());
  check_handle(name, "object", instance.object, scene_.object_names.size());
  check_handle(name, "mesh", instance.mesh, scene_.meshes.size());
  check_handle(name, "material set", instance.material_set, scene_.material_sets.size());
  check_handle(name, "light set", instance.light_set, kLightSets);
  check_handle(name, "shadow set", instance.shadow_set, kLightSets);
  check_transform(name, "matrix", instance.object_to_world);
  Instance stored = instance;
  stored.visibility = object_visibility(instance.visibility);
  if (is_singular(instance.object_to_world)) {
    stored.mesh = -1;
    ++singular_instances_;
  }
  if (replace && is_left_out(scene_.instances[static_cast<size_t>(*replace)])) --singular_instances_;
  return store(scene_.instances, stored, replace);
}

void SceneBuilder::set_motion_step(int step, std::vector<Transform> object_to_world,
                                   std::unordered_map<int, std::vector<Vec3>> positions) {
  check_handle("motion", "step", step, scene_.motion.size());
  if (object_to_world.size() != scene_.instances.size())
    throw Error("motion", std::to_string(object_to_world.size()) + " matrices for " +
                              std::to_string(scene_.instances.size()) + " instances");
  for (const Transform& matrix : object_to_world) check_transform("motion", "matrix", matrix);
  for (const auto& [handle, points] : positions) {
    check_handle("motion", "mesh", handle, scene_.meshes.size());
    const std::shared_ptr<const Mesh>& mesh = scene_.meshes[static_cast<size_t>(handle)];
    const size_t count = mesh ? mesh->positions.size() : 0;
    if (points.size() != count)
      throw Error(mesh ? mesh->name : "motion",
                  std::to_string(points.size()) + " points in another frame, " + std::to_string(count) + " now");
  }
  scene_.motion[static_cast<size_t>(step)] =
      std::make_shared<const MotionStep>(MotionStep{scene_.camera, std::move(object_to_world), std::move(positions)});
}

void SceneBuilder::set_instance_values(const std::vector<std::string>& names, std::vector<float> rows) {
  if (names.empty() ? !rows.empty() : rows.size() % (4 * names.size()) != 0)
    throw Error("instances", "values must be 4 numbers for each name in each row");
  for (const float value : rows)
    if (!std::isfinite(value)) throw Error("instances", "values must be finite");
  InstanceValues values;
  values.rows = std::move(rows);
  for (const std::string& name : names) values.name_hashes.push_back(attribute_name_hash(name));
  if (scene_.instance_values && *scene_.instance_values == values) return;
  scene_.instance_values = names.empty() ? nullptr : std::make_shared<const InstanceValues>(std::move(values));
}

int SceneBuilder::add_light(Light light, std::optional<int> replace) {
  check_replace(light.name, "light", replace, scene_.lights.size());
  check_light(light);
  if (light.material != -1) check_handle(light.name, "material", light.material, scene_.materials.size());
  light.removed = false;
  light.visibility = light_visibility(light.visibility);
  return store(scene_.lights, std::move(light), replace);
}

void SceneBuilder::set_environment(const Environment& environment) {
  if (environment.material != -1) check_handle("World", "material", environment.material, scene_.materials.size());
  scene_.environment = environment;
  scene_.environment.visibility = light_visibility(environment.visibility);
}

void SceneBuilder::set_camera(const Camera& camera, const std::string& name) {
  check_camera(camera, name);
  scene_.camera = camera;
}

void SceneBuilder::set_dicing(std::optional<DicingView> view, const std::string& owner) {
  if (!view) {
    scene_.dicing = nullptr;
    return;
  }
  const auto check = [&](const char* what, float value, float least) {
    if (value >= least && std::isfinite(value)) return;
    throw Error(owner,
                std::string(what) + " is " + std::to_string(value) + ": must be at least " + std::to_string(least));
  };
  check("width", static_cast<float>(view->width), 1.0f);
  check("height", static_cast<float>(view->height), 1.0f);
  check("dicing rate", view->rate, kLeastDicingRate);
  check("offscreen scale", view->offscreen_scale, 1.0f);
  check("number of subdivisions", static_cast<float>(view->most_levels), 0.0f);
  view->most_levels = std::min(view->most_levels, kMostDicingLevels);
  view->camera = scene_.camera;
  if (!scene_.dicing || !(*scene_.dicing == *view)) scene_.dicing = std::make_shared<const DicingView>(*view);
}

void SceneBuilder::set_sheet(const SheetInput& input, bool sees_from_eye, const std::string& name) {
  auto sheet = std::make_shared<const SurfaceSheet>(make_surface_sheet(scene_, input, name));
  Camera& camera = scene_.camera;
  if (camera.type != CameraType::SHEET) camera.eye_type = camera.type;
  camera.type = CameraType::SHEET;
  camera.sheet = std::move(sheet);
  camera.sees_sheet_from_eye = sees_from_eye;
}

void SceneBuilder::blend_normals_in_world() {
  std::vector<int> users(scene_.meshes.size());
  for (const Instance& instance : scene_.instances)
    if (instance.mesh >= 0) ++users[static_cast<size_t>(instance.mesh)];
  const auto stays_in_object_space = [&](int material) {
    const auto& program = scene_.materials[static_cast<size_t>(material)];
    return program && (program->displaces() || program->has_subsurface);
  };
  for (Instance& instance : scene_.instances) {
    if (instance.mesh < 0) continue;
    const auto mesh = static_cast<size_t>(instance.mesh);
    const std::vector<int>& materials = scene_.material_sets[static_cast<size_t>(instance.material_set)];
    instance.blends_world_normals = users[mesh] == 1 && !scene_.meshes[mesh]->cage &&
                                    !is_conformal(instance.object_to_world) &&
                                    std::ranges::none_of(materials, stays_in_object_space);
  }
}

std::shared_ptr<const Scene> SceneBuilder::snapshot() const {
  const auto scene = std::make_shared<Scene>(scene_);
  scene->tangents = known_tangents_.of(scene_);
  return scene;
}

void SceneBuilder::remove_mesh(int handle) {
  check_handle("scene", "mesh", handle, scene_.meshes.size());
  scene_.meshes[static_cast<size_t>(handle)].reset();
}

void SceneBuilder::remove_instance(int handle) {
  check_handle("scene", "instance", handle, scene_.instances.size());
  Instance& instance = scene_.instances[static_cast<size_t>(handle)];
  if (is_left_out(instance)) --singular_instances_;
  instance = Instance{};
}

void SceneBuilder::remove_light(int handle) {
  check_handle("scene", "light", handle, scene_.lights.size());
  scene_.lights[static_cast<size_t>(handle)].removed = true;
}

void SceneBuilder::clear_instances() {
  scene_.instances.clear();
  singular_instances_ = 0;
}

void SceneBuilder::clear_lights() { scene_.lights.clear(); }

}  // namespace cistern
