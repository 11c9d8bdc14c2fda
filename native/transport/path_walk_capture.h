#pragma once

#include <algorithm>

#include "transport/path_walk.h"

// What a walk leaves to others: the captured vertices and links. Included by path_walk.h.

namespace cistern {

template <class Kind>
inline VertexUse Walk<Kind>::vertex_use() const {
  if constexpr (Kind::captures) {
    return capture_.vertex;
  } else {
    return {};
  }
}

template <class Kind>
inline VisiblePoint Walk<Kind>::captured_point(const SurfacePoint& point, const Bsdf& bsdf) const {
  VisiblePoint captured = make_visible_point(context_.scene, point, bsdf);
  captured.is_caught = record_.caught > 0.0f;
  captured.state = state_;
  captured.scattered = scattered_state(point, bsdf);
  captured.throughput = throughput_.smooth;
  captured.distance = path_length_;
  return captured;
}

template <class Kind>
inline bool Walk<Kind>::can_be_visible_point(const Bsdf& bsdf) const {
  return !capture_.out->visible.exists && !is_black(throughput_.smooth) && has_rough_lobe(bsdf);
}

template <class Kind>
inline bool Walk<Kind>::may_meet_splats(int link, const SurfacePoint& point) const {
  if (!context_.accel.has_splats()) return false;
  const SurfacePoint from = surface_point(capture_.out->links[static_cast<size_t>(link)].from);
  IncidentLight way;
  way.distance = length(point.position - from.position);
  way.wi = (point.position - from.position) / way.distance;
  way.normal = point.ng;
  way.clearance = point.clearance;
  return cistern::may_meet_splats(context_, from, way);
}

template <class Kind>
inline void Walk<Kind>::capture_vertex(const SurfacePoint& point, const Bsdf& bsdf) {
  std::optional<int> link = std::exchange(capture_.open_link, std::nullopt);
  if (!has_rough_lobe(bsdf)) return;
  // Others would not find here what this path does: its light stays with it.
  // Nor do rays to a place on a splat meet it there, or what passes by splats always arrive.
  if (context_.scene.materials[static_cast<size_t>(point.material)]->lobes_depend_on_view || point.is_splat ||
      (link && may_meet_splats(*link, point)))
    link.reset();
  const bool is_visible_point = can_be_visible_point(bsdf);
  const bool gives_light = capture_.out->visible.exists && capture_.out->secondary_candidates > 0.0f;
  if (!is_visible_point && !gives_light && !link) return;
  const VisiblePoint captured = captured_point(point, bsdf);
  if (is_visible_point) {
    capture_.out->visible = captured;
    if constexpr (Kind::splits) {
      if (context_.splits_kinds) capture_.out->seen_shares = kind_shares_of_seen();
    }
    capture_.vertex.light_candidates = capture_.out->direct_candidates;
    if (capture_.out->link_count > 0) start_link(0, captured);
  }
  if (link) capture_sample_point(*link, captured);
  if (gives_light) capture_light_vertex(captured);
}

template <class Kind>
inline void Walk<Kind>::start_link(int link, const VisiblePoint& from) {
  capture_.out->links[static_cast<size_t>(link)].from = from;
  capture_.vertex.starts = link;
  throughput_.forget_color();
}

template <class Kind>
inline void Walk<Kind>::capture_sample_point(int index, const VisiblePoint& captured) {
  PathLink& link = capture_.out->links[static_cast<size_t>(index)];
  const float cosine = std::abs(dot(captured.ng, captured.receiver.wo));
  const float pdf_area = capture_.link_probability * cosine / sqr(state_.ray_length);
  if (!(pdf_area > 0.0f)) return;
  link.W = 1.0f / pdf_area;
  link.response = capture_.response;
  link.even_response = capture_.even_response;
  link.to.point = captured;
  link.to.light = link.to.continuation = {};
  link.to.light_visibility = kVisibleToAll;
  link.to.light_group = kNoLightGroup;
  if constexpr (Kind::splits) std::ranges::fill(capture_.out->continuation_by_group[static_cast<size_t>(index)], Rgb());
  link.to.kind = found_kind(state_.ray_kind);
  link.to.origin = {};
  capture_.vertex.sample_point_of = index;
  throughput_.forget_color();
  if (index + 1 < capture_.out->link_count) start_link(index + 1, captured);
}

template <class Kind>
inline FoundKind Walk<Kind>::found_kind(uint8_t kind) const {
  return context_.tells_kinds ? kind : FoundKind{0};
}

template <class Kind>
inline void Walk<Kind>::capture_light_vertex(const VisiblePoint& captured) {
  capture_.vertex.light_candidates = capture_.out->secondary_candidates;
  LightVertex vertex{
      captured, throughput_.smooth, {}, throughput_.continuation, capture_.vertex.sample_point_of.value_or(-1)};
  if (capture_.vertex.sample_point_of != 0) vertex.to_indirect = throughput_.direct + throughput_.indirect;
  if (is_left_deep()) vertex.to_continuation[0] = Rgb();
  capture_.out->vertices.push_back(vertex);
  if constexpr (Kind::splits) {
    if (context_.splits_kinds) capture_.out->vertex_kinds.push_back(kinds_of_vertex());
  }
}

template <class Kind>
inline bool Walk<Kind>::is_left_deep() const {
  return capture_.vertex.sample_point_of == 1 && capture_.out->leaves_deep_link;
}

template <class Kind>
inline void Walk<Kind>::add_to_continuations(Rgb by_rough_lobes, Rgb other, LightGroup group) {
  if constexpr (Kind::captures) {
    const auto add = [&](size_t i, Rgb light) {
      capture_.out->links[i].to.continuation.radiance += light;
      if constexpr (Kind::splits) add_to_group(capture_.out->continuation_by_group[i], group, light);
    };
    add(0, throughput_.continuation[0] * (is_left_deep() ? other : by_rough_lobes + other));
    add(1, throughput_.continuation[1] * (by_rough_lobes + other));
  }
}

}  // namespace cistern
