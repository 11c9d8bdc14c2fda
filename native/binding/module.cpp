#include <pybind11/pybind11.h>
#include <tbb/version.h>

#include "accel/accel.h"
#include "base/check.h"
#include "base/shared_library.h"
#include "binding/bind.h"

namespace py = pybind11;

PYBIND11_MODULE(cistern_core_checked, m) {
  try {
    cistern::check_embree_version();
  } catch (const cistern::Error& e) {
    throw py::import_error(e.what());
  }
  py::register_exception<cistern::Error>(m, "Error", PyExc_RuntimeError);
  m.doc() = "Native core of the Cistern render engine.";
  m.attr("__version__") = CISTERN_VERSION;
  m.attr("EMBREE_VERSION") = cistern::embree_version();
  m.attr("EMBREE_LIBRARY") = cistern::embree_library();
  m.attr("TBB_LIBRARY") = cistern::library_of(reinterpret_cast<const void*>(&TBB_runtime_version));
  cistern::binding::bind_material_program(m);
  cistern::binding::bind_scene_builder(m);
  cistern::binding::bind_session(m);
}
