#pragma once

#include <array>
#include <vector>

#include "transport/light_by_group.h"
#include "transport/visible_points.h"

namespace cistern {

/// A kind of scattering, where PathContext::tells_kinds: one RayVisibility bit. Densities of what was found are then
/// those of lobes of this kind, and what others make of it is their share of the kind in BSDF sampling, or with
/// PathContext::divides_kinds what their lobes of this kind scatter. 0: any kind.
using FoundKind = uint8_t;
/// What rays of that kind find of an even part: its lobes scatter diffusely.
inline Rgb even_part(Rgb even_cos, FoundKind kind) {
  return (kind & (kVisibleToGlossy | kVisibleToTransmission)) != 0 ? Rgb() : even_cos;
}

/// Light that arrives from one direction, over the density with which it was found: what a surface makes of it is
/// f cos(theta) times `radiance`. Black: nothing.
struct IncidentRadiance {
  Vec3 wi;
  Rgb radiance;
  Rgb f_cos;     // of the sample point's rough lobes, towards the vertex that found it; times the share of the kind
  Rgb even_cos;  // of its even part, see BsdfEvaluation; of what that kind finds of it
  FoundKind kind = 0;
};

/// The path that found a sample: its pixel in the full frame, and its frame. With the seed and the camera of that frame
/// it can be traced again. That finds no light groups: where paths split those, ContinuationGroups has its own numbers
/// of samples in `pixel`, for which path samples have no room to spare.
struct PathOrigin {
  uint32_t pixel = 0, frame = 0;
};

/// What a path found beyond its sample point, kept as it arrived there: so the radiance that the sample point's rough
/// lobes send can be evaluated towards any receiver. What the sample point itself emits is direct light and not here.
struct PathSample {
  VisiblePoint point;  // the sample point; its wo looks at the vertex that found it
  IncidentRadiance light, continuation;
  uint8_t light_visibility = kVisibleToAll;  // RayVisibility bits of `light`
  FoundKind kind = 0;                        // of the ray that arrived at the sample point
  LightGroup light_group = kNoLightGroup;    // of `light`
  PathOrigin origin;

  /// Radiance sent to the vertex that found the sample point.
  Rgb radiance_as_found() const { return light.f_cos * light.radiance + continuation.f_cos * continuation.radiance; }
  /// Of that, what any vertex would have found in the mean; `even_transmittance` towards it is to be multiplied in.
  Rgb even_radiance() const { return light.even_cos * light.radiance + continuation.even_cos * continuation.radiance; }
};

/// A rough vertex of a path and the sample point that its BSDF sample found. `W` is one over the density of the
/// sample point per surface area, roulette and passing through transparent surfaces counted in: 0 where there is none.
/// Transmittance on the way is not in W.
struct PathLink {
  VisiblePoint from;
  PathSample to;
  float W = 0.0f;
  /// What `from` makes of the radiance that `to` sends to it, transmittance counted in: their product is what this path
  /// found, as long as `to` is what it left.
  Rgb response;
  Rgb even_response;  // the same of the even part of `from`
};

inline constexpr int kMaxPathLinks = 2;

/// A vertex beyond the visible point whose direct light by rough lobes is left to the caller, and what that light
/// (f cos L / p) must be multiplied by for each sum it belongs to. At the sample point of a link the light is that
/// link's `light` instead of its continuation.
struct LightVertex {
  VisiblePoint point;
  Rgb to_direct, to_indirect;
  std::array<Rgb, kMaxPathLinks> to_continuation;
  int sample_point_of = -1;  // index of a link
};

/// The same two by the kind of the path's first scattering. Not of vertices that are the first themselves.
struct LightVertexKinds {
  KindColors to_direct, to_indirect;
};

/// What a path leaves to be estimated by others; see trace_path.
struct PathCapture {
  // Asked for.
  float direct_candidates = 0.0f;     // light samples taken at the visible point by the caller; 0: none, the path does
  float secondary_candidates = 0.0f;  // the same at all later rough vertices
  int link_count = 0;                 // 1: indirect light of the visible point is left; 2: the next vertex's copied too
  bool leaves_deep_link = false;      // the second link's light is no longer in the first's either: left, not copied
  RoughSampling rough_sampling = RoughSampling::BSDF;  // at the visible point
  /// Russian roulette, played by the caller: whether the path goes on from the first link's sample point, and the
  /// probability of that.
  bool goes_on = true;
  float going_on_probability = 1.0f;

  // Captured.
  VisiblePoint visible;
  std::array<PathLink, kMaxPathLinks> links;
  std::vector<LightVertex> vertices;

  // Captured with PathContext::splits_kinds.
  /// Of the way to the visible point, where that is not the first vertex: which share of what is seen there is of which
  /// kind.
  KindColors seen_shares;
  KindColors link_shares;  // the same of the first link's `response`, at visible points that are the first vertex
  std::vector<LightVertexKinds> vertex_kinds;  // beside `vertices`

  /// Captured with PathContext::light_groups: radiance of the links' continuations by group.
  std::array<LightByGroup, kMaxPathLinks> continuation_by_group;

  void clear() {
    visible.exists = false;
    for (PathLink& link : links) {
      link.W = 0.0f;
      link.from.exists = false;
    }
    vertices.clear();
    vertex_kinds.clear();
  }
};

}  // namespace cistern
