#include "film/cryptomatte.h"

#include <utility>

namespace cistern {

void add_matte(std::span<MatteShare> slots, float id, float weight, const SampleRounding& rounding) {
  for (size_t i = 0; i < slots.size(); ++i) {
    MatteShare& slot = slots[i];
    if (slot.id == 0.0f) slot.id = id;
    if (slot.id != id && i + 1 < slots.size()) continue;
    rounding.add(weight, slot.weight);
    return;
  }
}

void rank_mattes(std::span<MatteShare> slots) {
  for (size_t end = 1; end < slots.size(); ++end)
    for (size_t i = end; i > 0 && slots[i].weight > slots[i - 1].weight; --i) std::swap(slots[i], slots[i - 1]);
}

}  // namespace cistern
