// Entry point of the module. Compiled for the x86-64 baseline and free of C++ library calls, so that on a processor
// that is too old it can still say so instead of dying on an illegal instruction.

#define PY_SSIZE_T_CLEAN
#include <Python.h>

extern "C" PyObject* PyInit_cistern_core_checked();

extern "C" __attribute__((visibility("default"))) PyObject* PyInit_cistern_core() {
  __builtin_cpu_init();
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") || !__builtin_cpu_supports("bmi2")) {
    PyErr_SetString(PyExc_ImportError,
                    "cistern_core needs a processor with AVX2, FMA and BMI2 (x86-64-v3: Intel Haswell 2013, AMD Zen "
                    "2017 or newer)");
    return nullptr;
  }
  return PyInit_cistern_core_checked();
}
