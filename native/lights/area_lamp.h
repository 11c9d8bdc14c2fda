#pragma once

#include <optional>

#include "accel/accel.h"
#include "lights/lamp_shapes.h"

namespace cistern {

/// Physics of area lamps; see lamp_shapes.h for the contracts.
AreaLamp make_area_lamp(const AreaLight& light);
std::optional<LampSample> sample_area_lamp(const AreaLamp& lamp, Vec2 uv, Vec3 receiver);
std::optional<LampSample> intersect_area_lamp(const AreaLamp& lamp, const Ray& ray);
Vec2 area_lamp_uv(const AreaLamp& lamp, Vec3 position);

}  // namespace cistern
