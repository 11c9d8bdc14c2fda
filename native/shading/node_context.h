#pragma once

#include "scene/scene.h"
#include "shading/surface_point.h"

namespace cistern {

/// Where a material program runs: everything a node may read besides its operands.
struct NodeContext {
  const Scene& scene;
  const MaterialProgram& program;
  const SurfacePoint& point;
  const PathState& path;
  bool is_environment = false;     // `point` is a direction: there is no instance and no mesh
  const Instance* lamp = nullptr;  // the object of a lamp, of which `point` is a point: there is no mesh
  bool is_inside = false;          // `point` is in the medium inside the instance: on no triangle of its mesh
  bool is_undisplaced = false;     // positions are those before displacement
  const Accel* accel = nullptr;    // what nodes trace rays in; null: they meet nothing

  bool has_mesh() const { return !is_environment && !is_inside && lamp == nullptr; }
  const Instance& instance() const { return lamp != nullptr ? *lamp : scene.instances[point.instance]; }
  const Mesh& mesh() const { return *scene.meshes[static_cast<size_t>(instance().mesh)]; }
  const Mesh& shape() const { return is_undisplaced ? mesh().original() : mesh(); }
};

}  // namespace cistern
