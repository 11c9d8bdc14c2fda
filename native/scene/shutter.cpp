#include "scene/shutter.h"

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_map>

#include "base/check.h"
#include "base/parallel.h"
#include "scene/diced_mesh.h"
#include "scene/scene_checks.h"
#include "scene/smooth_normals.h"

namespace cistern {
namespace {

constexpr size_t kBlockSize = 1 << 14;  // vertices or corners per task

/// Triangles may differ: those of bent polygons are cut otherwise.
bool has_same_structure(const Mesh& a, const Mesh& b) {
  const auto pattern_of = [](const Mesh& mesh) { return mesh.dicing ? mesh.dicing->cut_as.get() : nullptr; };
  return pattern_of(a) == pattern_of(b) && a.positions.size() == b.positions.size() &&
         a.corner_count == b.corner_count && a.normals_domain == b.normals_domain &&
         a.normals.size() == b.normals.size() && a.radii.size() == b.radii.size();
}

/// Whether `camera` is one that the middle's can turn into. A camera is never flat: one that is mirrored is another.
bool is_like(const Camera& middle, const Camera& camera) {
  return camera.type == middle.type && camera.panorama.type == middle.panorama.type &&
         (camera.camera_to_world.determinant() < 0.0f) == (middle.camera_to_world.determinant() < 0.0f);
}

Panorama between(Panorama panorama, const Panorama& end, float t) {
  for (Vec2 Panorama::*member : {&Panorama::longitude, &Panorama::latitude, &Panorama::cylinder, &Panorama::sensor})
    panorama.*member = (1.0f - t) * (panorama.*member) + t * (end.*member);
  for (float Panorama::*member : {&Panorama::fov, &Panorama::lens})
    panorama.*member = lerp(panorama.*member, end.*member, t);
  for (size_t i = 0; i < panorama.polynomial.size(); ++i)
    panorama.polynomial[i] = lerp(panorama.polynomial[i], end.polynomial[i], t);
  return panorama;
}

/// Where a time lies: from `times[step]` on, by `t` of the way to the next. Before the first and after the last as
/// there.
struct Place {
  size_t step;
  float t;
};

Place place_of(float time, const std::vector<float>& times) {
  const auto next = std::upper_bound(times.begin() + 1, times.end() - 1, time);
  const auto step = static_cast<size_t>(next - times.begin()) - 1;
  return {step, std::clamp((time - times[step]) / (times[step + 1] - times[step]), 0.0f, 1.0f)};
}

/// What tells how its points go; null for a mesh without. Diced ones have other points.
const MeshAttribute* drift_of(const Mesh& mesh) {
  if (mesh.cage || mesh.dicing) return nullptr;
  const auto tells = [](const MeshAttribute& attribute) {
    return attribute.name == kDriftAttribute && attribute.domain == Domain::POINT && attribute.components == 3;
  };
  const auto found = std::ranges::find_if(mesh.attributes, tells);
  return found == mesh.attributes.end() ? nullptr : &*found;
}

/// Bends normals as the smooth normals of the vertices bend from one shape to another.
void bend_normals(const Mesh& from, Mesh& to) {
  if (to.normals_domain == Domain::FACE || to.is_strands()) return;
  const std::vector<Vec3> before = smooth_normals(from), after = smooth_normals(to);
  const auto bend = [&](size_t normal, uint32_t vertex) {
    const Vec3 at_rest = decode_octahedral(from.normals[normal]);
    to.normals[normal] = encode_octahedral(normalize_or(at_rest + after[vertex] - before[vertex], at_rest));
  };
  if (to.normals_domain == Domain::POINT) {
    for (uint32_t v = 0; v < to.normals.size(); ++v) bend(v, v);
  } else {
    for (size_t t = 0; t < to.triangle_count(); ++t)
      for (size_t j = 0; j < 3; ++j) bend(to.corners[t][j], to.vertices[t][j]);
  }
}

/// What points `times` their drift away are; those whose drift is not finite rest.
std::shared_ptr<const Mesh> drifted(const Mesh& mesh, const MeshAttribute& drift, float times) {
  auto moved = std::make_shared<Mesh>(mesh);
  moved->positions.reserve(mesh.positions.size() + 1);  // see Mesh
  parallel_blocks(mesh.positions.size(), kBlockSize, [&](size_t, size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) {
      const Vec3 way = times * Vec3{drift.values[3 * i], drift.values[3 * i + 1], drift.values[3 * i + 2]};
      if (is_finite(way)) moved->positions[i] = mesh.positions[i] + way;
    }
  });
  bend_normals(mesh, *moved);
  return moved;
}

/// With the triangles of the middle, and points between those of two moments.
std::shared_ptr<const Mesh> between(const Mesh& middle, const Mesh& from, const Mesh& to, float t) {
  auto mesh = std::make_shared<Mesh>(middle);
  mesh->positions.reserve(middle.positions.size() + 1);  // see Mesh
  std::vector<Bounds3> bounds(block_count(mesh->positions.size(), kBlockSize));
  parallel_blocks(mesh->positions.size(), kBlockSize, [&](size_t block, size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) {
      mesh->positions[i] = lerp(from.positions[i], to.positions[i], t);
      if (is_finite(mesh->positions[i])) bounds[block].extend(mesh->positions[i]);
    }
  });
  if (!mesh->splats)
    for (size_t i = 0; i < mesh->radii.size(); ++i) mesh->radii[i] = lerp(from.radii[i], to.radii[i], t);
  if (mesh->splats) mesh->splats = moved(*mesh->splats, mesh->positions);
  mesh->bounds = {};
  for (const Bounds3& of_block : bounds) mesh->bounds.extend(of_block);
  parallel_blocks(mesh->normals.size(), kBlockSize, [&](size_t, size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) {
      mesh->normals[i] = from.normals[i];
      if (from.normals[i] == to.normals[i]) continue;
      const Vec3 normal = decode_octahedral(from.normals[i]);
      mesh->normals[i] = encode_octahedral(normalize_or(lerp(normal, decode_octahedral(to.normals[i]), t), normal));
    }
  });
  return mesh;
}

}  // namespace

/// Finds the things of the middle at another moment.
class Shutter::Matches {
 public:
  explicit Matches(const Scene& scene) : scene_(scene) {
    for (const Instance& instance : scene.instances)
      if (instance.key != 0) by_key_.try_emplace(instance.key, &instance);
  }
  /// Null where it is not there. What is shrunk to nothing has no mesh, and is.
  const Instance* find(const Instance& instance, size_t handle) const {
    const Instance* found = nullptr;
    if (instance.key != 0) {
      const auto known = by_key_.find(instance.key);
      if (known != by_key_.end()) found = known->second;
    } else if (handle < scene_.instances.size() && scene_.instances[handle].key == 0) {
      found = &scene_.instances[handle];
    }
    return found && (found->mesh >= 0 || is_singular(found->object_to_world)) ? found : nullptr;
  }
  /// What the mesh of such an instance has become; null where that cannot be told point by point.
  std::shared_ptr<const Mesh> find_mesh(const Mesh& mesh, const Instance* found) const {
    const bool is_there = found && found->mesh >= 0 && static_cast<size_t>(found->mesh) < scene_.meshes.size();
    const std::shared_ptr<const Mesh> other = is_there ? scene_.meshes[static_cast<size_t>(found->mesh)] : nullptr;
    return other && has_same_structure(mesh, *other) ? other : nullptr;
  }

 private:
  const Scene& scene_;
  std::unordered_map<uint64_t, const Instance*> by_key_;
};

/// `at` gives an optional for the number of a moment, the middle not counted.
template <class T, class At>
Shutter::Track<T> Shutter::track(const T& middle, At&& at) const {
  Track<T> result;
  for (size_t step = 0; step <= steps_; ++step) {
    const size_t half = steps_ / 2;
    const std::optional<T> found = step == half ? std::optional<T>(middle) : at(step < half ? step : step - 1);
    if (!found) continue;
    result.times.push_back(static_cast<float>(step) / static_cast<float>(steps_));
    result.values.push_back(*found);
  }
  return result;
}

Shutter::Shutter(std::shared_ptr<const Scene> middle, std::span<const std::shared_ptr<const Scene>> moments)
    : middle_(std::move(middle)), steps_(moments.size()) {
  if (moments.empty() || moments.size() % 2 != 0)
    throw Error("shutter", "has " + std::to_string(moments.size()) + " moments beside the middle, not an even number");
  cameras_ = track<Camera>(middle_->camera, [&](size_t moment) {
    const Camera& camera = moments[moment]->camera;
    return is_like(middle_->camera, camera) ? std::optional(camera) : std::nullopt;
  });
  if (std::all_of(cameras_.values.begin(), cameras_.values.end(),
                  [&](const Camera& c) { return c == middle_->camera; }))
    cameras_ = {};
  for (size_t i = 1; i < cameras_.values.size(); ++i)
    eyes_.emplace_back(cameras_.values[i - 1].camera_to_world, cameras_.values[i].camera_to_world);
  std::vector<Matches> matches;
  for (const std::shared_ptr<const Scene>& moment : moments) matches.emplace_back(*moment);
  std::vector<std::vector<size_t>> showing(middle_->meshes.size());
  for (size_t i = 0; i < middle_->instances.size(); ++i) {
    const int mesh = middle_->instances[i].mesh;
    if (mesh < 0) continue;
    add_instance(i, matches);
    showing[static_cast<size_t>(mesh)].push_back(i);
  }
  for (size_t mesh = 0; mesh < showing.size(); ++mesh)
    if (!showing[mesh].empty()) add_mesh(mesh, showing[mesh], matches);
}

void Shutter::add_instance(size_t index, std::span<const Matches> matches) {
  const Instance& now = middle_->instances[index];
  const Track<Transform> transforms = track<Transform>(now.object_to_world, [&](size_t moment) {
    const Instance* then = matches[moment].find(now, index);
    return then ? std::optional(then->object_to_world) : std::nullopt;
  });
  if (std::all_of(transforms.values.begin(), transforms.values.end(),
                  [&](const Transform& transform) { return transform == now.object_to_world; }))
    return;
  MovingInstance& moving = instances_.emplace_back(MovingInstance{index, transforms.times, {}});
  moving.object_to_world.reserve(transforms.times.size() - 1);
  for (size_t i = 1; i < transforms.values.size(); ++i)
    moving.object_to_world.emplace_back(transforms.values[i - 1], transforms.values[i]);
}

void Shutter::add_mesh(size_t handle, std::span<const size_t> instances, std::span<const Matches> matches) {
  if (const VoxelVolume* volume = middle_->meshes[handle]->volume.get()) {
    if (volume->drift) volumes_.push_back(handle);
    return;
  }
  using Shape = std::shared_ptr<const Mesh>;
  const Shape& shape = middle_->meshes[handle];
  Track<Shape> shapes = track<Shape>(shape, [&](size_t moment) {
    Shape then;
    for (size_t i = 0; i < instances.size() && !then; ++i)
      then = matches[moment].find_mesh(*shape, matches[moment].find(middle_->instances[instances[i]], instances[i]));
    const bool is_same =
        then && then->positions == shape->positions && then->normals == shape->normals && then->radii == shape->radii;
    return then ? std::optional(is_same ? shape : then) : std::nullopt;
  });
  if (std::all_of(shapes.values.begin(), shapes.values.end(), [&](const Shape& other) { return other == shape; })) {
    const MeshAttribute* drift = drift_of(*shape);
    if (!drift) return;
    shapes = {{0.0f, 1.0f}, {drifted(*shape, *drift, -1.0f), drifted(*shape, *drift, 1.0f)}};
  }
  meshes_.push_back({handle, std::move(shapes)});
}

std::shared_ptr<const Scene> Shutter::at(float time) const {
  auto scene = std::make_shared<Scene>(*middle_);
  if (!cameras_.times.empty()) {
    move_camera(scene->camera, time);
    scene->middle_camera = {middle_, &middle_->camera};
  }
  for (const MovingInstance& moving : instances_) {
    Instance& instance = scene->instances[moving.instance];
    const auto [step, t] = place_of(time, moving.times);
    instance.object_to_world = moving.object_to_world[step].at(t);
    if (is_singular(instance.object_to_world)) instance.mesh = -1;
    instance.blends_world_normals = false;  // as in Cycles
  }
  for (const auto& [handle, shapes] : meshes_) {
    const auto [step, t] = place_of(time, shapes.times);
    const std::shared_ptr<const Mesh>&from = shapes.values[step], &to = shapes.values[step + 1];
    std::shared_ptr<const Mesh>& mesh = scene->meshes[handle];
    if (from != mesh || to != mesh) mesh = between(*mesh, *from, *to, t);
  }
  for (const size_t handle : volumes_) {
    auto mesh = std::make_shared<Mesh>(*scene->meshes[handle]);
    mesh->volume = std::make_shared<const VoxelVolume>(at_time(*mesh->volume, time));
    scene->meshes[handle] = std::move(mesh);
  }
  return scene;
}

void Shutter::move_camera(Camera& camera, float time) const {
  const auto [step, t] = place_of(time, cameras_.times);
  const Camera &from = cameras_.values[step], &to = cameras_.values[step + 1];
  camera.camera_to_world = eyes_[step].at(t);
  for (float Camera::*member : {&Camera::left, &Camera::right, &Camera::bottom, &Camera::top, &Camera::focus_distance,
                                &Camera::aperture_radius, &Camera::clip_start, &Camera::clip_end})
    camera.*member = lerp(from.*member, to.*member, t);
  camera.panorama = between(from.panorama, to.panorama, t);
}

float time_of_exposure(std::span<const float> openness, float u) {
  if (openness.size() < 2) return u;
  const size_t steps = openness.size() - 1;
  const auto light = [&](size_t step) { return 0.5 * (double{openness[step]} + openness[step + 1]); };
  double rest = 0.0;
  for (size_t step = 0; step < steps; ++step) rest += light(step);
  rest *= u;
  size_t step = 0;
  for (; step + 1 < steps && rest >= light(step); ++step) rest -= light(step);
  // Within the step, light grows by a t + (b - a) t^2 / 2.
  const double a = openness[step], b = openness[step + 1],
               root = std::sqrt(std::max(a * a + 2.0 * (b - a) * rest, 0.0));
  const double t = rest > 0.0 ? std::min(2.0 * rest / (a + root), 1.0) : 0.0;
  return static_cast<float>((static_cast<double>(step) + t) / static_cast<double>(steps));
}

}  // namespace cistern
