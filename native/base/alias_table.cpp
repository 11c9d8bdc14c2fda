#include "base/alias_table.h"

namespace cistern {

AliasTable::AliasTable(std::span<const float> weights) {
  double sum = 0.0;
  for (const float weight : weights) sum += weight;
  if (!(sum > 0.0)) return;

  const size_t count = weights.size();
  entries_.resize(count);
  std::vector<double> scaled(count);
  std::vector<uint32_t> small, large;
  for (uint32_t i = 0; i < count; ++i) {
    const double pmf = weights[i] / sum;
    scaled[i] = pmf * static_cast<double>(count);
    entries_[i] = {1.0f, i, static_cast<float>(pmf)};
    (scaled[i] < 1.0 ? small : large).push_back(i);
  }
  while (!small.empty() && !large.empty()) {
    const uint32_t under = small.back(), over = large.back();
    small.pop_back();
    entries_[under].threshold = static_cast<float>(scaled[under]);
    entries_[under].alias = over;
    scaled[over] -= 1.0 - scaled[under];
    if (scaled[over] < 1.0) {
      large.pop_back();
      small.push_back(over);
    }
  }
  // What remains is 1 up to rounding and keeps its whole column, unless its weight is zero: such an index must never
  // be drawn, so it yields to any index that has weight.
  for (const uint32_t left : small) {
    if (weights[left] > 0.0f) continue;
    uint32_t heavy = 0;
    while (weights[heavy] == 0.0f) ++heavy;
    entries_[left].threshold = 0.0f;
    entries_[left].alias = heavy;
  }
}

}  // namespace cistern
