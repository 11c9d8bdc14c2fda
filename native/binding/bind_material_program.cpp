#include <pybind11/stl.h>

#include "binding/arrays.h"
#include "binding/bind.h"
#include "scene/material_program.h"

namespace cistern::binding {
namespace {

Operand constant(MaterialProgram& p, float x, float y, float z) {
  const Vec3 value{x, y, z};
  for (size_t i = 0; i < p.constants.size(); ++i)
    if (p.constants[i] == value) return {static_cast<uint16_t>(Operand::kConstantBit | i)};
  if (p.constants.size() >= Operand::kConstantBit) throw Error(p.name, "the material has more than 32768 constants");
  p.constants.push_back(value);
  return {static_cast<uint16_t>(Operand::kConstantBit | (p.constants.size() - 1))};
}

Instruction& append(MaterialProgram& p, const std::string& op_name, const std::vector<uint16_t>& inputs,
                    const std::vector<int32_t>& parameters) {
  const Op op = find_op(op_name, p.name);
  const OpDescription& description = describe(op);
  const std::string where = "operation " + op_name;
  if (inputs.size() != std::string_view(description.inputs).size())
    throw Error(p.name, where + " has " + std::to_string(inputs.size()) + " inputs, needs " +
                            std::to_string(std::string_view(description.inputs).size()));
  if (parameters.size() > static_cast<size_t>(description.parameter_count))
    throw Error(p.name, where + " has " + std::to_string(parameters.size()) + " parameters, takes " +
                            std::to_string(description.parameter_count));
  Instruction instruction{op, static_cast<uint8_t>(inputs.size()), 0, static_cast<uint32_t>(p.inputs.size()), {}};
  std::copy(parameters.begin(), parameters.end(), instruction.parameters);
  for (uint16_t code : inputs) p.inputs.push_back({code});
  p.instructions.push_back(instruction);
  return p.instructions.back();
}

uint16_t emit(MaterialProgram& p, const std::string& op, const std::vector<uint16_t>& inputs,
              const std::vector<int32_t>& parameters, std::optional<uint16_t> output) {
  const uint16_t register_index = output.value_or(p.register_count);
  if (register_index >= kMaxRegisters)
    throw Error(p.name, "the material needs more than " + std::to_string(kMaxRegisters) + " intermediate values");
  if (describe(find_op(op, p.name)).is_closure) throw Error(p.name, "operation " + op + " is a closure: use closure()");
  Instruction& instruction = append(p, op, inputs, parameters);
  instruction.output = register_index;
  p.register_count = std::max<uint16_t>(p.register_count, register_index + 1);
  return register_index;
}

void closure(MaterialProgram& p, const std::string& op, const std::vector<uint16_t>& inputs,
             const std::vector<int32_t>& parameters) {
  if (!describe(find_op(op, p.name)).is_closure)
    throw Error(p.name, "operation " + op + " is not a closure: use emit()");
  append(p, op, inputs, parameters);
}

template <class T>
int index_of(std::vector<T>& list, const T& value) {
  const auto found = std::find(list.begin(), list.end(), value);
  const auto index = static_cast<int>(found - list.begin());
  if (found == list.end()) list.push_back(value);
  return index;
}

int table(MaterialProgram& p, const Array<float>& values, const std::optional<Array<float>>& alpha) {
  const std::span<const Vec3> rows = vec3_span(values, p.name, "table");
  const std::span<const float> alphas = alpha ? flat_span(*alpha, p.name, "table alpha") : std::span<const float>{};
  if (rows.size() != kTableSize || (alpha && alphas.size() != kTableSize))
    throw Error(p.name, "a lookup table must have " + std::to_string(kTableSize) + " entries");
  p.tables.emplace_back(rows.begin(), rows.end());
  p.table_alphas.emplace_back(alphas.begin(), alphas.end());
  if (!alpha) p.table_alphas.back().assign(kTableSize, 1.0f);
  return static_cast<int>(p.tables.size()) - 1;
}

py::dict describe_ops() {
  py::dict ops;
  for (int i = 0; i < static_cast<int>(Op::COUNT); ++i) {
    const OpDescription& d = describe(static_cast<Op>(i));
    const std::string output = d.output ? std::string(1, d.output) : "";
    ops[d.name] = py::make_tuple(d.inputs, output, d.parameter_count, d.is_closure);
  }
  return ops;
}

}  // namespace

void bind_material_program(py::module_& m) {
  const auto inputs = py::arg("inputs") = std::vector<uint16_t>{};
  const auto parameters = py::arg("parameters") = std::vector<int32_t>{};
  py::class_<MaterialProgram>(m, "MaterialProgram")
      .def(py::init([](std::string name) {
             MaterialProgram p;
             p.name = std::move(name);
             return p;
           }),
           py::arg("name"))
      .def_readonly("name", &MaterialProgram::name)
      .def_readwrite("pass_index", &MaterialProgram::pass_index)
      .def_readwrite("is_boundary", &MaterialProgram::is_boundary)
      .def_readwrite("has_transparent_shadow", &MaterialProgram::has_transparent_shadow)
      .def_readwrite("corrects_bumps", &MaterialProgram::corrects_bumps)
      .def(
          "constant", [](MaterialProgram& p, float x, float y, float z) { return constant(p, x, y, z).code; },
          py::arg("x"), py::arg("y") = 0.0f, py::arg("z") = 0.0f)
      .def("emit", &emit, py::arg("op"), inputs, parameters, py::arg("output") = py::none())
      .def("closure", &closure, py::arg("op"), py::arg("inputs"), parameters)
      .def("attribute", [](MaterialProgram& p, const std::string& name) { return index_of(p.attribute_names, name); })
      .def("image", [](MaterialProgram& p, int handle) { return index_of(p.images, handle); })
      .def("tiles", [](MaterialProgram& p, const std::vector<int>& images) { return index_of(p.tile_tables, images); })
      .def("table", &table, py::arg("values").noconvert(), py::arg("alpha").noconvert() = py::none());
  m.def("describe_ops", &describe_ops);
}

}  // namespace cistern::binding
