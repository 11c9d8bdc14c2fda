#pragma once

#include <optional>

#include "lights/learned_lights.h"
#include "transport/light_by_kind.h"
#include "transport/media.h"
#include "transport/path_capture.h"
#include "transport/path_context.h"
#include "transport/path_throughput.h"

namespace cistern {

/// Surfaces more transparent than this do not count as the first one seen: Cycles' default pass_alpha_threshold.
inline constexpr float kMostTransparency = 0.5f;

/// Emitting surfaces past blockers that a ray meets at most; as Cycles.
inline constexpr int kMostEmittersAhead = 1024;

enum class SourceKind : uint8_t { SURFACE, ENVIRONMENT };

/// Where light comes from; its group where walks split light.
struct LightSource {
  SourceKind kind = SourceKind::SURFACE;
  LightGroup group = kNoLightGroup;
};

/// What walks know of where light is: nothing, where caustics are, or also what earlier paths found.
enum class Knowledge : uint8_t { NONE, CAUSTICS, LEARNED };

/// What a walk does. Each is compiled by itself, so that the reference estimator pays for nothing but its own.
template <bool kCaptures, Knowledge kKnowledge, bool kHasMedia = false, bool kSplits = false>
struct WalkKind {
  // NOLINTBEGIN(readability-identifier-naming): traits
  static constexpr Knowledge knowledge = kKnowledge;
  static constexpr bool captures = kCaptures;                       // leaves something to others
  static constexpr bool learns = kKnowledge == Knowledge::LEARNED;  // lights or directions, or leaves records for it
  static constexpr bool is_guided = kKnowledge != Knowledge::NONE;  // chooses directions by what it knows
  static constexpr bool has_media = kHasMedia;
  static constexpr bool splits = kSplits;  // light in parts as well: PathContext::splits
  // NOLINTEND(readability-identifier-naming)
};
using ReferenceWalk = WalkKind<false, Knowledge::NONE>;
using CausticWalk = WalkKind<false, Knowledge::CAUSTICS>;
using LearnedWalk = WalkKind<false, Knowledge::LEARNED>;
using CapturingWalk = WalkKind<true, Knowledge::NONE>;
using LearnedCapturingWalk = WalkKind<true, Knowledge::LEARNED>;
using MediaWalk = WalkKind<false, Knowledge::NONE, true>;
template <class Kind>
using SplitWalk = WalkKind<Kind::captures, Kind::knowledge, Kind::has_media, true>;

/// The last vertex that next-event estimation could have lit.
struct MisReceiver {
  Vec3 position, normal;
  int light_samples;  // by which it was lit
};

/// Faces of panes that have refracted a path since the vertex of its MisReceiver.
struct PaneTrail {
  int faces = 0;
  PathState vertex;  // state there
  Ray begin;         // the ray that left it
};

/// What the current vertex of a walk is to others.
struct VertexUse {
  float light_candidates = 0.0f;       // above 0: direct light by its rough lobes is left to the caller
  std::optional<int> sample_point_of;  // index of a link
  std::optional<int> starts;           // index of the link that leaves it
};

/// How far a walk has come with what it captures.
struct CaptureState {
  PathCapture* out = nullptr;
  VertexUse vertex;
  std::optional<int> open_link;      // its sample point is the next vertex
  float link_probability = 0.0f;     // of the open link's direction (per solid angle), and of reaching the sample point
  Rgb response, even_response;       // as PathLink has them, so far
  float mis_candidates = 0.0f;       // VertexUse::light_candidates of the last vertex that light samples could have lit
  bool only_deep_link_next = false;  // a bounce limit is reached for all but this link, which may bounce once more
};

/// Density below which a direction is not one of narrow lobes, per solid angle.
inline constexpr float kWidePdf = 1.0f;

/// How a walk chooses lights, and what there is to learn from the light it finds.
struct LearningState {
  double gathered = 0.0;  // magnitude of all that the path adds up to, including what is left to others
  bool met_visible_point = false;
  std::optional<LearnedLights::Chooser> at_vertex;  // none: the light set chooses
  std::optional<LearnedLights::Chooser> of_ray;     // of the last vertex that light samples could have lit
};

/// How far guides led a walk.
struct GuidedState {
  float guide_gain = 1.0f;    // product of BsdfSample::guide_gain: where guides find more, less throughput is enough
  float caustic_gain = 1.0f;  // the same of a guide towards caustics, until the path is scattered widely

  float gain() const { return guide_gain * caustic_gain; }
  void count_gain(const Bsdf& bsdf, const BsdfSample& sample) {
    // A path that was guided towards a caustic and has met something else is not worth what one is that found it.
    if (!sample.is_delta && sample.pdf < kWidePdf * sample.guide_gain) caustic_gain = 1.0f;
    (bsdf.guide.caustics ? caustic_gain : guide_gain) *= sample.guide_gain;
  }
};

/// The media of a walk, and the part of a ray through them that it follows.
struct MediaState {
  MediaStack stack;
  BoundaryTrail trail;
  SegmentMedia segment;
  float begin = 0.0f, length = 0.0f;  // of the segment, along the ray from its origin
  int volume_depth = 0;               // how often media have scattered the path
  int boundaries = 0;                 // that were crossed
  bool has_flown = false;             // a free flight was sampled
  Rgb clear{1.0f};                    // of SeenSurface::clear the channels
};
struct NoMedia {};
struct NoLearning {};
struct NoGuides {};

/// The throughput of a walk by the kind of its first scattering, black before that.
struct KindState {
  std::array<Throughput, kLightKinds> throughput;
  KindState() { throughput.fill({Rgb(), Rgb(), Rgb()}); }
};
struct NoKinds {};

inline bool has_rough_lobe(const Bsdf& bsdf) {
  for (int i = 0; i < bsdf.count; ++i)
    if (!is_smooth(bsdf.lobes[i])) return true;
  return false;
}

inline bool has_smooth_lobe(const Bsdf& bsdf) {
  for (int i = 0; i < bsdf.count; ++i)
    if (is_smooth(bsdf.lobes[i])) return true;
  return false;
}

inline void count_scattering(PathState& state, ScatterKind kind) {
  ++state.depth;
  state.ray_kind = ray_kind(kind);
  switch (kind) {
    case ScatterKind::DIFFUSE:
      ++state.diffuse_depth;
      break;
    case ScatterKind::GLOSSY:
      ++state.glossy_depth;
      break;
    case ScatterKind::TRANSMISSION:
    case ScatterKind::TRANSLUCENT:
      ++state.transmission_depth;
      break;
  }
}

inline bool exceeds_limits(const PathState& state, const PathLimits& limits) {
  return state.depth > limits.max_bounces || state.diffuse_depth > limits.max_diffuse_bounces ||
         state.glossy_depth > limits.max_glossy_bounces || state.transmission_depth > limits.max_transmission_bounces;
}

}  // namespace cistern
