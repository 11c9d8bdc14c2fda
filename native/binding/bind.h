#pragma once

#include <pybind11/pybind11.h>

namespace cistern {
class SceneBuilder;
}

namespace cistern::binding {

void bind_camera(pybind11::class_<SceneBuilder>& builder);
void bind_meshes(pybind11::class_<SceneBuilder>& builder);
void bind_material_program(pybind11::module_& m);
void bind_scene_builder(pybind11::module_& m);
void bind_session(pybind11::module_& m);

}  // namespace cistern::binding
