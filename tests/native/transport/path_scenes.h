#pragma once

#include <memory>
#include <utility>

#include "scene/scene_builder.h"
#include "shading/program_builder.h"
#include "support/statistics.h"
#include "transport/clear_panes.h"
#include "transport/path_tracer.h"

namespace cistern::test {

/// Small scenes for the path tracer, a line an object.
class PathScene {
 public:
  SceneBuilder builder;

  PathScene() { object_ = builder.add_object_name("object"); }

  int diffuse(float albedo) {
    ProgramBuilder p;
    const Operand normal = p.add(Op::NORMAL, {});
    p.add(Op::CLOSURE_DIFFUSE, {p.constant(1), p.constant(albedo), p.constant(0), normal});
    return builder.add_material(p.program);
  }
  /// GGX reflection without Fresnel or compensation; roughness 0 is a mirror.
  int glossy(float roughness) {
    ProgramBuilder p;
    const Operand normal = p.add(Op::NORMAL, {}), zero = p.constant(0);
    p.add(Op::CLOSURE_GLOSSY, {p.constant(1), p.constant(1), p.constant(roughness), zero, zero, normal, normal}, {0});
    return builder.add_material(p.program);
  }
  /// Both at once; of light, the share `glossy_share` is reflected by the second.
  int mixed(float albedo, float roughness, float glossy_share) {
    ProgramBuilder p;
    const Operand normal = p.add(Op::NORMAL, {}), zero = p.constant(0);
    p.add(Op::CLOSURE_DIFFUSE, {p.constant(1.0f - glossy_share), p.constant(albedo), zero, normal});
    p.add(Op::CLOSURE_GLOSSY,
          {p.constant(glossy_share), p.constant(albedo), p.constant(roughness), zero, zero, normal, normal}, {0});
    return builder.add_material(p.program);
  }
  /// Where `normal` is zero, that of the surface. The rest of its weight is diffuse, or transparent.
  int clear_glass(float ior, float roughness = 0.0f, Vec3 normal = {}, float diffuse = 0.0f, float transparent = 0.0f) {
    ProgramBuilder p;
    const Operand weight = p.constant(1.0f - diffuse - transparent);
    if (transparent > 0.0f) p.add(Op::CLOSURE_TRANSPARENT, {p.constant(transparent), p.constant(1)});
    const Operand n = normal == Vec3{} ? p.add(Op::NORMAL, {}) : p.constant(normalize(normal)), zero = p.constant(0);
    p.add(Op::CLOSURE_GLASS,
          {weight, p.constant(1), p.constant(roughness), p.constant(ior), n, zero, zero, zero, zero, zero}, {0});
    if (diffuse > 0.0f) p.add(Op::CLOSURE_DIFFUSE, {p.constant(diffuse), p.constant(0.8f), zero, n});
    return builder.add_material(p.program);
  }
  int emission(Vec3 radiance) {
    ProgramBuilder p;
    p.add(Op::CLOSURE_EMISSION, {p.constant(1), p.constant(radiance), p.constant(1)});
    return builder.add_material(p.program);
  }
  /// Of this radiance where x > 0.2 m, else black.
  int striped_emission(float radiance) {
    ProgramBuilder p;
    const Operand zero = p.constant(0), x = p.add(Op::SEPARATE_X, {p.add(Op::POSITION, {}, {0})});
    const Operand is_bright = p.add(Op::MATH, {x, p.constant(0.2f), zero}, {14, 0});
    p.add(Op::CLOSURE_EMISSION, {p.constant(1), p.constant(radiance), is_bright});
    return builder.add_material(p.program);
  }
  /// A share `weight` of the surface passes `tint`; the rest is diffuse paint of this albedo.
  int transparent(Vec3 tint, float weight = 1.0f, float albedo = 0.0f) {
    ProgramBuilder p;
    const Operand normal = p.add(Op::NORMAL, {});
    p.add(Op::CLOSURE_TRANSPARENT, {p.constant(weight), p.constant(tint)});
    if (albedo > 0.0f)
      p.add(Op::CLOSURE_DIFFUSE, {p.constant(1.0f - weight), p.constant(albedo), p.constant(0), normal});
    return builder.add_material(p.program);
  }
  int holdout(float weight) {
    ProgramBuilder p;
    p.add(Op::CLOSURE_HOLDOUT, {p.constant(weight)});
    return builder.add_material(p.program);
  }

  /// Faces along u x v. Returns the instance, for `replace_last`.
  Instance quad(Vec3 center, Vec3 u, Vec3 v, int material, uint8_t visibility = kVisibleToAll) {
    const Vec3 c = center - 0.5f * (u + v);
    const std::vector<Vec3> positions{c, c + u, c + u + v, c + v};
    const std::vector<int32_t> corners{0, 1, 2, 3}, offsets{0, 4};
    MeshInput input;
    input.name = "quad";
    input.positions = positions, input.corner_vertices = corners, input.polygon_offsets = offsets;
    Instance instance;
    instance.mesh = builder.add_mesh(input);
    instance.material_set = builder.add_material_set({material}, "quad");
    instance.object = object_;
    instance.visibility = visibility;
    last_ = builder.add_instance(instance);
    return instance;
  }
  /// A horizontal square of side `size` around (0, 0, z), facing up.
  Instance floor(float z, float size, int material, uint8_t visibility = kVisibleToAll) {
    return quad({0, 0, z}, {size, 0, 0}, {0, size, 0}, material, visibility);
  }
  /// Puts the changed copy of the instance added last in its place.
  void replace_last(const Instance& instance) { builder.add_instance(instance, last_); }

  void environment(Vec3 radiance) { environment_of(emission(radiance)); }
  /// Radiance `base` from everywhere, and `more` max(z, 0)^8.
  void glowing_environment(float base, float more) {
    ProgramBuilder p;
    const Operand zero = p.constant(0), z = p.add(Op::SEPARATE_Z, {p.add(Op::GENERATED, {}, {0})});
    const Operand up = p.add(Op::MATH, {z, zero, zero}, {12, 0});
    const Operand glow = p.add(Op::MATH, {up, p.constant(8), zero}, {5, 0});
    const Operand sum = p.add(Op::MATH, {glow, p.constant(more), p.constant(base)}, {4, 0});
    p.add(Op::CLOSURE_EMISSION, {p.constant(1), p.constant(1), sum});
    environment_of(builder.add_material(p.program));
  }
  /// Of this radiance where x > 0, else black.
  void half_environment(float bright) {
    ProgramBuilder p;
    const Operand zero = p.constant(0), x = p.add(Op::SEPARATE_X, {p.add(Op::GENERATED, {}, {0})});
    const Operand right = p.add(Op::MATH, {x, zero, zero}, {14, 0});
    p.add(Op::CLOSURE_EMISSION, {p.constant(1), p.constant(bright), right});
    environment_of(builder.add_material(p.program));
  }
  Light point_lamp(Vec3 position, float intensity, float radius = 0.0f) {
    Light light;
    light.name = "lamp";
    light.shape = PointLight{position, radius, Rgb(intensity), false};
    builder.add_light(light);
    return light;
  }
  /// A square of side `size` that shines along `normal` = +z or -z.
  Light area_lamp(Vec3 center, float size, float facing_z, float radiance) const {
    Light light;
    light.name = "area";
    light.shape = AreaLight{center, {size, 0, 0}, {0, size, 0}, {0, 0, facing_z}, false, Rgb(radiance), kPi};
    return light;
  }

 private:
  void environment_of(int material) {
    Environment sky;
    sky.material = material;
    builder.set_environment(sky);
  }

  int object_ = 0, last_ = 0;
};

/// The averages of the parts of a record over many paths along one camera ray.
struct PathMeans {
  Moments direct, indirect, emission, environment, alpha;
  PathRecord last;
};

class Tracer {
 public:
  explicit Tracer(const PathScene& scene, const PathLimits& limits = {},
                  EnvironmentDensity density = EnvironmentDensity::COMPLETE)
      : scene_(scene.builder.snapshot()),
        accel_(Accel::build(scene_)),
        lights_(scene_, LightSampling::POWER, density),
        context_{*scene_,
                 *accel_,
                 lights_,
                 limits,
                 {},
                 true,
                 scatter_kinds_matter(*scene_, limits),
                 emitters_tell_kinds(*scene_)} {
    context_.has_shadow_links = scene_->has_shadow_links();
  }

  const PathContext& context() const { return context_; }
  const std::shared_ptr<const Scene>& scene() const { return scene_; }
  void take_light_samples(int count) { context_.light_samples = count; }
  void pass_panes() { context_.passes_panes = may_pass_panes(*scene_, context_.limits); }
  /// Planted: reuse as if kinds of scattering were all the same.
  void forget_kinds() { context_.tells_kinds = context_.divides_kinds = false; }

  PathMeans trace(Vec3 origin, Vec3 direction, int paths = 1, uint64_t seed = 1) const {
    PathMeans means;
    PathScratch scratch;
    const Ray ray{origin, normalize(direction)};
    for (int i = 0; i < paths; ++i) {
      PathSampler sampler(seed, 0, static_cast<uint32_t>(i), SampleSequence::RANDOM);
      const PathRecord record = trace_path(context_, ray, sampler, scratch);
      means.direct.add(record.direct.g), means.indirect.add(record.indirect.g);
      means.emission.add(record.emission.g), means.environment.add(record.environment.g);
      means.alpha.add(record.alpha);
      means.last = record;
    }
    return means;
  }

 private:
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const Accel> accel_;
  LightSet lights_;
  PathContext context_;
};

}  // namespace cistern::test
