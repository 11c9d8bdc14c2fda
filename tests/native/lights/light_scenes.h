#pragma once

#include <memory>
#include <vector>

#include "base/rng.h"
#include "base/warp.h"
#include "lights/light_set.h"
#include "scene/scene.h"

namespace cistern::test {

/// Writes material programs an instruction at a time.
class ProgramWriter {
 public:
  Operand constant(Vec3 value) {
    program_.constants.push_back(value);
    return {static_cast<uint16_t>(Operand::kConstantBit | (program_.constants.size() - 1))};
  }
  Operand constant(float value) { return constant(Vec3{value, value, value}); }
  Operand add(Op op, const std::vector<Operand>& inputs, const std::vector<int>& parameters = {}) {
    Instruction instruction;
    instruction.op = op;
    instruction.input_count = static_cast<uint8_t>(inputs.size());
    instruction.output = program_.register_count;
    instruction.first_input = static_cast<uint32_t>(program_.inputs.size());
    std::copy(parameters.begin(), parameters.end(), instruction.parameters);
    program_.inputs.insert(program_.inputs.end(), inputs.begin(), inputs.end());
    program_.instructions.push_back(instruction);
    if (!describe(op).is_closure) ++program_.register_count;
    return {instruction.output};
  }
  void use_image(int image) { program_.images.push_back(image); }
  /// Emission of a strength, as the program's only closure.
  std::shared_ptr<const MaterialProgram> emit(Vec3 color, Operand strength, int image_count = 0) {
    return emit(constant(color), strength, image_count);
  }
  std::shared_ptr<const MaterialProgram> emit(Operand color, Operand strength, int image_count = 0) {
    add(Op::CLOSURE_EMISSION, {constant(1.0f), color, strength});
    program_.name = "emission";
    finish_program(program_, image_count);
    return std::make_shared<MaterialProgram>(program_);
  }

 private:
  MaterialProgram program_;
};

inline std::shared_ptr<const MaterialProgram> constant_emission(Vec3 radiance) {
  ProgramWriter writer;
  return writer.emit(radiance, writer.constant(1.0f));
}

/// Emission 3 on the outer side of a surface only.
inline std::shared_ptr<const MaterialProgram> one_sided_emission() {
  ProgramWriter w;
  const Operand back = w.add(Op::BACKFACING, {});
  const Operand strength = w.add(Op::MATH, {back, w.constant(-3.0f), w.constant(3.0f)}, {4, 0});
  return w.emit({1, 1, 1}, strength);
}

inline Light make_light(auto shape) {
  Light light;
  light.name = "light";
  light.shape = shape;
  return light;
}

/// Triangles of about the given size around points of a cube of half side `spread`.
inline std::shared_ptr<const Mesh> scattered_triangles(uint64_t seed, uint32_t count, float spread, float size) {
  Rng rng(seed, 0, 0, 0);
  const auto offset = [&](float scale) {
    const Vec2 xy = rng.next_vec2();
    return scale * Vec3{2.0f * xy.x - 1.0f, 2.0f * xy.y - 1.0f, 2.0f * rng.next_float() - 1.0f};
  };
  const auto mesh = std::make_shared<Mesh>();
  mesh->name = "triangles";
  for (uint32_t i = 0; i < count; ++i) {
    const Vec3 center = offset(spread);
    for (int k = 0; k < 3; ++k) mesh->positions.push_back(center + offset(size));
    mesh->vertices.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  for (const Vec3 p : mesh->positions) mesh->bounds.extend(p);
  return mesh;
}

/// Adds a mesh with one material for all of its triangles.
inline void add_mesh(Scene& scene, std::shared_ptr<const Mesh> mesh, std::shared_ptr<const MaterialProgram> material,
                     const Transform& object_to_world = {}) {
  scene.meshes.push_back(std::move(mesh));
  scene.materials.push_back(std::move(material));
  scene.material_sets.push_back({static_cast<int>(scene.materials.size()) - 1});
  scene.object_names = {"object"};
  Instance instance;
  instance.mesh = static_cast<int>(scene.meshes.size()) - 1;
  instance.material_set = static_cast<int>(scene.material_sets.size()) - 1;
  instance.object = 0;
  instance.object_to_world = object_to_world;
  scene.instances.push_back(instance);
}

}  // namespace cistern::test
