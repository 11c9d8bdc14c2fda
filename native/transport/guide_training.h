#pragma once

#include "grid/cell_training.h"
#include "transport/guide_table.h"

namespace cistern {

inline GuideStatistics to_statistics(const GuideRecord& record) {
  const double light = record.light;
  return {record.cell, record.bin, light, light * light};
}

using GuideTraining = CellTraining<GuideRecord, GuideTable, GuideStatistics, size_t{1} << 22>;

}  // namespace cistern
