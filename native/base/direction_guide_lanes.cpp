#include "base/direction_guide_lanes.h"

namespace cistern {

void DirectionGuideLanes::set(size_t lane, const DirectionGuide& guide) {
  if (!guide) return;
  unguided_share_[lane] = 1.0f - guide.share();
  histograms_[lane] = guide.histogram;
  has_histograms_ |= guide.histogram != nullptr;
  if (!guide.caustics) return;
  const float share = guide.caustic_share();
  const std::span<const DirectionLobes::Lobe> lobes = guide.caustics->lobes();
  lobe_count_ = std::max(lobe_count_, lobes.size());
  for (size_t i = 0; i < lobes.size(); ++i) {
    lobes_[i].axis.set(lane, lobes[i].axis_at(guide.position));
    lobes_[i].over_square_radius[lane] = 1.0f / lobes[i].square_radius;
    lobes_[i].at_axis[lane] = share * lobes[i].at_axis;
  }
}

Lanes DirectionGuideLanes::pdf(const Lanes& unguided, const Vec3Lanes& w) const {
  Lanes sum = unguided * unguided_share_;
  for (const Lobes& lobes : std::span(lobes_).first(lobe_count_)) {
    const Vec3Lanes off = w - lobes.axis;
    const Lanes fall = 1.0f + dot(off, off) * lobes.over_square_radius;
    sum += lobes.at_axis / (fall * fall);
  }
  if (has_histograms_) {
    for (size_t lane = 0; lane < kLanes; ++lane)
      if (histograms_[lane] && unguided[lane] > 0.0f)
        sum[lane] += DirectionGuide::kHistogramShare * histograms_[lane]->pdf(w.at(lane));
  }
  return where_or_zero(unguided > 0.0f, sum);
}

}  // namespace cistern
