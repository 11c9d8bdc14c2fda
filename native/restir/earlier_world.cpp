#include "restir/earlier_world.h"

namespace cistern {

float domain_target(const PathContext& present, float candidates, const LightDomain& domain,
                    const LightSample& sample) {
  if (!domain.world) return light_target(present, candidates, *domain.point, sample);
  const std::optional<LightSample> then = domain.world->emitters.to_earlier(sample);
  return then ? light_target(domain.world->paths, candidates, *domain.point, *then) : 0.0f;
}

bool is_visible_in(const PathContext& present, const LightDomain& domain, const LightSample& sample) {
  if (!domain.world) return is_visible(present, *domain.point, sample);
  const std::optional<LightSample> then = domain.world->emitters.to_earlier(sample);
  return then && is_visible(domain.world->paths, *domain.point, *then);
}

LightReservoir to_present(const EarlierWorld* world, LightReservoir reservoir) {
  if (!world || reservoir.W == 0.0f) return reservoir;
  const std::optional<LightSample> now = world->emitters.to_later(reservoir.sample);
  if (!now) return {.c = reservoir.c};
  reservoir.sample = *now;
  return reservoir;
}

}  // namespace cistern
