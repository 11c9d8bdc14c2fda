#pragma once

#include "shading/node_context.h"
#include "shading/texture.h"

namespace cistern {

/// Op::IMAGE and Op::IMAGE_ALPHA with their parameters. An image that is not there is magenta. `normal`: the shading
/// normal, by which a box projection chooses its sides.
Texel image_node(const NodeContext& context, const int32_t* parameters, Vec3 vector, Vec3 normal);
/// Op::TILED_IMAGE and Op::TILED_IMAGE_ALPHA. A tile that is not there is magenta.
Texel tiled_image_node(const NodeContext& context, const int32_t* parameters, Vec3 vector, Vec3 normal);
/// Op::ENVIRONMENT_IMAGE.
Texel environment_image_node(const NodeContext& context, const int32_t* parameters, Vec3 direction);

}  // namespace cistern
