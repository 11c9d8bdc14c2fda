#pragma once

#include "shading/node_context.h"

namespace cistern {

// Nodes that look around a point with rays. Numbers are those of op_table.cpp.
//
// Their random numbers are a hash of where the point lies on its mesh, and of nothing else: not of the path, the pixel,
// the frame or the thread. So what they make is one fixed texture of very fine grain, and everything that holds of
// textures holds of them: whoever evaluates a point again, from another place, in another frame or for another pixel,
// finds the same material there, as resampling and MIS weights need; and as no two samples of a picture fall on the
// same point, its pixels are the means over many grains, without bias. Cycles takes the numbers of the path.
//
// Departures from Cycles: shadow rays and samples of mesh lights see what scattered rays see, where Cycles' see 1 and
// the normal, so that its pictures depend on how its light samples are weighed; and Bevel is the same for all rays,
// where Cycles takes it away from those that rough lobes have scattered.

/// What Blender calls Samples, Inside and Only Local.
struct OcclusionSettings {
  int rays = 16;
  bool is_inside = false, is_local = false;
  bool meets_boundaries = true;  // of media; not where it is local
};

/// Part of the cosine-weighted hemisphere around `normal`, or opposite to it, that meets nothing up to `distance`, in
/// metres. Whatever shadow rays see blocks, opaque or not. The point is on a mesh of the accel, and the distance above
/// 0.
float ambient_occlusion(const Accel& accel, const SurfacePoint& point, const OcclusionSettings& settings,
                        float distance, Vec3 normal);

/// The same of a node; 1 where the distance is not above 0.
float ambient_occlusion_node(const NodeContext& context, const OcclusionSettings& settings, float distance,
                             Vec3 normal);

/// Mean of the shading normals, on the side of the point, of what the object has within `radius`, in metres: as if its
/// edges were round, by weights that fall as (1 - r / radius)^3. `normal` where nothing is found, or the radius is not
/// above 0. [King et al. 2013, BSSRDF Importance Sampling: probes along three axes, weighed by multiple importance
/// sampling]; the weights and the shares of the axes are Cycles'.
Vec3 bevel_node(const NodeContext& context, int probes, float radius, Vec3 normal);

/// A ray up to `length` times its direction's length away; of the object of the point alone if `is_local`.
struct NodeRay {
  Vec3 origin, direction;
  float length = 1.0f;
  bool is_local = false;
  BumpShift shift;
};
/// Of the first thing that any kind of ray sees: 1, whether it is the object of the point, and how often the length of
/// the direction it is away; or the shading normal there, on the side of the ray. Where nothing is met 0, 0 and
/// `length`; or 0. From the point itself it leaves the surface to the side of the direction; beside
/// it, for bumps, nothing is met nearer than about that step, as in Cycles.
Vec3 raycast_node(const NodeContext& context, bool wants_normal, const NodeRay& ray);

}  // namespace cistern
