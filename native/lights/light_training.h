#pragma once

#include "grid/cell_training.h"
#include "lights/learned_light_table.h"
#include "lights/light_record.h"

namespace cistern {

inline ClusterStatistics to_statistics(const LightRecord& record) {
  const double visible = record.visible;
  return {record.cell,   record.cluster,       visible, visible * visible, record.unshadowed,
          record.square, record.square_without};
}

using LightTraining = CellTraining<LightRecord, LearnedLightTable, ClusterStatistics, size_t{1} << 20>;

/// By how much the mean square of light samples is smaller than by the light set's choice; 1 without any samples.
inline double gain(std::span<const ClusterStatistics> learned_from) {
  double with = 0.0, without = 0.0;
  for (const ClusterStatistics& s : learned_from) {
    with += s.squares;
    without += s.squares_without;
  }
  return with > 0.0 ? without / with : 1.0;
}

}  // namespace cistern
