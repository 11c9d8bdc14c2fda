#include "shading/material.h"

#include <algorithm>
#include <limits>
#include <span>

#include "shading/closures.h"
#include "shading/lobe_choice.h"
#include "shading/run_program.h"

namespace cistern {
namespace {

const MaterialProgram* find_program(const Scene& scene, int material) {
  return material < 0 ? nullptr : scene.materials[static_cast<size_t>(material)].get();
}

/// Where the environment's program runs, for a direction.
SurfacePoint environment_point(const Scene& scene, Vec3 direction) {
  SurfacePoint point;
  point.position = direction;
  point.ng = point.ns = point.wo = -direction;
  point.material = scene.environment.material;
  return point;
}

Rgb run_emission(const NodeContext& context) {
  Rgb emission;
  run(context, context.program.emission_instructions, [&](const Instruction& closure, std::span<const Vec3> in) {
    emission += closure_emission(closure.op, in, closure.parameters, context.point);
  });
  return emission;
}

/// Calls body(point), with what the program says of closures there; nothing is copied but where that is unusual.
template <class Body>
void as_program_takes(const SurfacePoint& point, const MaterialProgram& program, const Body& body) {
  if (program.corrects_bumps) return body(point);
  SurfacePoint uncorrected = point;
  uncorrected.corrects_bumps = false;
  body(uncorrected);
}

/// Strands have no inside that rays could wander in. As in Cycles profiles are for what is seen, or by way of mirrors:
/// what rays scattered diffusely meet is plain diffuse, or folds that a profile reaches across would light each other.
void keep_on_surface(const Scene& scene, const SurfacePoint& point, const PathState& path, Bsdf& bsdf) {
  const Instance& instance = scene.instances[point.instance];
  const bool is_strand = scene.meshes[static_cast<size_t>(instance.mesh)]->is_strands();
  int kept = 0;
  for (int i = 0; i < bsdf.subsurface_count; ++i) {
    const Subsurface& below = bsdf.subsurfaces[static_cast<size_t>(i)];
    if (!is_strand && !(below.is_profile() && path.diffuse_depth > 0)) {
      bsdf.subsurfaces[static_cast<size_t>(kept++)] = below;
      continue;
    }
    const Rgb weight = below.weight * below.albedo;
    bsdf.total_sample_weight -= below.sample_weight;
    add_lobe(bsdf, LambertLobe{below.n}, weight, below.sample_weight, weight);
  }
  bsdf.subsurface_count = kept;
}

/// `first` and `second`: what CLOSURE_VOLUME has for each phase.
void scatter_by(Phase phase, float first, float second, Rgb scattering, Medium& medium) {
  switch (phase) {
    case Phase::HENYEY_GREENSTEIN:
      return add_scattering(medium, scattering, PhaseFunction::henyey_greenstein(first));
    case Phase::RAYLEIGH:
      return add_scattering(medium, scattering, PhaseFunction::rayleigh());
    case Phase::DRAINE:
      return add_scattering(medium, scattering, PhaseFunction::draine(first, second));
    case Phase::MIE: {
      const DropletPhase droplets = droplet_phase(first);
      add_scattering(medium, scattering * (1.0f - droplets.draine_share), droplets.henyey_greenstein);
      return add_scattering(medium, scattering * droplets.draine_share, droplets.draine);
    }
    case Phase::FOURNIER_FORAND:
      return add_scattering(medium, scattering, PhaseFunction::fournier_forand(first, second));
  }
}

/// `scale` times as dense and as bright.
void run_medium(const NodeContext& context, float scale, Medium& medium) {
  run(context, context.program.volume_instructions, [&](const Instruction& closure, std::span<const Vec3> in) {
    if (closure.op == Op::CLOSURE_VOLUME_EMISSION) {
      medium.emission += to_rgb(in[1]) * (in[0].x * in[2].x * scale);
      return;
    }
    const float density = in[0].x * std::max(in[3].x, 0.0f) * scale;
    scatter_by(static_cast<Phase>(closure.parameters[0]), in[4].x, in[5].x, to_rgb(in[1]) * density, medium);
    add_absorption(medium, to_rgb(in[2]) * density);
  });
}

PathState arriving_from_sky(PathState path) {
  path.ray_length = std::numeric_limits<float>::max();
  ++path.depth;  // as in Cycles the sky is one bounce further than a surface would be
  return path;
}

void run_aovs(const NodeContext& context, const TakeAov& take) {
  const MaterialProgram& program = context.program;
  if (program.aov_instructions.empty()) return;
  run(context, program.aov_instructions, [&](const Instruction& closure, std::span<const Vec3> in) {
    take({program.attribute_hashes[static_cast<size_t>(closure.parameters[0])], to_rgb(in[1]), in[2].x});
  });
}

}  // namespace

Bsdf evaluate_material(const Scene& scene, const SurfacePoint& point, const PathState& path, const Accel* accel) {
  Bsdf bsdf;
  bsdf.ng = point.ng;
  bsdf.ns = point.ns;
  bsdf.wo = point.wo;
  bsdf.is_strand = point.is_strand;
  bsdf.gloss = path.gloss;
  bsdf.ray_kind = path.ray_kind;
  bsdf.wavelength = path.wavelength;
  const MaterialProgram* program = find_program(scene, point.material);
  if (program == nullptr) return bsdf;
  bsdf.corrects_bumps = program->corrects_bumps;
  as_program_takes(point, *program, [&](const SurfacePoint& taken) {
    run({.scene = scene, .program = *program, .point = taken, .path = path, .accel = accel}, program->instructions,
        [&](const Instruction& closure, std::span<const Vec3> in) {
          add_closure(bsdf, closure.op, in, closure.parameters, taken);
        });
  });
  if (bsdf.subsurface_count > 0) keep_on_surface(scene, point, path, bsdf);
  if (path.depth > 0) prefer_sharp_lobes(bsdf);
  return bsdf;
}

Bsdf evaluate_exit(const Scene& scene, const SurfacePoint& point, const PathState& path, const Accel* accel) {
  const Bsdf material = evaluate_material(scene, point, path, accel);
  Vec3 n;
  for (int i = 0; i < material.subsurface_count; ++i) {
    const Subsurface& subsurface = material.subsurfaces[static_cast<size_t>(i)];
    n += subsurface.n * subsurface.sample_weight;
  }
  Bsdf bsdf;
  bsdf.ng = point.ng;
  bsdf.ns = point.ns;
  bsdf.wo = point.wo;
  bsdf.is_strand = point.is_strand;
  bsdf.bump_ns = material.bump_ns;
  bsdf.corrects_bumps = material.corrects_bumps;
  add_lobe(bsdf, LambertLobe{normalize_or(n, point.ns)}, Rgb(1.0f), 1.0f, Rgb(1.0f));
  return bsdf;
}

Rgb evaluate_emission(const Scene& scene, const SurfacePoint& point, const PathState& path, const Accel* accel) {
  const MaterialProgram* program = find_program(scene, point.material);
  if (program == nullptr || !program->may_emit) return {};
  Rgb emission;
  as_program_takes(point, *program, [&](const SurfacePoint& taken) {
    emission = run_emission({.scene = scene, .program = *program, .point = taken, .path = path, .accel = accel});
  });
  return emission;
}

Rgb evaluate_lamp_emission(const Scene& scene, const Instance& object, const SurfacePoint& point,
                           const PathState& path) {
  const MaterialProgram* program = find_program(scene, point.material);
  if (program == nullptr || !program->may_emit) return {};
  PathState without_kind = path;  // Light Path nodes of lamps know of no kind of ray, as in Cycles
  without_kind.ray_kind = 0;
  without_kind.is_singular = false;
  return run_emission({scene, *program, point, without_kind, false, &object});
}

Rgb evaluate_transparency(const Scene& scene, const SurfacePoint& point, const PathState& path, const Accel* accel) {
  const MaterialProgram* program = find_program(scene, point.material);
  if (program == nullptr || !program->may_be_transparent) return {};
  const bool may_hide_light = !program->has_transparent_shadow && !program->has_volume;
  if (may_hide_light && path.ray_kind == kVisibleToShadow) return {};
  Rgb transparency;
  bool is_portal = false;
  as_program_takes(point, *program, [&](const SurfacePoint& taken) {
    run({.scene = scene, .program = *program, .point = taken, .path = path, .accel = accel},
        program->transparency_instructions, [&](const Instruction& closure, std::span<const Vec3> in) {
          transparency += closure_transparency(closure.op, in, closure.parameters, taken, path.ray_kind);
          is_portal |= is_ray_portal(closure.op, in);
        });
  });
  return is_portal ? Rgb(0.0f) : transparency;
}

Rgb evaluate_environment(const Scene& scene, Vec3 direction, const PathState& path) {
  const MaterialProgram* program = find_program(scene, scene.environment.material);
  if (program == nullptr || !program->may_emit) return {};
  return run_emission({scene, *program, environment_point(scene, direction), arriving_from_sky(path), true});
}

Vec3 evaluate_displacement(const Scene& scene, const SurfacePoint& point) {
  const MaterialProgram& program = *find_program(scene, point.material);
  const std::span<const Instruction> instructions = program.displacement_instructions;
  const size_t place = instructions.back().first_input + 1;
  if (program.inputs[place].is_constant()) return program.input_values[place];
  PathState path;
  path.ray_kind = 0;  // no ray arrives
  Registers registers;
  run({scene, program, point, path}, instructions.first(instructions.size() - 1), registers,
      [](const Instruction&, std::span<const Vec3>) {});
  return registers.read(static_cast<size_t>(program.inputs[place].index()));
}

float object_density(const Scene& scene, const Instance& instance) {
  const Mesh* mesh = scene.meshes[static_cast<size_t>(instance.mesh)].get();
  if (!mesh->volume || !mesh->volume->scales_with_object) return 1.0f;
  const float unit = 1.0f / std::sqrt(3.0f);  // of a diagonal, as in Cycles
  const float size = length(instance.object_to_world.vector({unit, unit, unit}));
  return size > 0.0f ? 1.0f / size : 1.0f;
}

namespace {

/// Where what is at a place of a volume object was when its grids were as they are.
Vec3 undrifted(const Scene& scene, const Instance& instance, Vec3 position) {
  const VoxelVolume* volume = scene.meshes[static_cast<size_t>(instance.mesh)]->volume.get();
  if (!volume || !volume->drift || volume->drifts == 0.0f) return position;
  const Vec3 place = inverse(instance.object_to_world).point(position);
  return instance.object_to_world.point(volume->origin_of(place));
}

}  // namespace

void add_medium(Medium& medium, const Scene& scene, uint32_t instance, int material, const PathState& path,
                Vec3 direction, Vec3 position) {
  const MaterialProgram* program = find_program(scene, material);
  if (program == nullptr || !program->has_volume) return;
  SurfacePoint point;
  point.position = undrifted(scene, scene.instances[instance], position);
  point.ng = point.ns = point.wo = -direction;  // as Cycles: there is no surface
  point.instance = instance;
  point.material = material;
  run_medium({scene, *program, point, path, false, nullptr, true}, object_density(scene, scene.instances[instance]),
             medium);
}

void add_environment_medium(Medium& medium, const Scene& scene, const PathState& path, Vec3 direction, Vec3 position) {
  const MaterialProgram* program = find_program(scene, scene.environment.material);
  if (program == nullptr || !program->has_volume) return;
  SurfacePoint point = environment_point(scene, direction);
  point.position = position;
  run_medium({scene, *program, point, path, true}, 1.0f, medium);
}

void evaluate_aovs(const Scene& scene, const SurfacePoint& point, const PathState& path, const TakeAov& take,
                   const Accel* accel) {
  const MaterialProgram* program = find_program(scene, point.material);
  if (program != nullptr)
    run_aovs({.scene = scene, .program = *program, .point = point, .path = path, .accel = accel}, take);
}

void evaluate_environment_aovs(const Scene& scene, Vec3 direction, const PathState& path, const TakeAov& take) {
  const MaterialProgram* program = find_program(scene, scene.environment.material);
  if (program == nullptr) return;
  run_aovs({scene, *program, environment_point(scene, direction), arriving_from_sky(path), true}, take);
}

Vec3 evaluate_environment_input(const Scene& scene, size_t instruction, size_t input, Vec3 direction) {
  const MaterialProgram& program = *scene.materials[static_cast<size_t>(scene.environment.material)];
  const std::span<const Instruction> instructions = program.emission_instructions;
  const size_t place = instructions[instruction].first_input + input;
  if (program.inputs[place].is_constant()) return program.input_values[place];
  Registers registers;
  run({scene, program, environment_point(scene, direction), PathState{}, true}, instructions.first(instruction),
      registers, [](const Instruction&, std::span<const Vec3>) {});
  return registers.read(static_cast<size_t>(program.inputs[place].index()));
}

}  // namespace cistern
