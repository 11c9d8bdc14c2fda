#pragma once

#include "accel/accel.h"
#include "accel/embree_device.h"
#include "scene/mesh.h"

namespace cistern {

/// The geometry of a mesh of splats, which it refers to.
///
/// Rays meet a splat where its Gaussian is the largest along them, by a chance that is its value there, and pass it
/// else: the same ray always the same. In the mean over rays that is the light of all splats sorted by that place and
/// laid over each other. [Moenne-Loccoz et al. 2024, 3D Gaussian Ray Tracing, eq. 8; Sun et al. 2025, Stochastic Ray
/// Tracing of Transparent 3D Gaussians, alg. 1]; departure: the number that decides is a hash of the place and of the
/// splat, so that splats in one place decide by themselves.
EmbreeGeometry splat_geometry(const EmbreeDevice& device, const Mesh& mesh);

/// How rays meet splats, as the time of an Embree ray, which nothing else reads.
namespace splat_time {
inline constexpr float kByChance = 0.0f;
inline constexpr float kAbsent = 0.5f;  // not at all
inline constexpr float kSolid = 1.0f;   // where the chance is not 0
}  // namespace splat_time

/// Stands for a splat in the id and the flags of an Embree ray that does not meet it. Some splats of scenes with many
/// instances share theirs.
inline uint32_t splat_key(TriangleId id) { return id.instance * 0x9e3779b1u + id.triangle; }

}  // namespace cistern
