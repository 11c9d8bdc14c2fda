#pragma once

#include <span>

#include "scene/material_program.h"
#include "shading/bsdf.h"

namespace cistern {

// From closure instructions to lobes. `inputs` are the evaluated operands of a CLOSURE_* op and `parameters` its static
// parameters, in the order of scene/op_table.cpp. The models are those of Cycles 5.0; a
// departure: sheen is a fit (lobe_sheen.h).

/// Appends what the closure adds to `bsdf`: lobes, transparency, emission, holdout. `bsdf.ng` and `bsdf.wo` are set;
/// `bsdf.ns` is set here. Lobes of negligible weight and those beyond Bsdf::kMaxLobes are left out.
void add_closure(Bsdf& bsdf, Op op, std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point);

/// Only what add_closure would add to `emission`: the same bits.
Rgb closure_emission(Op op, std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point);

/// Only what add_closure would add to `transparency`: the same bits.
Rgb closure_transparency(Op op, std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point);

}  // namespace cistern
