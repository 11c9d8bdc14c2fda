#include "scene/shutter.h"

#include <unordered_map>

#include "base/parallel.h"
#include "scene/scene_checks.h"

namespace cistern {
namespace {

constexpr size_t kBlockSize = 1 << 14;  // vertices or corners per task

/// Finds the things of the middle in another scene.
class Matches {
 public:
  explicit Matches(const Scene& scene) : scene_(scene) {
    for (const Instance& instance : scene.instances)
      if (instance.key != 0) by_key_.try_emplace(instance.key, &instance);
  }
  /// `instance` itself where it is not there. What is shrunk to nothing has no mesh, and is.
  const Instance& find(const Instance& instance, size_t handle) const {
    if (instance.mesh < 0) return instance;
    const Instance* found = nullptr;
    if (instance.key != 0) {
      const auto known = by_key_.find(instance.key);
      if (known != by_key_.end()) found = known->second;
    } else if (handle < scene_.instances.size() && scene_.instances[handle].key == 0) {
      found = &scene_.instances[handle];
    }
    const bool is_there = found && (found->mesh >= 0 || is_singular(found->object_to_world));
    return is_there ? *found : instance;
  }

 private:
  const Scene& scene_;
  std::unordered_map<uint64_t, const Instance*> by_key_;
};

/// Triangles may differ: those of bent polygons are cut otherwise.
bool has_same_structure(const Mesh& a, const Mesh& b) {
  return a.positions.size() == b.positions.size() && a.corner_count == b.corner_count &&
         a.normals_domain == b.normals_domain && a.normals.size() == b.normals.size();
}

/// What a mesh of the middle has become; the mesh itself where that cannot be told point by point.
std::shared_ptr<const Mesh> counterpart(const std::shared_ptr<const Mesh>& middle, const Scene& scene, int handle) {
  const bool is_there = handle >= 0 && static_cast<size_t>(handle) < scene.meshes.size();
  const std::shared_ptr<const Mesh> other = is_there ? scene.meshes[static_cast<size_t>(handle)] : nullptr;
  if (!other || other == middle || !has_same_structure(*middle, *other)) return middle;
  return other->positions == middle->positions && other->normals == middle->normals ? middle : other;
}

/// A camera is never flat: one that is mirrored stands as in the middle.
const Transform& unmirrored_end(const Transform& middle, const Transform& end) {
  return (end.determinant() < 0.0f) == (middle.determinant() < 0.0f) ? end : middle;
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

/// `end`, or the middle where that is another sort of camera.
const Camera& end_of_kind(const Camera& middle, const Camera& end) {
  return end.type == middle.type && end.panorama.type == middle.panorama.type ? end : middle;
}

}  // namespace

Shutter::Shutter(std::shared_ptr<const Scene> middle, const Scene& opening, const Scene& closing)
    : middle_(std::move(middle)),
      cameras_{end_of_kind(middle_->camera, opening.camera), end_of_kind(middle_->camera, closing.camera)},
      eye_{{unmirrored_end(middle_->camera.camera_to_world, cameras_.before.camera_to_world),
            middle_->camera.camera_to_world},
           {middle_->camera.camera_to_world,
            unmirrored_end(middle_->camera.camera_to_world, cameras_.after.camera_to_world)}},
      moves_camera_(!(cameras_.before == middle_->camera && cameras_.after == middle_->camera)) {
  const Matches in_opening(opening), in_closing(closing);
  std::vector<bool> is_known(middle_->meshes.size());
  for (size_t i = 0; i < middle_->instances.size(); ++i) {
    const Instance& now = middle_->instances[i];
    if (now.mesh < 0) continue;
    const Instance &before = in_opening.find(now, i), &after = in_closing.find(now, i);
    const Transform& transform = now.object_to_world;
    const Transform &first = before.object_to_world, &last = after.object_to_world;
    if (!(first == transform && last == transform)) instances_.push_back({i, {{first, transform}, {transform, last}}});
    const auto mesh = static_cast<size_t>(now.mesh);
    if (is_known[mesh]) continue;
    is_known[mesh] = true;
    const std::shared_ptr<const Mesh>& shape = middle_->meshes[mesh];
    const std::shared_ptr<const Mesh> opened = &before == &now ? shape : counterpart(shape, opening, before.mesh);
    const std::shared_ptr<const Mesh> closed = &after == &now ? shape : counterpart(shape, closing, after.mesh);
    if (opened != shape || closed != shape) meshes_.push_back({mesh, {opened, closed}});
  }
}

std::shared_ptr<const Scene> Shutter::at(float time) const {
  auto scene = std::make_shared<Scene>(*middle_);
  const bool is_before = time < 0.5f;
  const float in_half = 2.0f * time - (is_before ? 0.0f : 1.0f);
  const float from_middle = is_before ? 1.0f - in_half : in_half;
  if (moves_camera_) {
    const Camera& end = is_before ? cameras_.before : cameras_.after;
    Camera& camera = scene->camera;
    camera.camera_to_world = (is_before ? eye_.before : eye_.after).at(in_half);
    for (float Camera::*member : {&Camera::left, &Camera::right, &Camera::bottom, &Camera::top, &Camera::focus_distance,
                                  &Camera::aperture_radius, &Camera::clip_start, &Camera::clip_end})
      camera.*member = lerp(camera.*member, end.*member, from_middle);
    camera.panorama = cistern::between(camera.panorama, end.panorama, from_middle);
  }
  for (const MovingInstance& moving : instances_) {
    Instance& instance = scene->instances[moving.instance];
    instance.object_to_world = (is_before ? moving.object_to_world.before : moving.object_to_world.after).at(in_half);
    if (is_singular(instance.object_to_world)) instance.mesh = -1;
  }
  for (const MovingMesh& moving : meshes_) {
    std::shared_ptr<const Mesh>& mesh = scene->meshes[moving.mesh];
    const Mesh& end = is_before ? *moving.ends.before : *moving.ends.after;
    if (&end != mesh.get()) mesh = between(*mesh, end, from_middle);
  }
  return scene;
}

std::shared_ptr<const Mesh> Shutter::between(const Mesh& middle, const Mesh& end, float t) {
  auto mesh = std::make_shared<Mesh>(middle);
  mesh->positions.reserve(middle.positions.size() + 1);  // see Mesh
  std::vector<Bounds3> bounds(block_count(mesh->positions.size(), kBlockSize));
  parallel_blocks(mesh->positions.size(), kBlockSize, [&](size_t block, size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) {
      mesh->positions[i] = lerp(middle.positions[i], end.positions[i], t);
      if (is_finite(mesh->positions[i])) bounds[block].extend(mesh->positions[i]);
    }
  });
  mesh->bounds = {};
  for (const Bounds3& of_block : bounds) mesh->bounds.extend(of_block);
  parallel_blocks(mesh->normals.size(), kBlockSize, [&](size_t, size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) {
      if (middle.normals[i] == end.normals[i]) continue;
      const Vec3 normal = decode_octahedral(middle.normals[i]);
      mesh->normals[i] = encode_octahedral(normalize_or(lerp(normal, decode_octahedral(end.normals[i]), t), normal));
    }
  });
  return mesh;
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
