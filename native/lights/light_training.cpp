#include "lights/light_training.h"

namespace cistern {

void LightTraining::add(std::span<const LightRecord> records) {
  const std::lock_guard lock(mutex_);
  pending_.insert(pending_.end(), records.begin(), records.end());
}

LearnedLightTable LightTraining::learn() {
  statistics_.reserve(statistics_.size() + pending_.size());
  for (const LightRecord& record : pending_) {
    const double visible = record.visible;
    statistics_.push_back({record.cell, record.cluster, visible, visible * visible, record.unshadowed, record.square,
                           record.square_without});
  }
  pending_.clear();
  sum_equal_pairs(statistics_);
  return LearnedLightTable(statistics_);
}

double LightTraining::gain() const {
  double with = 0.0, without = 0.0;
  for (const ClusterStatistics& s : statistics_) {
    with += s.squares;
    without += s.squares_without;
  }
  return with > 0.0 ? without / with : 1.0;
}

}  // namespace cistern
