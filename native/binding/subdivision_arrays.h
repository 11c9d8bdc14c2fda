#pragma once

#include "binding/arrays.h"
#include "scene/scene_builder.h"

namespace cistern::binding {

/// A dictionary that says how a mesh is subdivided, and the arrays that `input` looks into.
class SubdivisionArrays {
 public:
  /// Members as SubdivisionInput has them, each optional; throws Error naming the mesh.
  SubdivisionArrays(const py::dict& members, const std::string& owner);
  SubdivisionArrays(const SubdivisionArrays&) = delete;
  SubdivisionArrays& operator=(const SubdivisionArrays&) = delete;

  SubdivisionInput input;

 private:
  Array<int32_t> creases_, sharp_vertices_;
  Array<float> crease_sharpness_, vertex_sharpness_;
};

}  // namespace cistern::binding
