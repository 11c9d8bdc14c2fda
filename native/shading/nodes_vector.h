#pragma once

#include "shading/node_context.h"

namespace cistern {

// Vector and shading-helper nodes; numbers are those of op_table.cpp.

Vec3 mapping_node(int type, Vec3 vector, Vec3 location, Vec3 rotation, Vec3 scale);
Vec3 vector_rotate_node(int type, bool inverts, Vec3 vector, Vec3 center, Vec3 axis, float angle, Vec3 euler);
Vec3 vector_transform_node(const NodeContext& context, int kind, int from, int to, Vec3 vector);

/// World-space unit normal on the side of the shading normal `ns`; that itself where the map has nothing to say.
Vec3 normal_map_node(const NodeContext& context, const int32_t* parameters, Vec3 color, float strength, Vec3 ns);

/// Heights at the point and `width` footprints along each of `bump_axes`. [Blinn 1978; Mikkelsen 2010]
struct BumpInput {
  float height, height_dx, height_dy, strength, distance;
  Vec3 normal;
  float width = 1.0f;
};
Vec3 bump_node(const SurfacePoint& point, const BumpInput& in, bool inverts);

// Reflectances of a dielectric boundary towards wo; the blend of Layer Weight is 1 - 1/ior.
float fresnel_node(const SurfacePoint& point, float ior, Vec3 normal);
float layer_weight_fresnel_node(const SurfacePoint& point, float blend, Vec3 normal);
float layer_weight_facing_node(const SurfacePoint& point, float blend, Vec3 normal);

}  // namespace cistern
