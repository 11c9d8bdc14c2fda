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

float largest_half_size() { return std::ldexp(1.0f, WorldExtinctionBounds::kBoxes - 1); }

size_t block_of(int box, const std::array<int, 3>& cell) {
  constexpr size_t kBlocks = WorldExtinctionBounds::kBlocks;
  const auto at = [&](size_t axis) { return static_cast<size_t>(cell[axis]); };
  return ((static_cast<size_t>(box) * kBlocks + at(0)) * kBlocks + at(1)) * kBlocks + at(2);
}

/// How far surfaces reach from the camera along an axis.
float extent_of(const Scene& scene) {
  const Vec3 middle = scene.camera.camera_to_world.translation;
  Bounds3 all{middle, middle};
  for (const Instance& instance : scene.instances)
    if (instance.mesh >= 0 && scene.meshes[static_cast<size_t>(instance.mesh)])
      all.extend(world_bounds(scene, instance));
  const Vec3 above = all.upper - middle, below = middle - all.lower;
  return std::max({above.x, above.y, above.z, below.x, below.y, below.z});
}

}  // namespace

Bounds3 world_bounds(const Scene& scene, const Instance& instance) {
  const Bounds3& box = scene.meshes[static_cast<size_t>(instance.mesh)]->bounds;
  Bounds3 bounds;
  for (int corner = 0; corner < 8 && !box.is_empty(); ++corner) {
    bounds.extend(
        instance.object_to_world.point({corner & 1 ? box.upper.x : box.lower.x, corner & 2 ? box.upper.y : box.lower.y,
                                        corner & 4 ? box.upper.z : box.lower.z}));
  }
  return bounds;
}

WorldExtinctionBounds find_world_extinction_bounds(const Scene& scene) {
  constexpr float kFinest = 1e-3f, kCoarsest = 1.0f;  // half sizes of the smallest box, metres
  constexpr float kPartOfExtent = 1.0f / 64.0f;
  constexpr int kBlocks = WorldExtinctionBounds::kBlocks;
  constexpr size_t kInBox = static_cast<size_t>(kBlocks) * kBlocks * kBlocks;
  WorldExtinctionBounds bounds;
  bounds.middle = scene.camera.camera_to_world.translation;
  bounds.half_size = std::clamp(kPartOfExtent * extent_of(scene), kFinest, kCoarsest);
  bounds.bound.resize(WorldExtinctionBounds::kBoxes * kInBox);
  parallel_blocks(bounds.bound.size(), kBlocksPerTask, [&](size_t, size_t begin, size_t end) {
    for (size_t b = begin; b < end; ++b) {
      Rng rng(~0U, static_cast<uint32_t>(b), 0, 0);
      const int box = static_cast<int>(b / kInBox), i = static_cast<int>(b % kInBox);
      const Vec3 corner{static_cast<float>(i / (kBlocks * kBlocks)), static_cast<float>(i / kBlocks % kBlocks),
                        static_cast<float>(i % kBlocks)};
      const float half_size = std::ldexp(bounds.half_size, box), block_size = 2.0f * half_size / kBlocks;
      for (int k = 0; k < kPlacesInBlock; ++k) {
        const Vec2 u = rng.next_vec2();
        const Vec3 place = corner + Vec3{u.x, u.y, rng.next_float()};
        Medium medium;
        add_environment_medium(medium, scene, PathState{}, square_to_sphere(rng.next_vec2()),
                               bounds.middle + block_size * place - Vec3{half_size, half_size, half_size});
        bounds.bound[b] = std::max(bounds.bound[b], kBoundSlack * max_component(medium.extinction));
      }
    }
  });
  for (int box = 0; box < WorldExtinctionBounds::kBoxes; ++box) {
    const auto begin = bounds.bound.begin() + static_cast<std::ptrdiff_t>(static_cast<size_t>(box) * kInBox);
    const std::vector<float> known(begin, begin + static_cast<std::ptrdiff_t>(kInBox));
    const float width = std::ldexp(2.0f * bounds.half_size, box);
    std::ranges::transform(dilated(known, {kBlocks, kBlocks, kBlocks}), begin,
                           [&](float bound) { return std::clamp(bound, kFewestSteps / width, kMostSteps / width); });
  }
  return bounds;
}

WorldBlockWalk::WorldBlockWalk(const WorldExtinctionBounds& bounds, Vec3 origin, Vec3 direction)
    : bounds_(&bounds),
      origin_((origin - bounds.middle) * (1.0f / bounds.half_size)),
      direction_(direction * (1.0f / bounds.half_size)) {
  look(0.0f);
}

/// A little farther on, where the next block has begun for sure: so near its end, a block is taken for the next.
void WorldBlockWalk::look(float distance) {
  constexpr int kBlocks = WorldExtinctionBounds::kBlocks;
  constexpr float kAhead = 1e-4f;  // of the size of a block
  const auto reach_of = [](Vec3 p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); };
  const auto box_of = [](float reach) { return reach > 1.0f ? std::ilogb(reach) + 1 : 0; };
  const float per_metre = length(direction_), reach = reach_of(origin_ + distance * direction_);
  const float block = std::ldexp(2.0f / kBlocks, std::min(box_of(reach), WorldExtinctionBounds::kBoxes));
  const float start = std::max(distance + kAhead * block / per_metre, std::nextafter(distance, kInfinity));
  const Vec3 place = origin_ + start * direction_;
  const int box = box_of(reach_of(place));
  begin_ = distance;
  end_ = kInfinity;
  if (box >= WorldExtinctionBounds::kBoxes) {
    bound_ = 0.0f;
    const float half_size = largest_half_size();
    float enter = start, leave = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
      const float a = (-half_size - origin_[axis]) / direction_[axis],
                  b = (half_size - origin_[axis]) / direction_[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    if (enter < leave) end_ = enter;
    return;
  }
  const float half_size = std::ldexp(1.0f, box), size = 2.0f * half_size / kBlocks;
  std::array<int, 3> cell{};
  for (int axis = 0; axis < 3; ++axis) {
    const float at = (place[axis] + half_size) / size;
    int index = std::clamp(static_cast<int>(at), 0, kBlocks - 1);
    const float d = direction_[axis];
    const auto leaves_at = [&] {
      return (static_cast<float>(d > 0.0f ? index + 1 : index) * size - half_size - origin_[axis]) / d;
    };
    if (d != 0.0f && leaves_at() <= start && (d > 0.0f ? index + 1 < kBlocks : index > 0)) index += d > 0.0f ? 1 : -1;
    if (d != 0.0f) end_ = std::min(end_, leaves_at());  // by rounding, places may lie on the face behind
    cell[static_cast<size_t>(axis)] = index;
  }
  end_ = std::max(end_, start);
  bound_ = bounds_->bound[block_of(box, cell)];
}

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
