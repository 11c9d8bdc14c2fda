#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "scene/camera.h"
#include "scene/corner_tangents.h"
#include "scene/environment.h"
#include "scene/image.h"
#include "scene/instance.h"
#include "scene/light.h"
#include "scene/material_program.h"
#include "scene/mesh.h"

namespace cistern {

/// Numbers that materials read of each instance by name: colours, custom properties, attributes. Four to a name.
struct InstanceValues {
  std::vector<uint32_t> name_hashes;  // attribute_name_hash
  std::vector<float> rows;            // 4 * name_hashes.size() to a row; instances may share rows

  /// Four numbers; null for a name or a row that is not there.
  const float* find(int row, uint32_t name_hash) const {
    const size_t names = name_hashes.size();
    for (size_t k = 0; k < names; ++k) {
      const size_t at = 4 * (static_cast<size_t>(row) * names + k);
      if (name_hashes[k] == name_hash) return row >= 0 && at < rows.size() ? rows.data() + at : nullptr;
    }
    return nullptr;
  }
  friend bool operator==(const InstanceValues&, const InstanceValues&) = default;
};

/// What a program means by one of its names of attributes, on a mesh: an index, or -1.
inline int find_attribute(const Mesh& mesh, const MaterialProgram& program, int name) {
  const auto i = static_cast<size_t>(name);
  return program.attribute_names[i].empty() ? mesh.first_uv_map() : mesh.find_attribute(program.attribute_hashes[i]);
}

/// The same of a UV map for tangents; kNoUvMap where it is to be the first and there is none.
inline int find_tangent_map(const Mesh& mesh, const MaterialProgram& program, int name) {
  const bool is_any = program.attribute_names[static_cast<size_t>(name)].empty();
  return is_any && mesh.first_uv_map() < 0 ? kNoUvMap : find_attribute(mesh, program, name);
}

/// What passes tell of an object.
struct ObjectLabel {
  float pass_index = 0.0f;
  float matte = 0.0f, asset_matte = 0.0f;  // matte_id of its name, and of that of its topmost parent
  friend bool operator==(const ObjectLabel&, const ObjectLabel&) = default;
};

/// Where things were a frame before, or will be a frame later.
struct MotionStep {
  Camera camera;
  std::vector<Transform> object_to_world;                // by instance
  std::unordered_map<int, std::vector<Vec3>> positions;  // of meshes that have another shape then, in object space
};

/// An immutable snapshot of everything to render. Meshes, images and programs are shared between snapshots: an
/// edit builds a new Scene that keeps every untouched part. Indices are the builder's stable handles; a removed
/// handle leaves a null pointer (or an instance with mesh = -1, or a light with `removed`).
struct Scene {
  std::vector<std::shared_ptr<const Mesh>> meshes;
  /// Beside `meshes`, or fewer: what their materials read.
  std::vector<std::vector<MeshTangents>> tangents;
  std::vector<std::shared_ptr<const Image>> images;
  std::vector<std::shared_ptr<const MaterialProgram>> materials;
  /// Material handle per slot of a mesh; shared by all instances that use the same ones.
  std::vector<std::vector<int>> material_sets;
  std::vector<std::string> object_names;
  std::vector<ObjectLabel> object_labels;  // beside object_names
  std::vector<Instance> instances;
  std::shared_ptr<const InstanceValues> instance_values;  // null where no material asks
  std::vector<Light> lights;
  Environment environment;
  Camera camera;
  std::shared_ptr<const Camera> middle_camera;  // of the exposure, of which this is a moment; null: the same
  std::shared_ptr<const DicingView> dicing;     // null: meshes with a cage are shown as they are
  /// The last of `meshes` are others as they were diced and displacement moved them, of these handles; only instances
  /// refer to them.
  std::vector<int> displaced_from;
  std::array<std::shared_ptr<const MotionStep>, 2> motion;  // before and after; null: nothing moves

  /// That whose coordinates materials read: as in Cycles, those of an exposure's middle.
  const Camera& material_camera() const { return middle_camera ? *middle_camera : camera; }

  /// The handle of the mesh that this one is shown in place of, or its own.
  int undisplaced(int mesh) const {
    const size_t own = meshes.size() - displaced_from.size(), handle = static_cast<size_t>(mesh);
    return handle < own ? mesh : displaced_from[handle - own];
  }

  /// Tangents of a mesh by an attribute or kNoUvMap; null where no material of it reads them.
  const CornerTangents* find_tangents(int mesh, int attribute, bool is_of_original) const {
    if (static_cast<size_t>(mesh) >= tangents.size()) return nullptr;
    for (const MeshTangents& known : tangents[static_cast<size_t>(mesh)])
      if (known.attribute == attribute && known.is_of_original == is_of_original) return known.corners.get();
    return nullptr;
  }

  /// Whether something lets the light of some emitter pass that it blocks of others; looks at everything.
  bool has_shadow_links() const {
    const auto is_linked = [](const auto& emitter) { return emitter.links.blockers != kAllSets; };
    return std::ranges::any_of(lights, is_linked) || std::ranges::any_of(instances, is_linked);
  }

  /// Material handle of a triangle; slots beyond the set take its last entry, as in Blender.
  int material_of(const Instance& instance, uint32_t triangle) const {
    const std::vector<int>& set = material_sets[instance.material_set];
    const Mesh& mesh = *meshes[instance.mesh];
    const size_t slot = mesh.material_slots.empty() ? 0 : mesh.material_slots[triangle];
    return set[slot < set.size() ? slot : set.size() - 1];
  }
};

}  // namespace cistern
