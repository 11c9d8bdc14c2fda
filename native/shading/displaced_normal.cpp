#include "shading/displaced_normal.h"

#include "shading/mesh_interpolation.h"
#include "shading/run_program.h"

namespace cistern {
namespace {

/// In object space, on the outside, interpolated over flat surfaces too (as in Cycles).
Vec3 original_normal(const Mesh& mesh, const SurfacePoint& point) {
  const Mesh& original = mesh.original();
  if (mesh.undisplaced_normals.empty()) {
    // At corners the vertices have other normals than they had, which this bump has not touched.
    const Mesh& kept = original.normals_domain == Domain::CORNER ? mesh : original;
    const Vec3 normal = interpolate_normal(kept, point.triangle, point.barycentric);
    return kept.normals.empty() ? normal : normalize_or(blend_normals(kept, point.triangle, point.barycentric), normal);
  }
  const TriangleIndices& v = original.vertices[point.triangle];
  const Vec2 b = point.barycentric;
  const auto normal = [&](size_t i) { return decode_octahedral(mesh.undisplaced_normals[v[i]]); };
  const Vec3 blended = (1.0f - b.x - b.y) * normal(0) + b.x * normal(1) + b.y * normal(2);
  return normalize_or(blended, interpolate_normal(original, point.triangle, b));
}

struct Heights {
  float at_point = 0.0f, along_first = 0.0f, along_second = 0.0f;
};

Heights evaluate_heights(const NodeContext& context) {
  Heights heights;
  run(context, context.program.displaced_bump_instructions, [&](const Instruction&, std::span<const Vec3> in) {
    heights = {in[1].x, in[2].x, in[3].x};
  });
  return heights;
}

Vec3 bent_normal(const NodeContext& c) {
  const SurfacePoint& point = c.point;
  const Transform& object_to_world = c.instance().object_to_world;
  const Mesh& original = c.mesh().original();
  const auto [p0, p1, p2] = original.triangle_positions(point.triangle);
  const Vec3 edge_1 = p1 - p0, edge_2 = p2 - p0;
  // The steps on the moved triangle, at the same weights of its vertices; positions go by those as they are.
  const auto step_before = [&](int number) {
    const Vec2 weights = shifted_barycentric(c.scene, point, {number, 1.0f}) - point.barycentric;
    return weights.x * edge_1 + weights.y * edge_2;
  };
  const Vec3 step_1 = step_before(1), step_2 = step_before(2);
  const Vec3 outside = original_normal(c.mesh(), point);
  const Vec3 normal = point.is_backface ? -outside : outside;

  SurfacePoint before = point;
  before.position = object_to_world.point(interpolate_position(original, point.triangle, point.barycentric));
  before.ns = normalize_or(transform_normal(object_to_world, normal), point.ns);
  if (point.footprint == 0.0f) return before.ns;
  NodeContext context{c.scene, c.program, before, c.path};
  context.is_undisplaced = true;
  const Heights heights = evaluate_heights(context);

  // Bump in object space, of heights in world space: as in Cycles.
  const Vec3 across_1 = cross(step_2, normal), across_2 = cross(normal, step_1);
  const float determinant = dot(step_1, across_1);
  const float width = unpack_bump_shift(c.program.displaced_bump_instructions.back().parameters[0]).width;
  const Vec3 gradient =
      (heights.along_first - heights.at_point) * across_1 + (heights.along_second - heights.at_point) * across_2;
  const Vec3 bent = width * std::abs(determinant) * normal - std::copysign(1.0f, determinant) * gradient;
  return normalize_or(transform_normal(object_to_world, normalize_or(bent, normal)), before.ns);
}

}  // namespace

void set_footprint(SurfacePoint& point, float footprint, const Scene& scene, const PathState& path) {
  point.footprint = footprint;
  const MaterialProgram* program =
      point.material < 0 ? nullptr : scene.materials[static_cast<size_t>(point.material)].get();
  if (program == nullptr || program->displaced_bump_instructions.empty()) return;
  const NodeContext context{scene, *program, point, path};
  if (!context.mesh().is_strands()) point.ns = bent_normal(context);
}

}  // namespace cistern
