#pragma once

#include "shading/node_context.h"

namespace cistern {

/// Op::ATTRIBUTE to Op::GRID_FACTOR: coordinates, geometry and object data.
Vec3 input_node(const Instruction& instruction, const NodeContext& context);

/// Op::LIGHT_PATH; `output` numbers those of op_table.cpp.
float light_path_node(int output, const PathState& path);

/// Op::WIREFRAME: 1 within `width` / 2 of an edge of the triangle, else 0; strands, lamps and the sky have none.
float wireframe_node(const NodeContext& context, float width, bool is_in_pixels, BumpShift shift);

/// Index into the mesh's attributes of the program's `name_index`-th attribute name, or -1 where the mesh lacks it.
int resolve_attribute(const NodeContext& context, int name_index);

/// World-space point in camera space with +z forward, as Blender's Camera coordinates.
Vec3 to_camera_space(const Camera& camera, Vec3 world_point);

}  // namespace cistern
