#pragma once

#include <algorithm>
#include <initializer_list>
#include <vector>

#include "scene/material_program.h"

namespace cistern::test {

/// Operands of CLOSURE_PRINCIPLED as a new node has them; normals and tangent are 0, which closures take as "the
/// shading normal".
inline const std::vector<float> kPrincipledDefaults{1.0f, 0.8f, 0.0f, 0.5f, 1.5f, 1.0f,  0.0f, 0.0f, 0.0f,  0.5f, 1.0f,
                                                    0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.03f, 1.5f, 1.0f, 0.0f,  0.0f, 0.5f,
                                                    1.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f,  0.0f, 0.0f, 1.33f, 0.0f};

/// Writes programs one instruction a line; every instruction gets a register of its own.
struct ProgramBuilder {
  MaterialProgram program;

  ProgramBuilder() { program.name = "Clay"; }

  Operand constant(Vec3 v) {
    program.constants.push_back(v);
    return {static_cast<uint16_t>(Operand::kConstantBit | (program.constants.size() - 1))};
  }
  Operand constant(float v) { return constant(Vec3{v, v, v}); }
  Operand constant(int v) { return constant(static_cast<float>(v)); }

  Operand add(Op op, const std::vector<Operand>& inputs, std::initializer_list<int32_t> parameters = {}) {
    Instruction instruction;
    instruction.op = op;
    instruction.input_count = static_cast<uint8_t>(inputs.size());
    instruction.first_input = static_cast<uint32_t>(program.inputs.size());
    std::copy(parameters.begin(), parameters.end(), instruction.parameters);
    program.inputs.insert(program.inputs.end(), inputs.begin(), inputs.end());
    if (!describe(op).is_closure) instruction.output = program.register_count++;
    program.instructions.push_back(instruction);
    return {instruction.output};
  }
};

}  // namespace cistern::test
