#pragma once

#include "base/lazy_vector.h"
#include "transport/path_tracer.h"

namespace cistern {

/// Light by groups, of each pixel or path sample side by side; no memory, and empty for each, where paths split none.
class GroupTable {
 public:
  void resize(const PathContext& context, size_t entries) {
    groups_ = context.light_groups;
    light_.resize(entries * groups_);
  }
  std::span<Rgb> of(size_t entry) { return {light_.data() + entry * groups_, groups_}; }
  std::span<const Rgb> of(size_t entry) const { return {light_.data() + entry * groups_, groups_}; }
  void set(size_t entry, std::span<const Rgb> light) { std::ranges::copy(light.first(groups_), of(entry).begin()); }
  void clear(size_t entry) { std::ranges::fill(of(entry), Rgb()); }
  size_t size() const { return groups_ > 0 ? light_.size() / groups_ : 0; }
  size_t memory_bytes() const { return light_.capacity() * sizeof(Rgb); }

 private:
  size_t groups_ = 0;
  LazyVector<Rgb> light_;
};

}  // namespace cistern
