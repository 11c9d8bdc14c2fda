#pragma once

#include "accel/accel.h"
#include "base/frame.h"
#include "scene/pixel_footprint.h"

namespace cistern {

/// World-space camera ray through the point (s, t) of the full frame, [0, 1]^2 with t up. `u_lens` chooses the point on
/// the aperture. `t_min` and `t_max` are the clipping planes. Where a panorama sees nothing, sees_nothing(ray). Rays of
/// cameras that look at a sheet: see sheet_ray.h.
Ray camera_ray(const Camera& camera, Vec2 film_position, Vec2 u_lens);

inline constexpr Ray kSeesNothing{{}, {0.0f, 0.0f, 1.0f}, 0.0f, -1.0f};
inline bool sees_nothing(const Ray& ray) { return ray.t_max < ray.t_min; }

/// The point (s, t) of the full frame at which the centre of the lens sees a world-space point; empty behind the
/// camera, and for sheets.
std::optional<Vec2> project(const Camera& camera, Vec3 position);

/// Depth along the view axis of a world-space point; of panoramas its distance.
float camera_depth(const Camera& camera, Vec3 position);

/// Point on the unit aperture: a disk or a regular polygon with `blades` corners, uniform in area.
Vec2 sample_aperture(const Camera& camera, Vec2 u);

}  // namespace cistern
