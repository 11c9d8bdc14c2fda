#pragma once

#include <memory>
#include <vector>

#include "scene/scene.h"

namespace cistern {

/// Of an instance with a mesh, in world space.
Bounds3 world_bounds(const Scene& scene, const Instance& instance);

/// How dense a medium that varies gets in each block of a box around it: guesses by samples, which no mean depends on.
struct ExtinctionBounds {
  Transform object_to_blocks;  // whole numbers are where blocks meet
  std::array<int, 3> blocks{1, 1, 1};
  std::vector<float> bound;  // 1/m, above 0: what the extinction hardly exceeds; z the fastest
  float largest = 0.0f;
};

/// Of what an instance has inside; places in parallel, with the caller's threads.
ExtinctionBounds find_extinction_bounds(const Scene& scene, uint32_t instance);

/// The same of the medium of the world, around the camera, so that blocks are as large as they are far away: boxes with
/// one middle, each twice as large as the one before and in as many blocks. Of each place the smallest box that it is
/// in counts; beyond the largest there is nothing.
struct WorldExtinctionBounds {
  static constexpr int kBlocks = 16, kBoxes = 24;  // blocks: along an axis
  Vec3 middle;
  float half_size = 1.0f;    // of the smallest box, metres
  std::vector<float> bound;  // 1/m; by box, and z the fastest
};
WorldExtinctionBounds find_world_extinction_bounds(const Scene& scene);

/// The bounds of one medium along a ray, block after block.
class BlockWalk {
 public:
  /// From the start of the ray, in the space of blocks; per metre of it. Beyond the box the bound is the largest.
  BlockWalk(const ExtinctionBounds& bounds, float scale, Vec3 origin, Vec3 direction);
  BlockWalk() = default;

  float bound() const { return bound_; }
  /// Where along the ray the bound ends; infinity after the last block.
  float end() const { return end_; }
  void advance();

 private:
  void enter_block();

  const ExtinctionBounds* bounds_ = nullptr;
  float scale_ = 1.0f, bound_ = 0.0f, end_ = 0.0f;
  float leave_ = 0.0f;  // where the ray leaves the box; below 0: it has
  std::array<int, 3> cell_{}, step_{};
  std::array<float, 3> next_{},
      delta_{};  // where the ray comes to the next block of an axis, and how far apart they are
};

/// The same in the medium of the world.
class WorldBlockWalk {
 public:
  WorldBlockWalk(const WorldExtinctionBounds& bounds, Vec3 origin, Vec3 direction);

  float bound() const { return bound_; }
  float begin() const { return begin_; }
  float end() const { return end_; }
  void advance() { look(end_); }

 private:
  void look(float distance);

  const WorldExtinctionBounds* bounds_;
  Vec3 origin_, direction_;  // from the middle, in half sizes of the smallest box; per metre
  float bound_ = 0.0f, begin_ = 0.0f, end_ = 0.0f;
};

}  // namespace cistern
