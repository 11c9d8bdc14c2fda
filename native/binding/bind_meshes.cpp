#include <pybind11/stl.h>

#include "binding/arrays.h"
#include "binding/bind.h"
#include "binding/scene_handle.h"
#include "binding/subdivision_arrays.h"
#include "scene/scene_builder.h"

namespace cistern::binding {
namespace {

Domain to_domain(const std::string& name, const std::string& owner) {
  if (name == "POINT") return Domain::POINT;
  if (name == "FACE") return Domain::FACE;
  if (name == "CORNER") return Domain::CORNER;
  throw Error(owner, "domain '" + name + "' is not one of POINT, FACE, CORNER");
}

StrandShape to_strand_shape(const std::string& name, const std::string& owner) {
  if (name == "SPLINES") return StrandShape::SPLINES;
  if (name == "LINES") return StrandShape::LINES;
  if (name == "BALLS") return StrandShape::BALLS;
  throw Error(owner, "shape '" + name + "' is not one of SPLINES, LINES, BALLS");
}

size_t element_count(const MeshInput& mesh, Domain domain) {
  if (domain == Domain::POINT) return mesh.positions.size();
  if (domain == Domain::CORNER) return mesh.corner_vertices.size();
  return mesh.polygon_offsets.empty() ? mesh.corner_vertices.size() / 3 : mesh.polygon_offsets.size() - 1;
}

using AttributeArgument = std::tuple<std::string, std::string, Array<float>>;

/// Attributes outlive the call, so they are copied here: NumPy memory may be reused by the exporter.
MeshAttribute to_attribute(const AttributeArgument& argument, const MeshInput& mesh) {
  const auto& [name, domain_name, values] = argument;
  const Domain domain = to_domain(domain_name, mesh.name);
  const auto elements = static_cast<py::ssize_t>(element_count(mesh, domain));
  if (values.ndim() != 2 || values.shape(0) != elements || values.shape(1) < 1 || values.shape(1) > 4)
    throw Error(mesh.name, "attribute '" + name + "' must have shape (" + std::to_string(elements) + ", 1 to 4)");
  const auto count = static_cast<size_t>(values.size());
  auto copy = std::make_shared<float[]>(count);
  std::copy_n(values.data(), count, copy.get());
  MeshAttribute attribute;
  attribute.name = name;
  attribute.domain = domain;
  attribute.components = static_cast<int>(values.shape(1));
  attribute.values = std::move(copy);
  return attribute;
}

template <class T>
std::span<const T> optional_span(const OptionalArray<T>& array, const std::string& owner, const char* what) {
  return array ? flat_span(*array, owner, what) : std::span<const T>{};
}

std::span<const int32_t> triangle_span(const OptionalArray<int32_t>& array, const std::string& owner) {
  if (!array) return {};
  return {array->data(), 3 * checked_rows(*array, 3, owner, "triangle_corners")};
}

int add_mesh(SceneBuilder& builder, const std::string& name, const Array<float>& positions,
             const Array<int32_t>& corner_vertices, const OptionalArray<int32_t>& polygon_offsets,
             const OptionalArray<int32_t>& triangle_corners, const OptionalArray<int32_t>& triangle_polygons,
             const OptionalArray<int32_t>& material_indices, const OptionalArray<float>& normals,
             const std::string& normals_domain, const OptionalArray<uint8_t>& sharp_faces,
             const std::vector<AttributeArgument>& attributes, const std::optional<py::dict>& subdivision,
             const OptionalArray<float>& texture_space, std::optional<int> replace) {
  MeshInput input;
  input.name = name;
  input.positions = vec3_span(positions, name, "positions");
  input.corner_vertices = flat_span(corner_vertices, name, "corner_vertices");
  input.polygon_offsets = optional_span(polygon_offsets, name, "polygon_offsets");
  input.triangle_corners = triangle_span(triangle_corners, name);
  input.triangle_polygons = optional_span(triangle_polygons, name, "triangle_polygons");
  input.material_indices = optional_span(material_indices, name, "material_indices");
  input.normals_domain = to_domain(normals_domain, name);
  if (normals) input.normals = vec3_span(*normals, name, "normals");
  input.sharp_faces = optional_span(sharp_faces, name, "sharp_faces");
  for (const AttributeArgument& attribute : attributes) input.attributes.push_back(to_attribute(attribute, input));
  std::optional<SubdivisionArrays> subdivided;
  if (subdivision) input.subdivision = subdivided.emplace(*subdivision, name).input;
  input.texture_space = to_box(texture_space, name);
  const py::gil_scoped_release nogil;
  return builder.add_mesh(input, replace);
}

/// Of strands: at keys ("POINT") or one for each ("FACE").
MeshAttribute to_strand_attribute(const AttributeArgument& argument, const StrandInput& strands) {
  MeshInput sizes;  // as a mesh with a polygon for each strand
  sizes.name = strands.name;
  sizes.positions = strands.positions;
  sizes.polygon_offsets = strands.strand_offsets;
  return to_attribute(argument, sizes);
}

int add_strands(SceneBuilder& builder, const std::string& name, const Array<float>& positions,
                const Array<float>& radii, const Array<int32_t>& strand_offsets,
                const OptionalArray<int32_t>& material_indices, const std::string& shape,
                const std::vector<AttributeArgument>& attributes, std::optional<int> replace) {
  StrandInput input;
  input.name = name;
  input.positions = vec3_span(positions, name, "positions");
  input.radii = flat_span(radii, name, "radii");
  input.strand_offsets = flat_span(strand_offsets, name, "strand_offsets");
  if (input.strand_offsets.empty()) throw Error(name, "strand_offsets must not be empty");
  input.material_indices = optional_span(material_indices, name, "material_indices");
  input.shape = to_strand_shape(shape, name);
  for (const AttributeArgument& attribute : attributes)
    input.attributes.push_back(to_strand_attribute(attribute, input));
  const py::gil_scoped_release nogil;
  return builder.add_strands(input, replace);
}

/// Rows of a (splats, N) array as arrays of N.
template <class Row, class T>
std::span<const Row> row_span(const Array<T>& rows, const std::string& owner, const char* what) {
  constexpr size_t kRow = sizeof(Row) / sizeof(T);
  const std::span<const T> values{rows.data(), static_cast<size_t>(rows.size())};
  const bool has_rows = rows.ndim() >= 2 && values.size() == kRow * static_cast<size_t>(rows.shape(0));
  if (!has_rows)
    throw Error(owner, std::string(what) + " must have " + std::to_string(kRow) + " numbers for each splat");
  return {reinterpret_cast<const Row*>(values.data()), static_cast<size_t>(rows.shape(0))};
}

int add_splats(SceneBuilder& builder, const std::string& name, const Array<float>& positions,
               const Array<float>& scales, const Array<float>& rotations, const Array<float>& radiance,
               const OptionalArray<uint8_t>& harmonics, const std::optional<std::array<float, 9>>& to_working_space,
               const std::vector<AttributeArgument>& attributes, std::optional<int> replace) {
  SplatInput input;
  input.name = name;
  input.positions = vec3_span(positions, name, "positions");
  input.scales = vec3_span(scales, name, "scales");
  input.rotations = row_span<std::array<float, 4>>(rotations, name, "rotations");
  input.radiance = row_span<std::array<float, 4>>(radiance, name, "radiance");
  if (harmonics)
    input.harmonics =
        row_span<std::array<std::array<uint8_t, 3>, SplatColors::kHarmonics>>(*harmonics, name, "harmonics");
  input.to_working_space = to_working_space;
  MeshInput sizes;
  sizes.name = name;
  sizes.positions = input.positions;
  for (const auto& [attribute, domain, values] : attributes)
    input.attributes.push_back(to_attribute({attribute, "POINT", values}, sizes));
  const py::gil_scoped_release nogil;
  return builder.add_splats(input, replace);
}

int take_mesh(SceneBuilder& builder, const SceneHandle& from, int handle) {
  const auto& meshes = from.scene->meshes;
  const bool exists = handle >= 0 && static_cast<size_t>(handle) < meshes.size() && meshes[static_cast<size_t>(handle)];
  if (!exists) throw Error("scene", "there is no mesh with handle " + std::to_string(handle));
  return builder.add_mesh(meshes[static_cast<size_t>(handle)]);
}

py::dict mesh_statistics(const SceneBuilder& builder, int handle) {
  const auto& meshes = builder.scene().meshes;
  const bool exists = handle >= 0 && static_cast<size_t>(handle) < meshes.size() && meshes[handle];
  if (!exists) throw Error("mesh", "there is no mesh with handle " + std::to_string(handle));
  const Mesh& mesh = *meshes[handle];
  py::dict statistics;
  statistics["points"] = mesh.positions.size();
  statistics["triangles"] = mesh.triangle_count();
  statistics["dropped_triangles"] = mesh.dropped_triangles;
  statistics["memory_bytes"] = memory_bytes(mesh);
  return statistics;
}

}  // namespace

void bind_meshes(py::class_<SceneBuilder>& builder) {
  const auto none = py::none();
  builder
      .def("add_mesh", &add_mesh, py::arg("name"), py::arg("positions").noconvert(),
           py::arg("corner_vertices").noconvert(), py::arg("polygon_offsets").noconvert() = none,
           py::arg("triangle_corners").noconvert() = none, py::arg("triangle_polygons").noconvert() = none,
           py::arg("material_indices").noconvert() = none, py::arg("normals").noconvert() = none,
           py::arg("normals_domain") = "FACE", py::arg("sharp_faces").noconvert() = none,
           py::arg("attributes") = std::vector<AttributeArgument>{}, py::arg("subdivision") = none,
           py::arg("texture_space").noconvert() = none, py::arg("replace") = none)
      .def("add_strands", &add_strands, py::arg("name"), py::arg("positions").noconvert(), py::arg("radii").noconvert(),
           py::arg("strand_offsets").noconvert(), py::arg("material_indices").noconvert() = none,
           py::arg("shape") = "SPLINES", py::arg("attributes") = std::vector<AttributeArgument>{},
           py::arg("replace") = none)
      .def("add_splats", &add_splats, py::arg("name"), py::arg("positions").noconvert(), py::arg("scales").noconvert(),
           py::arg("rotations").noconvert(), py::arg("radiance").noconvert(), py::arg("harmonics").noconvert() = none,
           py::arg("to_working_space") = none, py::arg("attributes") = std::vector<AttributeArgument>{},
           py::arg("replace") = none)
      .def("take_mesh", &take_mesh, py::arg("scene"), py::arg("handle"))
      .def("mesh_statistics", &mesh_statistics, py::arg("handle"));
}

}  // namespace cistern::binding
