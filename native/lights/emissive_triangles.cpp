#include "lights/emissive_triangles.h"

#include <map>

#include "base/parallel.h"
#include "base/warp.h"
#include "lights/coincident_triangles.h"
#include "shading/material.h"

namespace cistern {

namespace {

constexpr size_t kBlockSize = 4096;
/// Part of the estimate that does not come from the triangle's own evaluations.
constexpr float kUniformShare = 0.1f;
/// Radiance assumed of a material all of whose evaluations were black, in W/sr/m^2: a dim lamp's.
constexpr float kUnseenRadiance = 0.01f;
/// Up to this many triangles of a scene are looked at in all of kPoints, more in their middle only.
constexpr size_t kFewTriangles = 1 << 16;
constexpr Vec2 kPoints[] = {{1.0f / 3.0f, 1.0f / 3.0f}, {0.1f, 0.1f}, {0.8f, 0.1f}, {0.1f, 0.8f}};

const MaterialProgram& program_of(const Scene& scene, int material) {
  return *scene.materials[static_cast<size_t>(material)];
}

/// Mean of the radiance (magnitude) sent along the normals of both sides, at the first `count` of kPoints.
float evaluated_radiance(const Scene& scene, const EmissiveTriangle& t, size_t count) {
  const Vec3 normal = normalize_or(t.scaled_normal(), {0.0f, 0.0f, 1.0f});
  PathState path;
  path.ray_kind = kVisibleToDiffuse;
  float sum = 0.0f;
  for (size_t i = 0; i < count; ++i) {
    for (const Vec3 wo : {normal, -normal}) {
      const Ray ray{t.point(kPoints[i]) + wo, -wo};
      const Hit hit{1.0f, kPoints[i].x, kPoints[i].y, t.scaled_normal(), t.instance, t.triangle};
      sum += magnitude(evaluate_emission(scene, make_surface_point(scene, ray, hit), path));
    }
  }
  return sum / static_cast<float>(2 * count);
}

/// Emission of a side of an object, where it is the same everywhere.
Rgb uniform_radiance(const Scene& scene, const EmissiveTriangle& t, bool is_backface) {
  SurfacePoint point;
  point.instance = t.instance;
  point.triangle = t.triangle;
  point.material = t.material;
  point.wo = point.ng = point.ns = {0.0f, 0.0f, 1.0f};
  point.is_backface = is_backface;
  return evaluate_emission(scene, point, {});
}

}  // namespace

bool is_emitter(const Scene& scene, int material) {
  if (material < 0 || !scene.materials[static_cast<size_t>(material)]) return false;
  const MaterialProgram& program = program_of(scene, material);
  if (!program.may_emit) return false;
  return !program.emission_is_constant || !is_black(to_rgb(program.constant_emission));
}

EmissiveTriangles::EmissiveTriangles(const Scene& scene) {
  place(scene);
  fill(scene);
  find_uniform_emission(scene);
  estimate_radiance(scene);
  join_coincident(scene);
}

EmissiveTriangles::Selection EmissiveTriangles::select(const Scene& scene, const Instance& instance) {
  Selection selection;
  const std::vector<int>& materials = scene.material_sets[static_cast<size_t>(instance.material_set)];
  if (scene.meshes[static_cast<size_t>(instance.mesh)]->is_strands()) return selection;  // found by scattered rays
  const bool any = std::any_of(materials.begin(), materials.end(), [&](int m) { return is_emitter(scene, m); });
  if (!any) return selection;
  const size_t count = scene.meshes[static_cast<size_t>(instance.mesh)]->triangle_count();
  selection.rank.assign(count, kNone);
  for (uint32_t t = 0; t < count; ++t) {
    if (!is_emitter(scene, scene.material_of(instance, t))) continue;
    selection.rank[t] = static_cast<uint32_t>(selection.triangles.size());
    selection.triangles.push_back(t);
  }
  if (selection.triangles.size() == count) selection.rank = {};
  return selection;
}

void EmissiveTriangles::place(const Scene& scene) {
  std::map<std::pair<int, int>, int> known;  // (mesh, material set) -> selection
  placements_.resize(scene.instances.size());
  uint32_t total = 0;
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (instance.mesh < 0 || !scene.meshes[static_cast<size_t>(instance.mesh)]) continue;
    const std::vector<int>& materials = scene.material_sets[static_cast<size_t>(instance.material_set)];
    if (materials.empty() || (instance.visibility & kVisibleToScattered) == 0) continue;
    const auto [found, is_new] =
        known.try_emplace({instance.mesh, instance.material_set}, static_cast<int>(selections_.size()));
    if (is_new) selections_.push_back(select(scene, instance));
    const size_t count = selections_[static_cast<size_t>(found->second)].triangles.size();
    if (count == 0) continue;
    placements_[i] = {total, found->second};
    total += static_cast<uint32_t>(count);
  }
  triangles_.resize(total);
}

void EmissiveTriangles::fill(const Scene& scene) {
  for (uint32_t i = 0; i < placements_.size(); ++i) {
    if (placements_[i].selection < 0) continue;
    const Instance& instance = scene.instances[i];
    const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
    const std::vector<uint32_t>& selected = selections_[static_cast<size_t>(placements_[i].selection)].triangles;
    parallel_blocks(selected.size(), kBlockSize, [&](size_t, size_t begin, size_t end) {
      for (size_t k = begin; k < end; ++k) {
        EmissiveTriangle& t = triangles_[placements_[i].first + k];
        const std::array<Vec3, 3> vertices = mesh.triangle_positions(selected[k]);
        t.p0 = instance.object_to_world.point(vertices[0]);
        t.edge_1 = instance.object_to_world.point(vertices[1]) - t.p0;
        t.edge_2 = instance.object_to_world.point(vertices[2]) - t.p0;
        t.clearance = surface_clearance(coordinate_reach(instance.object_to_world, vertices),
                                        normalize_or(t.scaled_normal(), {}));
        t.instance = i;
        t.triangle = selected[k];
        t.material = scene.material_of(instance, selected[k]);
      }
    });
  }
  // Only `find` needs the selections from here on, and only those with a rank.
  for (Selection& selection : selections_) {
    selection.triangles = {};
    selection.rank.shrink_to_fit();
  }
}

/// For each instance anew: its object may matter, and mirrored ones have their outside on the other side.
void EmissiveTriangles::find_uniform_emission(const Scene& scene) {
  std::map<int, int> known;  // of the instance: by material
  for (size_t i = 0; i < size(); ++i) {
    EmissiveTriangle& t = triangles_[i];
    if (i == 0 || t.instance != triangles_[i - 1].instance) known.clear();
    if (!program_of(scene, t.material).emission_is_uniform) continue;
    const auto [found, is_new] = known.try_emplace(t.material, -1);
    if (is_new) {
      SideEmission sides{uniform_radiance(scene, t, false), uniform_radiance(scene, t, true)};
      const bool is_mirrored = scene.instances[t.instance].object_to_world.determinant() < 0.0f;
      if (is_mirrored) std::swap(sides.along_normal, sides.against_normal);
      if (sides.mean() > 0.0f) {
        found->second = static_cast<int>(uniform_.size());
        uniform_.push_back(sides);
      }
    }
    t.uniform = found->second;
  }
}

void EmissiveTriangles::estimate_radiance(const Scene& scene) {
  radiance_.resize(size());
  const size_t points = size() <= kFewTriangles ? std::size(kPoints) : 1;
  parallel_blocks(size(), kBlockSize, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const SideEmission* uniform = uniform_emission(triangles_[i]);
      radiance_[i] = uniform ? uniform->mean() : evaluated_radiance(scene, triangles_[i], points);
    }
  });
  struct Mean {
    double flux = 0.0, area = 0.0;
  };
  std::vector<Mean> means(scene.materials.size());
  for (size_t i = 0; i < size(); ++i) {
    Mean& mean = means[static_cast<size_t>(triangles_[i].material)];
    const double area = triangles_[i].area();
    mean.flux += area * radiance_[i];
    mean.area += area;
  }
  for (size_t i = 0; i < size(); ++i) {
    if (triangles_[i].uniform >= 0) continue;
    const Mean& mean = means[static_cast<size_t>(triangles_[i].material)];
    const float of_material = mean.flux > 0.0 ? static_cast<float>(mean.flux / mean.area) : kUnseenRadiance;
    radiance_[i] = lerp(radiance_[i], of_material, kUniformShare);
  }
}

void EmissiveTriangles::join_coincident(const Scene& scene) {
  represented_by_ = find_coincident_triangles(scene, triangles_, uniform_);
  for (size_t i = 0; i < represented_by_.size(); ++i) {
    if (represented_by_[i] != i) triangles_[i].edge_1 = triangles_[i].edge_2 = {};
  }
}

std::optional<uint32_t> EmissiveTriangles::find(uint32_t instance, uint32_t triangle) const {
  const std::optional<uint32_t> index = number(instance, triangle);
  return index && !represented_by_.empty() ? represented_by_[*index] : index;
}

std::optional<uint32_t> EmissiveTriangles::number(uint32_t instance, uint32_t triangle) const {
  const Placement& placement = placements_[instance];
  if (placement.selection < 0) return std::nullopt;
  const std::vector<uint32_t>& rank = selections_[static_cast<size_t>(placement.selection)].rank;
  if (rank.empty()) return placement.first + triangle;
  if (rank[triangle] == kNone) return std::nullopt;
  return placement.first + rank[triangle];
}

LightBounds EmissiveTriangles::bounds(size_t index) const {
  const EmissiveTriangle& t = triangles_[index];
  LightBounds bounds;
  for (const Vec2 corner : {Vec2{0.0f, 0.0f}, Vec2{1.0f, 0.0f}, Vec2{0.0f, 1.0f}}) bounds.box.extend(t.point(corner));
  bounds.axis = normalize_or(t.scaled_normal(), {0.0f, 0.0f, 1.0f});
  bounds.cos_normals = 1.0f;
  bounds.cos_emission = 0.0f;
  const SideEmission* sides = uniform_emission(t);
  const bool is_dark_along = sides && is_black(sides->along_normal);
  bounds.is_two_sided = !sides || !(is_dark_along || is_black(sides->against_normal));
  bounds.intensity = (bounds.is_two_sided ? 1.0f : 2.0f) * radiance_[index] * t.area();
  if (is_dark_along) bounds.axis = -bounds.axis;
  return bounds;
}

size_t EmissiveTriangles::memory_bytes() const {
  size_t bytes = triangles_.capacity() * sizeof(EmissiveTriangle) + radiance_.capacity() * sizeof(float) +
                 uniform_.capacity() * sizeof(SideEmission) + represented_by_.capacity() * sizeof(uint32_t) +
                 placements_.capacity() * sizeof(Placement);
  for (const Selection& selection : selections_) bytes += selection.rank.capacity() * sizeof(uint32_t);
  return bytes;
}

}  // namespace cistern
