#include "scene/strand_builder.h"

#include "base/check.h"

namespace cistern {
namespace {

void check_length(const StrandInput& input, const char* what, size_t length, size_t expected) {
  if (length == expected) return;
  throw Error(input.name, std::string(what) + " have " + std::to_string(length) + " elements: must have " +
                              std::to_string(expected));
}

void check_input(const StrandInput& input) {
  check_length(input, "radii", input.radii.size(), input.positions.size());
  const std::span<const int32_t> offsets = input.strand_offsets;
  if (offsets.empty() || offsets.front() != 0) throw Error(input.name, "strand offsets must start with 0");
  if (static_cast<size_t>(offsets.back()) != input.positions.size())
    throw Error(input.name, "strand offsets end with " + std::to_string(offsets.back()) + ": must be the " +
                                std::to_string(input.positions.size()) + " keys");
  if (!std::ranges::is_sorted(offsets)) throw Error(input.name, "strand offsets must not decrease");
  if (!input.material_indices.empty())
    check_length(input, "material indices", input.material_indices.size(), offsets.size() - 1);
  for (const MeshAttribute& attribute : input.attributes)
    if (attribute.domain == Domain::CORNER || attribute.components < 1 || attribute.components > 4)
      throw Error(input.name, "attribute \"" + attribute.name + "\" must have 1 to 4 components, at keys or strands");
}

bool is_finite_strand(const StrandInput& input, size_t begin, size_t end) {
  for (size_t k = begin; k < end; ++k)
    if (!is_finite(input.positions[k]) || !std::isfinite(input.radii[k])) return false;
  return true;
}

uint16_t to_slot(int32_t index) { return static_cast<uint16_t>(std::clamp(index, 0, int32_t{UINT16_MAX})); }

void add_segments(const StrandInput& input, Mesh& mesh) {
  const bool has_slots = std::ranges::any_of(input.material_indices, [](int32_t i) { return i > 0; });
  for (size_t strand = 0; strand + 1 < input.strand_offsets.size(); ++strand) {
    const auto begin = static_cast<uint32_t>(input.strand_offsets[strand]);
    const auto end = static_cast<uint32_t>(input.strand_offsets[strand + 1]);
    const uint32_t step = input.shape == StrandShape::BALLS ? 0 : 1;  // from one end of a segment to the other
    if (end - begin <= step) continue;
    if (!is_finite_strand(input, begin, end)) {
      mesh.dropped_triangles += end - begin - step;
      continue;
    }
    for (uint32_t k = begin; k + step < end; ++k) {
      mesh.vertices.push_back({k, k + step, k + step});
      mesh.polygons.push_back(static_cast<uint32_t>(strand));
      if (has_slots) mesh.material_slots.push_back(to_slot(input.material_indices[strand]));
      mesh.bounds.extend(input.positions[k]);
      mesh.bounds.extend(input.positions[k + step]);
    }
  }
}

}  // namespace

Mesh build_strands(const StrandInput& input) {
  check_input(input);
  Mesh mesh;
  mesh.name = input.name;
  mesh.strand_shape = input.shape;
  mesh.positions.assign(input.positions.begin(), input.positions.end());
  mesh.radii.reserve(input.radii.size());
  for (const float radius : input.radii) mesh.radii.push_back(std::max(radius, 0.0f));
  mesh.corner_count = static_cast<uint32_t>(input.strand_offsets.size() - 1);
  mesh.vertices.reserve(input.positions.size());
  mesh.polygons.reserve(input.positions.size());
  add_segments(input, mesh);
  mesh.vertices.shrink_to_fit();
  mesh.polygons.shrink_to_fit();
  mesh.attributes = input.attributes;
  for (MeshAttribute& attribute : mesh.attributes) attribute.name_hash = attribute_name_hash(attribute.name);
  return mesh;
}

}  // namespace cistern
