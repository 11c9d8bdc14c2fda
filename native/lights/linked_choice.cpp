#include "lights/linked_choice.h"

#include <algorithm>
#include <map>

namespace cistern {
namespace {

/// Emitters in all parts together, as a multiple of their number and at least: sets beyond that choose among all,
/// which is as right and more noise.
constexpr size_t kMostCopies = 4, kFewEmitters = 1 << 20;

/// Different masks of emitters, in order.
std::vector<uint64_t> different(std::span<const uint64_t> lit) {
  std::vector<uint64_t> masks;
  for (const uint64_t mask : lit)
    if (masks.empty() || masks.back() != mask) masks.push_back(mask);  // emitters of an object are neighbours
  std::ranges::sort(masks);
  masks.erase(std::unique(masks.begin(), masks.end()), masks.end());
  return masks;
}

}  // namespace

LinkedChoice::LinkedChoice(std::span<const EmitterEstimate> emitters, std::span<const uint64_t> lit,
                           LightSampling sampling)
    : all_(emitters, sampling) {
  const std::vector<uint64_t> masks = different(lit);
  if (std::ranges::all_of(masks, [](uint64_t mask) { return mask == kAllSets; })) return;
  part_of_set_.fill(-1);
  std::map<std::vector<bool>, int8_t> known;  // by which masks have the set
  known.emplace(std::vector<bool>(masks.size(), true), int8_t{-1});
  size_t room = std::max(kMostCopies * emitters.size(), kFewEmitters);
  for (uint8_t set = 0; set < kLightSets; ++set) {
    std::vector<bool> pattern(masks.size());
    std::transform(masks.begin(), masks.end(), pattern.begin(), [set](uint64_t mask) { return has_set(mask, set); });
    const auto [place, is_new] = known.try_emplace(std::move(pattern), int8_t{-1});
    if (is_new) {
      Part part = make_part(emitters, lit, set, sampling);
      if (part.emitters.size() <= room) {
        room -= part.emitters.size();
        place->second = static_cast<int8_t>(parts_.size());
        parts_.push_back(std::move(part));
      }
    }
    part_of_set_[set] = place->second;
  }
}

LinkedChoice::Part LinkedChoice::make_part(std::span<const EmitterEstimate> emitters, std::span<const uint64_t> lit,
                                           uint8_t light_set, LightSampling sampling) {
  Part part;
  std::vector<EmitterEstimate> lighting;
  part.index.assign(emitters.size(), kNone);
  for (uint32_t i = 0; i < emitters.size(); ++i) {
    if (!has_set(lit[i], light_set)) continue;
    part.index[i] = static_cast<uint32_t>(lighting.size());
    part.emitters.push_back(i);
    lighting.push_back(emitters[i]);
  }
  part.choice = LightChoice(lighting, sampling);
  return part;
}

std::optional<LightChoice::Result> LinkedChoice::choose(uint8_t light_set, const Vec3& position, const Vec3& n,
                                                        double u) const {
  const Part* const part = part_of(light_set);
  if (!part) return all_.choose(position, n, u);
  std::optional<LightChoice::Result> result = part->choice.choose(position, n, u);
  if (result) result->emitter = part->emitters[result->emitter];
  return result;
}

float LinkedChoice::pmf(uint8_t light_set, uint32_t emitter, const Vec3& position, const Vec3& n) const {
  const Part* const part = part_of(light_set);
  if (!part) return all_.pmf(emitter, position, n);
  return part->index[emitter] == kNone ? 0.0f : part->choice.pmf(part->index[emitter], position, n);
}

size_t LinkedChoice::memory_bytes() const {
  size_t bytes = all_.memory_bytes();
  for (const Part& part : parts_)
    bytes += part.choice.memory_bytes() + (part.emitters.capacity() + part.index.capacity()) * sizeof(uint32_t);
  return bytes;
}

}  // namespace cistern
