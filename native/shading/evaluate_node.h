#pragma once

#include "shading/node_context.h"

namespace cistern {

/// Value of a non-closure instruction for its operands `in`, in op_table.cpp's order.
Vec3 evaluate_node(const Instruction& instruction, const Vec3* in, const NodeContext& context);

}  // namespace cistern
