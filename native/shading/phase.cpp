#include "shading/phase.h"

namespace cistern {

float evaluate_phase(const Medium& medium, float cosine) {
  float sum = 0.0f;
  for (int i = 0; i < medium.lobe_count; ++i) {
    const PhaseLobe& lobe = medium.lobes[static_cast<size_t>(i)];
    sum += average(lobe.scattering) * lobe.phase.density(cosine);
  }
  return sum / average(medium.scattering);
}

PhaseSample sample_phase(const Medium& medium, Vec3 direction, float u_lobe, Vec2 u_direction) {
  float left = u_lobe * average(medium.scattering);
  int chosen = 0;
  while (chosen + 1 < medium.lobe_count) {
    const float width = average(medium.lobes[static_cast<size_t>(chosen)].scattering);
    if (left < width) break;
    left -= width;
    ++chosen;
  }
  PhaseSample sample;
  const PhaseFunction& phase = medium.lobes[static_cast<size_t>(chosen)].phase;
  sample.direction = deflected(direction, phase.sample_cosine(u_direction.x), u_direction.y);
  sample.pdf = evaluate_phase(medium, dot(direction, sample.direction));
  return sample;
}

}  // namespace cistern
