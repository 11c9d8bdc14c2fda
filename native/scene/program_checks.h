#pragma once

#include "scene/material_program.h"

namespace cistern {

/// Throws Error, naming the program and the instruction, for what cannot be run: operations, operands and parameters
/// that do not exist or do not fit (op_table.cpp), registers that are read before they are written, images beyond
/// `image_count`, numbers that are not finite.
void check_program(const MaterialProgram& program, int image_count);

}  // namespace cistern
