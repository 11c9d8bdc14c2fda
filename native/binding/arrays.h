#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <optional>
#include <span>

#include "base/check.h"
#include "base/rgb.h"
#include "base/transform.h"

namespace cistern::binding {

namespace py = pybind11;

/// C-contiguous array of exactly this dtype; anything else is a TypeError (arguments are bound with noconvert).
template <class T>
using Array = py::array_t<T, py::array::c_style>;
template <class T>
using OptionalArray = std::optional<Array<T>>;

/// Throws Error unless the array has shape (any, columns) or, for columns 1, (any,).
template <class T>
size_t checked_rows(const Array<T>& array, py::ssize_t columns, const std::string& owner, const char* what) {
  const bool fits = columns == 1 ? array.ndim() == 1 : array.ndim() == 2 && array.shape(1) == columns;
  if (!fits) {
    const std::string expected = columns == 1 ? "(n,)" : "(n, " + std::to_string(columns) + ")";
    throw Error(owner, std::string("array '") + what + "' must have shape " + expected);
  }
  return static_cast<size_t>(array.shape(0));
}

template <class T>
std::span<const T> flat_span(const Array<T>& array, const std::string& owner, const char* what) {
  return {array.data(), checked_rows(array, 1, owner, what)};
}

inline std::span<const Vec3> vec3_span(const Array<float>& array, const std::string& owner, const char* what) {
  static_assert(sizeof(Vec3) == 3 * sizeof(float));
  return {reinterpret_cast<const Vec3*>(array.data()), checked_rows(array, 3, owner, what)};
}

/// A texture space: its lower and its upper corner.
inline std::optional<Bounds3> to_box(const OptionalArray<float>& corners, const std::string& owner) {
  if (!corners) return std::nullopt;
  const std::span<const Vec3> ends = vec3_span(*corners, owner, "texture_space");
  if (ends.size() != 2) throw Error(owner, "texture_space must have 2 corners");
  return Bounds3{ends[0], ends[1]};
}

inline Vec3 to_vec3(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }
inline Rgb to_rgb(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

/// Twelve floats of a row-major 3x4 (or the top of a 4x4) matrix.
inline Transform transform_from_rows(const float* m) {
  return {{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[3], m[7], m[11]}};
}

inline Transform to_transform(const Array<float>& matrix, const std::string& owner) {
  if (matrix.ndim() != 2 || matrix.shape(0) < 3 || matrix.shape(0) > 4 || matrix.shape(1) != 4)
    throw Error(owner, "matrix must have shape (4, 4) or (3, 4)");
  return transform_from_rows(matrix.data());
}

/// Keeps a Python object alive from native code: released under the GIL, on whichever thread lets go last.
template <class T>
std::shared_ptr<const T> keep_alive(py::object owner, const T* memory) {
  auto* held = new py::object(std::move(owner));
  return std::shared_ptr<const T>(memory, [held](const T*) {
    if (!Py_IsInitialized()) return;  // at interpreter exit the memory goes with the process
    const py::gil_scoped_acquire gil;
    delete held;
  });
}

}  // namespace cistern::binding
