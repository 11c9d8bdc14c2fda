#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "shading/evaluate_node.h"

namespace cistern {

inline constexpr size_t kMaxInputs = 32;  // of CLOSURE_PRINCIPLED; bits of Instruction::register_inputs

inline bool is_closure(Op op) { return op >= Op::CLOSURE_PRINCIPLED; }

/// Left uninitialised on purpose: `finish_program` has checked that nothing is read before it is written, and clearing
/// 3 KB would cost more than running a typical program.
class Registers {
 public:
  Vec3 read(size_t i) const { return {values_[3 * i], values_[3 * i + 1], values_[3 * i + 2]}; }
  void write(size_t i, Vec3 v) { values_[3 * i] = v.x, values_[3 * i + 1] = v.y, values_[3 * i + 2] = v.z; }

 private:
  float values_[3 * kMaxRegisters];
};

inline Vec3 finite_or_zero(Vec3 v) {
  return {std::isfinite(v.x) ? v.x : 0.0f, std::isfinite(v.y) ? v.y : 0.0f, std::isfinite(v.z) ? v.z : 0.0f};
}

/// Runs `instructions` and hands every closure with its operands to `on_closure`. Non-finite results are replaced where
/// they reach a closure: in between they can still vanish, as in max(0, x).
template <typename OnClosure>
void run(const NodeContext& context, std::span<const Instruction> instructions, Registers& registers,
         OnClosure on_closure) {
  const MaterialProgram& program = context.program;
  Vec3 gathered[kMaxInputs];
  for (const Instruction& instruction : instructions) {
    const bool ends_here = is_closure(instruction.op);
    const Vec3* in = program.input_values.data() + instruction.first_input;
    if (instruction.register_inputs != 0) {
      std::copy_n(in, instruction.input_count, gathered);
      const Operand* operands = program.inputs.data() + instruction.first_input;
      for (uint32_t left = instruction.register_inputs; left != 0; left &= left - 1) {
        const auto i = static_cast<size_t>(std::countr_zero(left));
        const Vec3 value = registers.read(static_cast<size_t>(operands[i].index()));
        gathered[i] = ends_here ? finite_or_zero(value) : value;
      }
      in = gathered;
    }
    if (ends_here) {
      on_closure(instruction, std::span<const Vec3>(in, instruction.input_count));
    } else {
      registers.write(instruction.output, evaluate_node(instruction, in, context));
    }
  }
}

template <typename OnClosure>
void run(const NodeContext& context, std::span<const Instruction> instructions, OnClosure on_closure) {
  Registers registers;
  run(context, instructions, registers, on_closure);
}

}  // namespace cistern
