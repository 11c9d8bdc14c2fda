#pragma once

#include <optional>

#include "accel/accel.h"
#include "base/frame.h"

namespace cistern {

/// What surfaces keep back of lobes that are not diffuse, from paths that would seldom find the light they bring: less
/// noise for some light that is lost, or softer.
struct GlossLimits {
  bool has_reflection = true, has_refraction = true;
  float least_alpha = 0.0f;  // GGX width, and variance and scale of hair, that no lobe is below
  friend bool operator==(const GlossLimits&, const GlossLimits&) = default;
};

/// What a path carries that materials read: Light Path nodes, and which lobes they have.
struct PathState {
  /// Kind of the ray that arrived: one RayVisibility bit.
  uint8_t ray_kind = kVisibleToCamera;
  bool is_singular : 1 = false;         // the last scattering was a delta lobe
  uint8_t light_set : 7 = kEveryLight;  // Instance::light_set of what scattered it last: who light is sought for
  uint16_t depth = 0, diffuse_depth = 0, glossy_depth = 0, transmission_depth = 0, transparent_depth = 0;
  uint16_t portal_depth = 0;  // of the transparent ones those with a ray portal
  float ray_length = 0.0f;    // of the arriving segment
  float wavelength = 0.0f;    // micrometres, that of which dispersion makes the path one; 0: none does
  GlossLimits gloss;

  void set_receiver(uint8_t set) { light_set = set & 0x7f; }
};

/// A point on a surface as a material program sees it. Normals are unit length and face the side of `wo`;
/// `wo` is unit and leaves the surface, back along the ray that arrived.
struct SurfacePoint {
  Vec3 position;
  Vec3 ng;  // geometric
  Vec3 ns;  // interpolated, before bump and normal maps
  Vec3 wo;
  Vec2 barycentric;  // weights of vertices 1 and 2; on a lamp its UV coordinates
  uint32_t instance = 0;
  uint32_t triangle = 0;
  int material = -1;
  bool is_backface = false;
  bool is_splat = false;
  bool is_strand = false;      // of hair, not of points
  bool corrects_bumps = true;  // MaterialProgram::corrects_bumps, where its closures are added
  float clearance = 0.0f;      // see surface_clearance: metres off the surface at which rays start
  float footprint = 0.0f;      // radius in metres, for bump mapping

  TriangleId triangle_id() const { return {instance, triangle}; }
};

/// Footprints along a ray: that where it starts, in metres, and by how much it grows per metre.
struct RayCone {
  float footprint = 0.0f, angle = 0.0f;
  float at(float distance) const { return footprint + angle * distance; }
};

/// A hash of where the point lies on its mesh, for random numbers that belong to the place: each point has its own.
/// Barycentric coordinates are finer than positions far from the origin.
uint32_t place_hash(const SurfacePoint& point);

/// Everything at the hit that does not need the material. Row `hit.instance` of `scene` must be valid.
SurfacePoint make_surface_point(const Scene& scene, const Ray& ray, const Hit& hit);

/// Where a height is evaluated for bump mapping: at the point (step 0), or beside it along the first (1) or second (2)
/// of `bump_axes`, `width` footprints away. Instructions hold `packed`.
struct BumpShift {
  int step = 0;
  float width = 1.0f;
};
constexpr int kBumpStepBits = 2;
constexpr float kBumpWidthUnit = 1e-3f;  // of the packed width
inline BumpShift unpack_bump_shift(int packed) {
  return {packed & ((1 << kBumpStepBits) - 1), kBumpWidthUnit * static_cast<float>(packed >> kBumpStepBits)};
}

/// Two axes of the tangent plane. With wide filters they show in pictures, therefore the choice is Cycles'.
Frame bump_axes(const SurfacePoint& point);
/// The step in world space.
Vec3 footprint_step(const SurfacePoint& point, BumpShift shift);
/// Barycentric weights after that step; outside [0, 1] beyond the triangle's edge. On back faces the step is reversed,
/// as in Cycles: what a mesh attribute raises on the outside is then hollow from the inside.
Vec2 shifted_barycentric(const Scene& scene, const SurfacePoint& point, BumpShift shift);

/// Frame of a UV map in object space: the mesh's own normal on the outside of the object, which no bump has bent, the
/// map's tangent, both interpolated and not normalised, and what is across both on the side of dP/dv. As normal maps
/// are baked and read. [Mikkelsen 2008]
struct TangentFrame {
  Vec3 tangent, bitangent, normal;
};
/// `attribute` may be kNoUvMap. None where the map is missing; `is_of_original`: all as before displacement, but for
/// the normal of flat faces. For what the materials of the mesh read (Scene::tangents). What is made of the frame goes
/// to world space by `transform_normal`, as in Cycles: normal maps baked on an object then also fit it when it is
/// scaled.
std::optional<TangentFrame> tangent_frame(const Scene& scene, const SurfacePoint& point, int attribute,
                                          bool is_of_original = false);

/// Interpolated attribute, `index` into Mesh::attributes. One component fills all three; otherwise missing ones are 0;
/// alpha is 1 without a fourth.
struct AttributeValue {
  Vec3 value;
  float alpha = 1.0f;
};
AttributeValue surface_attribute(const Scene& scene, const SurfacePoint& point, int index);

}  // namespace cistern
