#include "restir/initial_light.h"

#include "base/sobol.h"

namespace cistern {

LightReservoir resample_light_candidates(const PathContext& context, const VisiblePoint& visible, int count, Rng& rng,
                                         uint64_t& non_finite) {
  ReservoirBuilder<LightSample> builder(non_finite);
  const Receiver& receiver = visible.receiver;
  const Vec2 u_start = rng.next_vec2();
  for (int i = 0; i < count; ++i) {
    const double u_choice = (i + rng.next_double()) / count;
    const Vec2 u_light = kronecker_point(u_start, i);
    const float u_keep = rng.next_float();
    const auto choice =
        context.lights.choose(receiver.position, receiver.side, u_choice, u_light, visible.scattered.light_set);
    if (!choice) continue;
    const float p_hat = light_target(context, static_cast<float>(count), visible, choice->sample);
    builder.add(choice->sample, p_hat / (double{choice->pmf} * count), p_hat, u_keep);
  }
  return builder.finish(1.0f);
}

}  // namespace cistern
