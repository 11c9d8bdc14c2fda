#pragma once

#include <functional>

#include "shading/bsdf.h"
#include "shading/medium.h"

namespace cistern {

/// Runs the program of `point.material` and builds the BSDF. A missing material (-1) is black. Non-finite results
/// of node arithmetic become 0. After the first vertex sharp lobes are preferred (lobe_choice.h). Pure: depends on
/// nothing but its arguments. `accel`, of the scene, is what nodes trace rays in (nodes_rays.h); null where it is not
/// there yet: they meet nothing.
Bsdf evaluate_material(const Scene& scene, const SurfacePoint& point, const PathState& path,
                       const Accel* accel = nullptr);

/// Where light leaves that wandered below the surface: a Lambert lobe of albedo 1 around the normal that the
/// subsurfaces of the point have, or else the interpolated one.
Bsdf evaluate_exit(const Scene& scene, const SurfacePoint& point, const PathState& path, const Accel* accel = nullptr);

/// Only what is emitted towards wo: same value as evaluate_material(...).emission, cheaper.
Rgb evaluate_emission(const Scene& scene, const SurfacePoint& point, const PathState& path,
                      const Accel* accel = nullptr);

/// What the program of a lamp makes of its light. `object` stands for the lamp: it has a transform and no mesh.
Rgb evaluate_lamp_emission(const Scene& scene, const Instance& object, const SurfacePoint& point,
                           const PathState& path);

/// Only what passes straight through: same as evaluate_material(...).transparency, but nothing where there is a ray
/// portal, and where the path's ray is one of light samples and the material has no transparent shadow.
Rgb evaluate_transparency(const Scene& scene, const SurfacePoint& point, const PathState& path,
                          const Accel* accel = nullptr);

/// Radiance arriving from `direction` (unit, away from the scene) by the environment's program; black without one.
Rgb evaluate_environment(const Scene& scene, Vec3 direction, const PathState& path);

/// How far the program of `point.material`, which displaces, moves a vertex there, in world space; may not be finite.
Vec3 evaluate_displacement(const Scene& scene, const SurfacePoint& point);

/// By what the density of a volume object is multiplied: one twice as large may be half as dense.
float object_density(const Scene& scene, const Instance& instance);
/// Adds the medium that `material`, which is one of the instance's, has inside at a place of the world. `path` is that
/// of the ray there, which goes along `direction` (unit).
void add_medium(Medium& medium, const Scene& scene, uint32_t instance, int material, const PathState& path,
                Vec3 direction, Vec3 position);
/// The same of the environment's program.
void add_environment_medium(Medium& medium, const Scene& scene, const PathState& path, Vec3 direction, Vec3 position);

/// What a program writes to passes of its own, by attribute_name_hash.
struct AovValues {
  uint32_t name_hash;
  Rgb color;
  float value;
};
using TakeAov = std::function<void(const AovValues&)>;
/// Hands over each that the program of `point.material` has.
void evaluate_aovs(const Scene& scene, const SurfacePoint& point, const PathState& path, const TakeAov& take,
                   const Accel* accel = nullptr);
/// The same of the environment's program, seen in `direction` as evaluate_environment has it.
void evaluate_environment_aovs(const Scene& scene, Vec3 direction, const PathState& path, const TakeAov& take);

/// What an instruction of `emission_instructions` of the environment's program, which has one, reads for a direction.
Vec3 evaluate_environment_input(const Scene& scene, size_t instruction, size_t input, Vec3 direction);

}  // namespace cistern
