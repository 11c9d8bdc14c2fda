#pragma once

#include <span>
#include <vector>

#include "lights/emissive_triangles.h"

namespace cistern {

/// For each triangle the first that lies in the same place and sends the same light to the same objects: a ray that
/// meets the place meets one of them, and sees their light once. Empty where no two are so. `uniform` is what
/// EmissiveTriangle::uniform counts. Where emission varies over an object, materials and UV maps have to be the same,
/// and what a few points of both send to either side.
std::vector<uint32_t> find_coincident_triangles(const Scene& scene, std::span<const EmissiveTriangle> triangles,
                                                std::span<const SideEmission> uniform);

}  // namespace cistern
