#include "transport/extinction_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/rng.h"
#include "base/warp.h"
#include "shading/material.h"

namespace cistern {
namespace {

constexpr int kBlocksOfMesh = 16;    // along an axis, of media inside of meshes
constexpr int kPlacesInBlock = 4;    // at random, beside those that grids know
constexpr float kBoundSlack = 1.2f;  // by how much more random places are taken for
/// Steps of tracking from one end of a medium to the other: fewer are no gain, more have more noise where it is denser.
constexpr float kFewestSteps = 1.0f, kMostSteps = 65536.0f;
constexpr size_t kBlocksPerTask = 64;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Transform box_to_blocks(const Bounds3& box, const std::array<int, 3>& blocks) {
  const Vec3 size = box.diagonal();
  const auto scale = [&](int axis) {
    return static_cast<float>(blocks[static_cast<size_t>(axis)]) / std::max(size[axis], 1e-18f);
  };
  const Vec3 s{scale(0), scale(1), scale(2)};
  return {{s.x, 0.0f, 0.0f}, {0.0f, s.y, 0.0f}, {0.0f, 0.0f, s.z}, -s * box.lower};
}

float world_diagonal(const Scene& scene, const Instance& instance) {
  const Bounds3& box = scene.meshes[static_cast<size_t>(instance.mesh)]->bounds;
  return std::max(length(instance.object_to_world.vector(box.diagonal())), 1e-18f);
}

/// The largest extinction at a place of object space, along a direction of the world, over the materials that vary.
class Densest {
 public:
  Densest(const Scene& scene, uint32_t instance) : scene_(scene), instance_(instance) {
    for (const int material : scene.material_sets[static_cast<size_t>(object().material_set)]) {
      const MaterialProgram* program = scene.materials[static_cast<size_t>(material)].get();
      if (program && program->has_volume && program->volume_varies) materials_.push_back(material);
    }
  }
  const Instance& object() const { return scene_.instances[instance_]; }
  float at(Vec3 place, Vec3 direction) const {
    float largest = 0.0f;
    for (const int material : materials_) {
      Medium medium;
      add_medium(medium, scene_, instance_, material, PathState{}, direction, object().object_to_world.point(place));
      largest = std::max(largest, max_component(medium.extinction));
    }
    return largest;
  }

 private:
  const Scene& scene_;
  uint32_t instance_;
  std::vector<int> materials_;
};

/// Each the largest of itself and those around it: what samples miss in one, or has drifted away, they may meet there.
std::vector<float> dilated(const std::vector<float>& values, const std::array<int, 3>& n) {
  std::vector<float> result = values;
  size_t stride = 1;
  for (size_t axis = 3; axis-- > 0;) {
    const std::vector<float> before = result;
    const size_t size = static_cast<size_t>(n[axis]);
    for (size_t i = 0; i < before.size(); ++i) {
      const size_t at = i / stride % size;
      if (at > 0) result[i] = std::max(result[i], before[i - stride]);
      if (at + 1 < size) result[i] = std::max(result[i], before[i + stride]);
    }
    stride *= size;
  }
  return result;
}

}  // namespace

ExtinctionBounds find_extinction_bounds(const Scene& scene, uint32_t index) {
  const Instance& instance = scene.instances[index];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  const VoxelVolume* const volume = mesh.volume.get();
  ExtinctionBounds bounds;
  if (volume) {
    bounds.blocks = volume->blocks;
    bounds.object_to_blocks = volume->object_to_blocks;
  } else {
    bounds.blocks = {kBlocksOfMesh, kBlocksOfMesh, kBlocksOfMesh};
    bounds.object_to_blocks = box_to_blocks(mesh.bounds, bounds.blocks);
  }
  const auto& n = bounds.blocks;
  const Transform blocks_to_object = inverse(bounds.object_to_blocks);
  const Densest densest(scene, index);
  bounds.bound.resize(static_cast<size_t>(n[0]) * static_cast<size_t>(n[1]) * static_cast<size_t>(n[2]));
  parallel_blocks(bounds.bound.size(), kBlocksPerTask, [&](size_t, size_t begin, size_t end) {
    for (size_t b = begin; b < end; ++b) {
      Rng rng(index, static_cast<uint32_t>(b), 0, 0);
      const int i = static_cast<int>(b);
      const int x = i / (n[1] * n[2]), y = i / n[2] % n[1], z = i % n[2];
      const Vec3 corner{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
      float largest = 0.0f;
      for (int k = 0; k < kPlacesInBlock; ++k) {
        const Vec2 u = rng.next_vec2();
        const Vec3 place = blocks_to_object.point(corner + Vec3{u.x, u.y, rng.next_float()});
        largest = std::max(largest, kBoundSlack * densest.at(place, square_to_sphere(rng.next_vec2())));
      }
      if (volume)
        for (size_t k = volume->first_place[b]; k < volume->first_place[b + 1]; ++k)
          largest = std::max(largest,
                             densest.at(volume->destination_of(volume->places[k]), square_to_sphere(rng.next_vec2())));
      bounds.bound[b] = largest;
    }
  });
  const float drift = !volume ? 1.0f : volume->drift ? std::abs(volume->drifts) * volume->drift->longest : 0.0f;
  for (int i = 0; static_cast<float>(i) < drift && i < std::max({n[0], n[1], n[2]}); ++i)
    bounds.bound = dilated(bounds.bound, n);
  const float diagonal = world_diagonal(scene, instance);
  for (float& bound : bounds.bound) {
    bound = std::clamp(bound, kFewestSteps / diagonal, kMostSteps / diagonal);
    bounds.largest = std::max(bounds.largest, bound);
  }
  return bounds;
}

BlockWalk::BlockWalk(const ExtinctionBounds& bounds, float scale, Vec3 origin, Vec3 direction)
    : bounds_(&bounds), scale_(scale) {
  float enter = 0.0f;
  leave_ = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    const float size = static_cast<float>(bounds.blocks[static_cast<size_t>(axis)]);
    const float o = origin[axis], d = direction[axis];
    if (d == 0.0f) {
      if (!(o >= 0.0f && o <= size)) leave_ = -1.0f;
      continue;
    }
    const float a = -o / d, b = (size - o) / d;
    enter = std::max(enter, std::min(a, b));
    leave_ = std::min(leave_, std::max(a, b));
  }
  bound_ = scale_ * bounds.largest;
  if (!(enter < leave_)) {  // it misses the box
    leave_ = -1.0f;
    end_ = kInfinity;
    return;
  }
  for (size_t axis = 0; axis < 3; ++axis) {
    const float o = origin[static_cast<int>(axis)], d = direction[static_cast<int>(axis)];
    cell_[axis] = std::clamp(static_cast<int>(std::floor(o + enter * d)), 0, bounds.blocks[axis] - 1);
    step_[axis] = d < 0.0f ? -1 : 1;
    delta_[axis] = d == 0.0f ? kInfinity : 1.0f / std::abs(d);
    next_[axis] = d == 0.0f ? kInfinity : (static_cast<float>(cell_[axis] + (d > 0.0f)) - o) / d;
  }
  if (enter > 0.0f) {
    end_ = enter;
  } else {
    enter_block();
  }
}

void BlockWalk::enter_block() {
  const auto& n = bounds_->blocks;
  const auto at = [&](size_t axis) { return static_cast<size_t>(cell_[axis]); };
  bound_ = scale_ * bounds_->bound[(at(0) * static_cast<size_t>(n[1]) + at(1)) * static_cast<size_t>(n[2]) + at(2)];
  end_ = std::min({next_[0], next_[1], next_[2], leave_});
}

/// Amanatides and Woo 1987, A Fast Voxel Traversal Algorithm for Ray Tracing.
void BlockWalk::advance() {
  const bool is_before = end_ < std::min({next_[0], next_[1], next_[2], leave_});
  if (leave_ > 0.0f && is_before) return enter_block();  // the box begins
  const size_t axis = next_[0] <= next_[1] ? (next_[0] <= next_[2] ? 0 : 2) : (next_[1] <= next_[2] ? 1 : 2);
  if (leave_ > 0.0f && next_[axis] < leave_) {
    cell_[axis] += step_[axis];
    next_[axis] += delta_[axis];
    if (cell_[axis] >= 0 && cell_[axis] < bounds_->blocks[axis]) return enter_block();
  }
  leave_ = -1.0f;
  bound_ = scale_ * bounds_->largest;
  end_ = kInfinity;
}

}  // namespace cistern
