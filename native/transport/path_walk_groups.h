#pragma once

#include "transport/path_walk.h"

// Light of a walk by the group of its emitter. Included by path_walk.h.
//
// Each contribution is of one emitter: what was added to the record goes to that one's group as well, with whatever
// clamping made of it. So nothing is estimated twice, and nothing here is random.

namespace cistern {

template <class Kind>
inline void Walk<Kind>::start_parts() {
  scratch_.light_by_kind = {};
  scratch_.light_by_group.assign(context_.light_groups, Rgb());
  if constexpr (Kind::captures) {
    for (LightByGroup& light : capture_.out->continuation_by_group) light.assign(context_.light_groups, Rgb());
  }
}

template <class Kind>
inline LightSource Walk<Kind>::source_of(uint32_t emitter) const {
  const bool is_environment = emitter == context_.lights.environment_emitter();
  LightSource source{is_environment ? SourceKind::ENVIRONMENT : SourceKind::SURFACE};
  if constexpr (Kind::splits) {
    if (context_.light_groups > 0) source.group = light_group_of(context_, emitter);
  }
  return source;
}

template <class Kind>
inline LightSource Walk<Kind>::source_of(const Instance& instance) const {
  return {SourceKind::SURFACE, Kind::splits ? instance.light_group : kNoLightGroup};
}

template <class Kind>
inline void Walk<Kind>::add_to_group_of(const LightSource& source, Rgb light) {
  if (record_.caught == 0.0f) add_to_group(scratch_.light_by_group, source.group, light);
}

template <class Kind>
inline void Walk<Kind>::add_environment_behind_film_to_group() {
  const Environment& environment = context_.scene.environment;
  if (!context_.groups_behind_film || (environment.visibility & state_.ray_kind) == 0) return;
  const std::optional<uint32_t> emitter = context_.lights.environment_emitter();
  const float pdf = emitter ? sought_environment_pdf() : 0.0f;
  const Rgb radiance = evaluate_environment(context_.scene, ray_.direction, state_) * emitter_weight(emitter, pdf);
  add_to_group_of({SourceKind::ENVIRONMENT, environment.light_group}, tinted(throughput_.total() * radiance));
}

}  // namespace cistern
