#pragma once

#include <span>

#include "scene/material_program.h"
#include "shading/bsdf.h"

namespace cistern {

// From closure instructions to lobes. `inputs` are the evaluated operands of a CLOSURE_* op and `parameters` its static
// parameters, in the order of scene/op_table.cpp. The models are those of Cycles 5.0; a
// departure: sheen is a fit (lobe_sheen.h).

/// Appends what the closure adds to `bsdf`: lobes, transparency, emission, holdout. `bsdf.ng`, `bsdf.wo` and what it
/// has of the path are set; `bsdf.ns` is set here. Lobes of negligible weight and those beyond Bsdf::kMaxLobes are left
/// out.
void add_closure(Bsdf& bsdf, Op op, std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point);

/// Only what add_closure would add to `emission`: the same bits.
Rgb closure_emission(Op op, std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point);

/// Whether add_closure would add a ray portal.
bool is_ray_portal(Op op, std::span<const Vec3> inputs);

/// Only what add_closure would add to `transparency` but by ray portals where the ray that meets the surface is of that
/// kind (PathState::ray_kind): the same bits.
Rgb closure_transparency(Op op, std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point,
                         uint8_t ray_kind);

}  // namespace cistern
