#pragma once

#include "accel/accel.h"

namespace cistern {

/// What a path carries that a Light Path node can read, and the footprint for bump mapping.
struct PathState {
  /// Kind of the ray that arrived: one RayVisibility bit.
  uint8_t ray_kind = kVisibleToCamera;
  bool is_singular = false;   // the last scattering was a delta lobe
  uint16_t depth = 0, diffuse_depth = 0, glossy_depth = 0, transmission_depth = 0, transparent_depth = 0;
  float ray_length = 0.0f;    // of the arriving segment
  float footprint_angle = 0.0f;  // radius of the pixel footprint = angle x path length (see path_tracer)
};

/// A point on a surface as a material program sees it. Normals are unit length and face the side of `wo`;
/// `wo` is unit and leaves the surface, back along the ray that arrived.
struct SurfacePoint {
  Vec3 position;
  Vec3 ng;              // geometric
  Vec3 ns;              // interpolated, before bump and normal maps
  Vec3 wo;
  Vec2 barycentric;     // weights of vertices 1 and 2
  uint32_t instance = 0;
  uint32_t triangle = 0;
  int material = -1;
  bool is_backface = false;
  float footprint = 0.0f;  // radius in metres, for bump mapping
};

/// Everything at the hit that does not need the material. Row `hit.instance` of `scene` must be valid.
SurfacePoint make_surface_point(const Scene& scene, const Ray& ray, const Hit& hit);

/// World-space tangent dP/du of the named UV map (orthogonal to ns, unit, handed: w = +1 or -1 as the UV map is mirrored
/// or not); false where the map is missing or degenerate.
bool surface_tangent(const Scene& scene, const SurfacePoint& point, int attribute, Vec3* tangent, float* handedness);

/// Interpolated attribute (missing components 0, alpha 1), `index` into Mesh::attributes.
struct AttributeValue {
  Vec3 value;
  float alpha = 1.0f;
};
AttributeValue surface_attribute(const Scene& scene, const SurfacePoint& point, int index);

}  // namespace cistern
