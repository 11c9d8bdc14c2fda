#include "transport/guide_lesson.h"

#include "transport/path_guide.h"

namespace cistern {

void remember_direction(const PathContext& context, const SurfacePoint& point, const Bsdf& bsdf,
                        const BsdfSample& sample, Rgb throughput, double gathered, PathScratch& scratch) {
  const float rough = luminance(sample.rough_weight);
  const float to_camera = luminance(throughput) * bsdf.total_sample_weight * luminance(sample.total_weight());
  if (sample.is_delta || !(rough > 0.0f) || !(to_camera > 0.0f) || !takes_guide(context, bsdf)) return;
  const NestedCellKey cell = context.guiding->guide->cell(point);
  if (cell == kNoNestedCell) return;
  scratch.taught_vertices.push_back({cell, DirectionHistogram::bin(sample.wi), rough / to_camera, gathered});
}

void teach_directions(double gathered, PathScratch& scratch) {
  for (const TaughtVertex& vertex : scratch.taught_vertices) {
    const float light = static_cast<float>(gathered - vertex.gathered_before) * vertex.scale;
    if (light > 0.0f && std::isfinite(light)) scratch.guide_records.push_back({vertex.cell, vertex.bin, light});
  }
  scratch.taught_vertices.clear();
}

}  // namespace cistern
