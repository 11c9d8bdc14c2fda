#pragma once

#include <array>

#include "lights/light_choice.h"
#include "scene/light_linking.h"

namespace cistern {

/// A LightChoice for the receivers of each light set, among those emitters alone that light it. Sets that the same
/// emitters light share theirs; without light linking there is one.
class LinkedChoice {
 public:
  LinkedChoice() = default;
  /// `lit`: LightLinks::lit of each emitter.
  LinkedChoice(std::span<const EmitterEstimate> emitters, std::span<const uint64_t> lit, LightSampling sampling);

  std::optional<LightChoice::Result> choose(uint8_t light_set, const Vec3& position, const Vec3& n, double u) const;
  /// 0 for emitters that do not light the set.
  float pmf(uint8_t light_set, uint32_t emitter, const Vec3& position, const Vec3& n) const;
  const LightChoice& among_all() const { return all_; }
  size_t memory_bytes() const;

 private:
  static constexpr uint32_t kNone = 0xffffffffu;
  struct Part {
    LightChoice choice;
    std::vector<uint32_t> emitters;  // that it chooses among
    std::vector<uint32_t> index;     // of each emitter among them, or kNone
  };
  static Part make_part(std::span<const EmitterEstimate> emitters, std::span<const uint64_t> lit, uint8_t light_set,
                        LightSampling sampling);
  const Part* part_of(uint8_t light_set) const {
    return parts_.empty() || part_of_set_[light_set] < 0 ? nullptr
                                                         : &parts_[static_cast<size_t>(part_of_set_[light_set])];
  }

  LightChoice all_;
  std::vector<Part> parts_;
  std::array<int8_t, kLightSets + 1> part_of_set_{};  // -1: all; beside parts_ only
};

}  // namespace cistern
