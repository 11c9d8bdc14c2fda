#pragma once

#include "resampling/receiver.h"
#include "shading/bsdf.h"

namespace cistern {

/// The first surface of a camera path that is rough enough to reuse light at, seen straight or through smooth
/// surfaces. What is reused there is the light that its *rough* lobes reflect; smooth lobes keep what their own path
/// finds.
struct VisiblePoint {
  Receiver receiver;
  // With the receiver's geometry, all that the material needs to be evaluated again.
  Vec3 ng, ns;
  Vec2 barycentric;
  uint32_t instance = 0, triangle = 0;
  int material = -1;
  float clearance = 0.0f, footprint = 0.0f;
  bool is_backface = false, is_strand = false;
  bool is_caught = false;   // of a shadow catcher in the film, or behind one
  bool turns_away = false;  // light may come from below ns, or pass from above; see there
  bool exists = false;
  uint8_t scattered_kinds = 0;                         // RayVisibility bits of the rays that it can send on
  RoughSampling rough_sampling = RoughSampling::BSDF;  // of its BSDF
  bool is_lambertian = false;                          // sends the same radiance in all directions
  float mean_alpha = 1.0f;                             // GGX, of rough microfacet lobes; each counts the same
  float even_shade = 0.0f;                             // of its BSDF, as is:
  Vec3 even_normal;
  PathState state;        // of the ray that arrived
  PathState scattered;    // of a ray scattered towards a light
  Rgb throughput;         // of the smooth surfaces on the way
  float distance = 0.0f;  // from the camera, along the path
};

/// Normal of the half space that light must come from to be scattered, zero where it may come from anywhere: what a
/// light sampler may assume of the receiver.
Vec3 light_side(const SurfacePoint& point, const Bsdf& bsdf);

/// At a surface point with its BSDF. What belongs to the path (states, throughput, distance) is left to the caller.
VisiblePoint make_visible_point(const Scene& scene, const SurfacePoint& point, const Bsdf& bsdf);

SurfacePoint surface_point(const VisiblePoint& visible);

/// Its BSDF, evaluated again: the same one, also where nodes trace rays (nodes_rays.h).
Bsdf evaluate_material(const Scene& scene, const VisiblePoint& visible, const Accel* accel);

/// Whether nothing has scattered the path before.
inline bool is_first_vertex(const VisiblePoint& visible) { return visible.state.depth == 0; }
/// By kinds, shares of what its rough lobes scatter of light from `wi`; `visibility` as evaluate_bsdf has it.
KindColors rough_shares(const Scene& scene, const VisiblePoint& visible, Vec3 wi, uint8_t visibility,
                        const Accel* accel);

}  // namespace cistern
