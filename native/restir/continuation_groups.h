#pragma once

#include "restir/path_target.h"
#include "transport/group_table.h"

namespace cistern {

/// What the continuations of path samples are by light group. Samples are copied from reservoir to reservoir and may
/// outlive the frame that found them, so each says where its groups are: among those of this frame, or beside the
/// reservoirs that were kept from the frame before. A sample without a continuation has no use for them. No memory, and
/// nothing to do, where paths split no light groups.
class ContinuationGroups {
 public:
  /// For so many samples of each frame.
  void resize(const PathContext& context, size_t samples) {
    context_ = &context;
    if (is_kept()) found_.resize(context, samples);
  }
  /// Of a sample that a path of this frame left, by its number.
  void start(size_t number, PathSample& sample, std::span<const Rgb> groups) {
    if (!is_kept()) return;
    sample.origin.pixel = static_cast<uint32_t>(number);
    found_.set(number, groups);
  }
  std::span<Rgb> found(size_t number) { return is_kept() ? found_.of(number) : std::span<Rgb>(); }
  std::span<const Rgb> of(const PathSample& sample) const {
    if (!is_kept() || is_black(sample.continuation.radiance)) return {};
    const uint32_t number = sample.origin.pixel;
    return number & kEarlier ? earlier_.of(number & ~kEarlier) : found_.of(number);
  }

  /// Before samples are found anew: the groups of those in `reservoirs`, which stay, and were all that is left of
  /// earlier ones. To be called once for each frame, with all that are kept.
  void keep(std::initializer_list<std::span<PathReservoir>> all_reservoirs);

  /// Exchanges those beside the reservoirs that were kept.
  void swap_earlier(ContinuationGroups& other) { std::swap(earlier_, other.earlier_); }

  size_t memory_bytes() const { return found_.memory_bytes() + earlier_.memory_bytes() + next_.memory_bytes(); }

 private:
  static constexpr uint32_t kEarlier = 0x80000000u;
  bool is_kept() const { return context_ && context_->light_groups > 0; }

  const PathContext* context_ = nullptr;
  GroupTable found_, earlier_, next_;
};

}  // namespace cistern
