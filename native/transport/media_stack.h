#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace cistern {

/// The media that a ray is in, besides that of the world: those inside surfaces of a material of an instance. Entering
/// one twice is entering it once, as in Cycles. In the order in which they were entered; media beyond the capacity are
/// left out.
class MediaStack {
 public:
  static constexpr int kCapacity = 16;
  static constexpr uint32_t kWorld = ~0U;  // in place of an instance
  struct Entry {
    uint32_t instance = 0;
    int material = -1;
    friend bool operator==(const Entry&, const Entry&) = default;
  };

  const Entry* begin() const { return entries_.data(); }
  const Entry* end() const { return entries_.data() + count_; }
  bool is_empty() const { return count_ == 0; }
  void clear() { count_ = 0; }

  bool contains(Entry entry) const {
    for (const Entry& known : *this)
      if (known == entry) return true;
    return false;
  }
  void enter(Entry entry) {
    if (count_ < kCapacity && !contains(entry)) entries_[static_cast<std::size_t>(count_++)] = entry;
  }
  void leave(Entry entry) {
    for (int i = 0; i < count_; ++i) {
      if (!(entries_[static_cast<std::size_t>(i)] == entry)) continue;
      for (--count_; i < count_; ++i) entries_[static_cast<std::size_t>(i)] = entries_[static_cast<std::size_t>(i) + 1];
      return;
    }
  }

 private:
  int count_ = 0;
  std::array<Entry, kCapacity> entries_;
};

}  // namespace cistern
