#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lights/light_bounds.h"

namespace cistern {

/// A hierarchy over the finite emitters of a scene that chooses one with probability close to what it can send to a
/// receiver. Nodes have eight children, so a choice among 40,000 emitters takes five or six steps, each of which
/// estimates eight clusters at once. Memory: at most 416 bytes per node, of which there are about 1 per 5 emitters,
/// plus 4 bytes per emitter.
/// [Conty Estevez and Kulla 2018, Importance Sampling of Many Lights with Adaptive Tree Splitting], with the
/// conservative cosine bounds of [Pharr, Jakob and Humphreys 2023, Physically Based Rendering, §12.6.3]. Departures:
/// eight children instead of two, bounding spheres of the boxes instead of boxes, no splitting (one emitter per
/// choice).
class LightTree {
 public:
  LightTree() = default;
  /// One leaf per emitter, numbered as in `emitters`. Deterministic for any number of threads.
  explicit LightTree(std::span<const LightBounds> emitters);

  bool is_empty() const { return nodes_.empty(); }
  /// Upper estimate (not a bound on rounding) of the irradiance that all emitters together cause at a receiver with
  /// unit normal `n`, or zero `n` for any side; in W/m^2, magnitude. Zero only where nothing can arrive.
  float irradiance_estimate(const Vec3& position, const Vec3& n) const;

  struct Choice {
    uint32_t emitter;
    float pmf;
    double u_rest;  // what is left of `u`: again uniform in [0, 1)
  };
  /// Where no child of a node can reach the receiver although the node seemed able to, the choice goes by intensity:
  /// the probabilities of all emitters sum to 1. Empty when no emitter can reach the receiver (or there is none). `u`
  /// in [0, 1) has to have more bits than a float where there are many emitters: each step takes some.
  std::optional<Choice> choose(const Vec3& position, const Vec3& n, double u) const;
  /// Probability that `choose` returns the emitter.
  float pmf(uint32_t emitter, const Vec3& position, const Vec3& n) const;

  size_t memory_bytes() const;

  static constexpr int kWidth = 8;
  static constexpr uint32_t kLeafBit = 0x80000000u;
  static constexpr uint32_t kNoSlot = 0xffffffffu;  // of an emitter with intensity 0, which is never chosen

  /// Eight clusters or emitters, each quantity in a row of its own. Unused ones have intensity 0.
  struct alignas(32) Node {
    float center_x[kWidth] = {}, center_y[kWidth] = {}, center_z[kWidth] = {};
    float radius[kWidth] = {};  // of the bounding sphere; the sign bit marks two-sided emitters
    float axis_x[kWidth] = {}, axis_y[kWidth] = {}, axis_z[kWidth] = {};
    float cos_normals[kWidth] = {}, sin_normals[kWidth] = {}, cos_emission[kWidth] = {};
    float intensity[kWidth] = {};
    float near_distance2[kWidth] = {};  // or the squared radius, where that is larger
    uint32_t child[kWidth] = {};        // node, or emitter | kLeafBit
  };

 private:
  std::vector<Node> nodes_;               // the root first
  std::vector<uint32_t> parent_of_node_;  // slot of a node or emitter: 8 * node that holds it + child number
  std::vector<uint32_t> slot_of_emitter_;
};

/// Nodes of a tree over `emitters`, root first; empty without emitters.
std::vector<LightTree::Node> build_light_tree(std::span<const LightBounds> emitters);

}  // namespace cistern
