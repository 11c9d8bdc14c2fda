#include "restir/continuation_groups.h"

namespace cistern {

void ContinuationGroups::keep(std::initializer_list<std::span<PathReservoir>> all_reservoirs) {
  if (!is_kept()) return;
  size_t count = 0;
  for (const std::span<PathReservoir> reservoirs : all_reservoirs) count += reservoirs.size();
  next_.resize(*context_, count);
  size_t entry = 0;
  for (const std::span<PathReservoir> reservoirs : all_reservoirs) {
    for (PathReservoir& reservoir : reservoirs) {
      if (reservoir.W > 0.0f) {
        const std::span<const Rgb> groups = of(reservoir.sample);
        if (!groups.empty()) next_.set(entry, groups);
        reservoir.sample.origin.pixel = kEarlier | static_cast<uint32_t>(entry);
      }
      ++entry;
    }
  }
  std::swap(earlier_, next_);
}

}  // namespace cistern
