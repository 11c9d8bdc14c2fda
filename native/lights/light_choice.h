#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/alias_table.h"
#include "lights/light_set.h"
#include "lights/light_tree.h"
#include "lights/portals.h"

namespace cistern {

/// What the samplers know of an emitter.
struct EmitterEstimate {
  bool is_distant = false;           // sun or environment
  float power = 0.0f;                // W (magnitude); a distant one's through a disk of the scene's radius
  LightBounds bounds;                // unless distant
  Vec3 direction;                    // of a sun; zero for light from everywhere
  float cos_half_angle = 1.0f;       // of a sun
  float irradiance = 0.0f;           // of a distant emitter on a plane facing it, W/m^2 (magnitude)
  const Portals* portals = nullptr;  // that a distant emitter is sampled through alone; lives as long as the choice
};

/// Chooses an emitter for a receiver; see LightSet::choose.
class LightChoice {
 public:
  LightChoice() = default;
  LightChoice(std::span<const EmitterEstimate> emitters, LightSampling sampling);

  struct Result {
    uint32_t emitter;
    float pmf;
  };
  std::optional<Result> choose(const Vec3& position, const Vec3& n, double u) const;
  float pmf(uint32_t emitter, const Vec3& position, const Vec3& n) const;
  /// See LightSet::receiver_free_pmf.
  float receiver_free_pmf(uint32_t emitter) const;
  size_t memory_bytes() const;

 private:
  struct Distant {
    uint32_t emitter;
    Vec3 direction;
    float cos_half_angle;
    float irradiance;
    const Portals* portals;
  };
  /// Irradiance a distant emitter may cause; zero only where it cannot.
  static float estimate(const Distant& distant, const Vec3& position, const Vec3& n);
  float distant_estimate(const Vec3& position, const Vec3& n) const;
  float distant_share(float distant, const Vec3& position, const Vec3& n) const;
  Result choose_distant(const Vec3& position, const Vec3& n, float total, double u) const;
  std::optional<Result> choose_by_tree(const Vec3& position, const Vec3& n, double u) const;
  float pmf_by_tree(uint32_t emitter, const Vec3& position, const Vec3& n) const;

  LightSampling sampling_ = LightSampling::UNIFORM;
  uint32_t count_ = 0;
  AliasTable power_;
  LightTree tree_;
  std::vector<uint32_t> finite_;   // emitter of each leaf of the tree
  std::vector<float> power_pmf_;   // TREE: each emitter's share of all power
  std::vector<uint32_t> leaf_of_;  // leaf of an emitter, or kDistantBit | index into distant_
  std::vector<Distant> distant_;
  bool only_portals_ = true;  // are distant_
  static constexpr uint32_t kDistantBit = 0x80000000u;
};

}  // namespace cistern
