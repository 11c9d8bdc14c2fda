#include "scene/scene_memory.h"

namespace cistern {
namespace {

size_t bytes_per_channel(PixelFormat format) {
  switch (format) {
    case PixelFormat::U8:
      return 1;
    case PixelFormat::U16:
    case PixelFormat::HALF:
      return 2;
    case PixelFormat::FLOAT:
      return 4;
  }
  return 0;
}

size_t memory_bytes(const Image& image) {
  return static_cast<size_t>(image.width) * image.height * image.channels * bytes_per_channel(image.format);
}

size_t memory_bytes(const MaterialProgram& program) {
  size_t bytes = sizeof(program) + program.instructions.capacity() * sizeof(Instruction) +
                 program.inputs.capacity() * sizeof(Operand) + program.constants.capacity() * sizeof(Vec3);
  for (const std::vector<Vec3>& table : program.tables) bytes += table.capacity() * sizeof(Vec3);
  return bytes;
}

}  // namespace

size_t memory_bytes(const Scene& scene) {
  size_t bytes = scene.instances.capacity() * sizeof(Instance) + scene.lights.capacity() * sizeof(Light);
  if (scene.instance_values) bytes += scene.instance_values->rows.capacity() * sizeof(float);
  for (const auto& mesh : scene.meshes)
    if (mesh) bytes += memory_bytes(*mesh);
  for (const std::vector<MeshTangents>& of_mesh : scene.tangents)
    for (const MeshTangents& tangents : of_mesh) bytes += memory_bytes(*tangents.corners);
  for (const auto& image : scene.images)
    if (image) bytes += memory_bytes(*image);
  for (const auto& program : scene.materials)
    if (program) bytes += memory_bytes(*program);
  return bytes;
}

}  // namespace cistern
