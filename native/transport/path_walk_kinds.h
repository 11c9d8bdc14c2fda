#pragma once

#include "transport/path_walk.h"

// Light of a walk by the kind of its first scattering. Included by path_walk.h.
//
// The throughput is kept once more for each kind: at the first vertex each part of it (what was scattered by smooth
// lobes, and by rough ones) is divided as f is in the direction taken, and from then on all are scattered alike. So
// each contribution of the path is divided as it is added, and clamped by the factor of the whole. Never by a share of
// sums: what is handed on to others takes away from some parts and not from others. Nothing here is random.
//
// Of shadow catchers, and of what is met beyond, there is nothing by kinds, as in Cycles: neither is in Combined.

namespace cistern {

template <class Kind>
inline void Walk<Kind>::add_color(const Bsdf& bsdf) {
  if (!context_.splits_kinds || !sees_film_ || last_segment_ || !bsdf.scatters()) return;
  light_by_kind().color += albedo_by_kind(bsdf) * throughput_.total();
}

template <class Kind>
inline void Walk<Kind>::split_met_light(Rgb radiance, SourceKind source) {
  if (!context_.splits_kinds || record_.caught > 0.0f) return;
  LightByKind& sum = light_by_kind();
  if (is_unscattered()) {
    (source == SourceKind::ENVIRONMENT ? sum.environment : sum.emission) += tinted(throughput_.smooth * radiance);
    return;
  }
  const float limit = context_.limits.clamp_after(state_.depth);
  const Rgb light = tinted(radiance);
  const Rgb seen = light * clamp_factor(throughput_.smooth * radiance, limit);
  const Rgb direct = light * clamp_factor(throughput_.direct * radiance, limit);
  const Rgb indirect = light * clamp_factor(throughput_.indirect * radiance, limit);
  auto& of_kinds = state_.depth == 1 ? sum.direct : sum.indirect;
  for (size_t kind = 0; kind < kLightKinds; ++kind) {
    const Throughput& part = kinds_.throughput[kind];
    of_kinds[kind] += part.smooth * seen + part.direct * direct + part.indirect * indirect;
  }
}

template <class Kind>
inline void Walk<Kind>::split_environment_behind_film() {
  const bool is_seen = (context_.scene.environment.visibility & state_.ray_kind) != 0;
  if (!context_.splits_kinds || !is_seen || !is_unscattered() || record_.caught > 0.0f) return;
  light_by_kind().environment +=
      tinted(throughput_.smooth * evaluate_environment(context_.scene, ray_.direction, state_));
}

template <class Kind>
inline void Walk<Kind>::split_reflected_light(const BsdfKinds& f, Rgb rough_cos, Rgb smooth_cos, Rgb radiance,
                                              int faces) {
  if (record_.caught > 0.0f) return;
  if (!is_unscattered()) return split_later_light(rough_cos, smooth_cos, radiance, faces);
  const auto add = [&](const KindColors& kinds, Rgb f_cos) {
    const Rgb light = throughput_.smooth * f_cos * radiance;
    const KindColors parts = shares_of(kinds) * tinted(light * clamp_factor(light, clamp_of_reflected(faces)));
    faces > 0 ? light_by_kind().add_indirect(parts) : light_by_kind().add_direct(parts);
  };
  add(f.rough, rough_cos);
  add(f.smooth, smooth_cos);
}

template <class Kind>
inline void Walk<Kind>::split_scattered_light(Rgb phase_cos, Rgb radiance) {
  if (!context_.splits_kinds || record_.caught > 0.0f) return;
  if (!is_unscattered()) return split_later_light(phase_cos, {}, radiance);
  const Rgb light = throughput_.smooth * phase_cos * radiance;
  light_by_kind().direct[kVolumeLight] += tinted(light * clamp_factor(light, clamp_of_reflected()));
}

template <class Kind>
inline void Walk<Kind>::split_later_light(Rgb rough_cos, Rgb smooth_cos, Rgb radiance, int faces) {
  const float limit = clamp_of_reflected(faces);
  const Rgb indirect_cos = vertex_use().sample_point_of == 0 ? smooth_cos : rough_cos + smooth_cos;
  const Rgb smooth = smooth_cos * radiance, rough = rough_cos * radiance, reflected = indirect_cos * radiance;
  const float of_smooth = clamp_factor(throughput_.smooth * smooth, limit);
  const Rgb once = throughput_.smooth * rough, again = (throughput_.direct + throughput_.indirect) * reflected;
  const float of_indirect = clamp_factor(faces > 0 ? once + again : again, limit);
  const float of_rough = faces > 0 ? of_indirect : clamp_factor(once, limit);
  for (size_t kind = 0; kind < kLightKinds; ++kind) {
    const Throughput& part = kinds_.throughput[kind];
    light_by_kind().indirect[kind] += tinted(part.smooth * (smooth * of_smooth + rough * of_rough) +
                                             (part.direct + part.indirect) * reflected * of_indirect);
  }
}

template <class Kind>
inline void Walk<Kind>::scatter_kinds(const Bsdf& bsdf, const BsdfSample& sample, Rgb rough_weight, Rgb smooth_weight) {
  if (!context_.splits_kinds) return;
  if (!is_unscattered()) return scatter_kinds(rough_weight, smooth_weight);
  BsdfKinds shares;
  if (sample.is_delta) {
    shares.smooth = all_of(sample.kind == ScatterKind::TRANSMISSION ? PassKind::TRANSMISSION : PassKind::GLOSSY);
  } else {
    const BsdfKinds f =
        evaluate_kinds(bsdf, sample.wi, context_.divides_kinds ? ray_kind(sample.kind) : uint8_t{kVisibleToAll});
    shares = {shares_of(f.rough), shares_of(f.smooth)};
  }
  for (size_t kind = 0; kind < kPassKinds; ++kind)
    kinds_.throughput[kind] = {throughput_.smooth * smooth_weight * shares.smooth[kind],
                               throughput_.smooth * rough_weight * shares.rough[kind],
                               {}};
  if constexpr (Kind::captures) {
    if (capture_.vertex.starts == 0) capture_.out->link_shares = shares.rough;
  }
}

template <class Kind>
inline void Walk<Kind>::scatter_kinds(Rgb rough_weight, Rgb smooth_weight) {
  if (!context_.splits_kinds) return;
  const bool is_captured = vertex_use().sample_point_of == 0;
  for (Throughput& part : kinds_.throughput)
    is_captured ? part.scatter_captured(rough_weight, smooth_weight) : part.scatter(rough_weight, smooth_weight);
}

template <class Kind>
inline void Walk<Kind>::scatter_kinds_in_medium() {
  if (!context_.splits_kinds) return;
  if (!is_unscattered()) return scatter_kinds(Rgb(1.0f), {});
  kinds_.throughput[kVolumeLight] = {{}, throughput_.smooth, {}};
}

template <class Kind>
inline KindColors Walk<Kind>::kind_shares_of_seen() const {
  KindColors seen;
  for (size_t kind = 0; kind < kPassKinds; ++kind) seen[kind] = kinds_.throughput[kind].smooth;
  return shares_of(seen);
}

template <class Kind>
inline LightVertexKinds Walk<Kind>::kinds_of_vertex() const {
  LightVertexKinds kinds;
  for (size_t kind = 0; kind < kPassKinds; ++kind) {
    const Throughput& part = kinds_.throughput[kind];
    kinds.to_direct[kind] = part.smooth;
    if (vertex_use().sample_point_of != 0) kinds.to_indirect[kind] = part.direct + part.indirect;
  }
  return kinds;
}

}  // namespace cistern
