#include "transport/guide_training.h"

namespace cistern {

void GuideTraining::add(std::span<const GuideRecord> records) {
  const std::lock_guard lock(mutex_);
  pending_.insert(pending_.end(), records.begin(), records.end());
}

GuideTable GuideTraining::learn() {
  statistics_.reserve(statistics_.size() + pending_.size());
  for (const GuideRecord& record : pending_) {
    const double light = record.light;
    statistics_.push_back({record.cell, record.bin, light, light * light});
  }
  pending_ = {};
  sum_equal_bins(statistics_);
  return GuideTable(statistics_);
}

void GuideTraining::clear() {
  const std::lock_guard lock(mutex_);
  pending_ = {};
  statistics_ = {};
}

}  // namespace cistern
