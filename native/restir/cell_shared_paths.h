#pragma once

#include <span>
#include <vector>

#include "grid/cell_groups.h"
#include "restir/path_target.h"
#include "shading/bsdf_lanes.h"

namespace cistern {

/// MIS weights within a group. BALANCE and TARGETS are unbiased; the second has confidence times target in place of
/// densities, for samples that were resampled over time. UNSHADOWED leaves visibility out of BALANCE, EQUAL is 1/n:
/// what FAST stands for, and what tests must tell from the others.
enum class PairWeights : uint8_t { BALANCE, TARGETS, UNSHADOWED, EQUAL };

/// Which vertices share with each other.
struct SharingCells {
  GroupRules groups;  // a size of 1: none share
  float pixels;       // edge of the cells that bound groups, in pixels; at least:
  float smallest;     // of the scene's diagonal
  friend bool operator==(const SharingCells&, const SharingCells&) = default;
};

/// What sharing in cells can be told, for each of the two vertices it happens at.
struct PathSharing {
  PairWeights weights = PairWeights::BALANCE;
  /// Whether visible points merge what they find with the history of their pixel before they share it; what they are
  /// handed then does not become history. Better single frames, which are no longer independent.
  bool temporal_reuse = true;
  /// Whether only the first frame of a render does so and is remembered: those after it are independent, cost less, and
  /// their mean has no error in common. Not where light is resampled by reservoirs, which need frame after frame.
  bool first_frame_history = false;
  SharingCells visible{.groups = {.size = 64, .interleaved = true}, .pixels = 96.0f, .smallest = 1e-3f};
  SharingCells deep{.groups = {.size = 256}, .pixels = 96.0f, .smallest = 1.0f / 64.0f};  // next vertices
  /// Whether a denoiser follows. Visible points then share in smaller groups, whose noise has less in common, and on
  /// trial only where light is rare: of even noise denoisers leave as little.
  bool for_denoiser = false;
  /// Whether a trial may find that sharing is not worth its time here: before the first frame, or of frames without
  /// history that follow one with it, soon after that.
  bool on_trial = false;
  friend bool operator==(const PathSharing&, const PathSharing&) = default;
};

/// Light that the rough lobes of a vertex reflect of path samples.
struct ReflectedPaths {
  Rgb sum;
  Rgb even;  // what the even part of its BSDF reflects
  Rgb own;   // what the vertex's own sample would give it alone
};

/// The first two by light group; empty where paths split none.
struct ReflectedGroups {
  std::span<Rgb> sum, even;
};

/// All-pairs sharing of path samples in the groups of cells: our own estimator.
///
/// Each vertex of a group found one sample point y by BSDF sampling (or none), with density p_i(y) per area. All of
/// them may be handed to all: receiver j takes the sum over i of m_i(y_i) F_j(y_i) W_i, by the balance heuristic m_i(y)
/// = p_i(y) V_i(y) / sum_k p_k(y) V_k(y) [Veach 1997, Eq. 9.8]. Shading needs the visibility of every pair anyway, so
/// exact weights cost nothing more. Groups are made without looking at the samples, and nothing carries over from frame
/// to frame: every frame is unbiased and independent of all others.
///
/// Only the even part of a sample point is handed on (see BsdfEvaluation), as light that anybody at y would have found
/// in the mean, and so would have sent. What y sent to its finder beyond that, as highlights, stays with the finder: it
/// was looked for from there, and seen from elsewhere nearly all of it would come by rare samples. So no material is
/// evaluated again at sample points, and both parts add up to all light whatever the even part is taken to be.
/// Points whose lobes depend on the view are no sample points: see MaterialProgram::lobes_depend_on_view. And vertices
/// share a sample only if their paths would have passed as many transparent surfaces on reaching it, since what may
/// still be passed beyond is part of what it received.
///
/// What a sample costs is a ray to each vertex, and most samples carry little of a group's light. Russian roulette
/// among them (Group::handed_on) changes no expectation, since its probabilities know nothing of the number that
/// decides. By systematic sampling [Madow 1949] as many go on as are expected, but for one.
///
/// For Lambertian vertices of equal albedo the sum over a group is what it would be without sharing, but for roulette:
/// sharing moves light between pixels. At the visible point members of a group lie among those of others, so that noise
/// is less and still fine; the next vertex belongs to another part of the picture for each of a group anyway.
class CellSharedPaths {
 public:
  explicit CellSharedPaths(const PathContext& context) : context_(context) {}

  /// Vertices that share, beside each other: what each found, divided, and with which confidence; what it reflects.
  struct Group {
    PairWeights weights = PairWeights::BALANCE;
    bool is_fresh = true;  // each link is as its path left it, and no history is in it
    /// If more fresh samples than so many send light, so many of them are expected to be handed on: those with most
    /// light certainly, the others by chance in proportion to it, and then with as much more.
    size_t handed_on = std::numeric_limits<size_t>::max();
    double u_choice = 0.0;  // for that
    std::vector<const PathLink*> links;
    std::vector<float> confidences;
    std::vector<ReflectedPaths*> reflected;
    std::vector<KindColors*> reflected_by_kind;  // of `sum`; empty where nobody asks
    // By light group, where paths split them: what continuations of the links' divided samples are, and `reflected`.
    std::vector<std::span<const Rgb>> continuations;
    std::vector<ReflectedGroups> reflected_groups;

    size_t size() const { return links.size(); }
  };

  /// Memory of one thread.
  struct Scratch {
    /// Vertices of a group, several at a time.
    struct Vertices {
      SurfaceLanes points;
      RgbLanes diffuse;    // of plain ones; black for those that are evaluated
      RgbLanes sum, even;  // what they reflect of what they have been handed
    };
    /// What these make of one sample.
    struct Pairs {
      Vec3Lanes wi;              // towards the sample point
      Lanes geometry = 0.0f;     // as PathConnection has it; 0 where that is none
      RgbLanes f_cos, even_cos;  // of the kind of scattering that found the sample
      Lanes pdf = 0.0f;          // of BSDF sampling, per solid angle
      Lanes density = 0.0f;      // of finding the sample point from there, per area; or what stands for it. 0: never
      RgbLanes transmittance;
    };
    std::vector<float> factors;  // by sample of the group, for its light; 0: it is handed to nobody
    size_t handed_on = 0;        // how many are not 0
    std::vector<Vertices> vertices;
    std::vector<BsdfLanes> layered;           // beside them, of those whose BSDF it takes; empty where there are none
    std::vector<DirectionGuideLanes> guides;  // of these and of plain ones; empty where nothing is guided
    std::vector<Pairs> pairs;                 // beside them, of one sample
    std::vector<SurfacePoint> points;         // by vertex of the group
    std::vector<Bsdf> bsdfs;                  // beside them; empty where the vertex alone says how it reflects
    std::vector<uint32_t> others;             // vertices that are neither plain nor layered
    size_t holders = 0;                       // vertices that may have that sample
    bool bounces_agree = true;                // between all vertices of the group, as they nearly always do
  };

  /// Adds what a vertex reflects of a fresh sample of its own that is handed to nobody. `deep`: what the sample point
  /// reflects of other samples.
  static void keep(const PathLink& link, const ReflectedPaths& deep, ReflectedPaths& reflected);

  /// Keeps of a fresh sample only what is for all, and adds the rest to what its finder reflects.
  static void divide(PathLink& link, const ReflectedPaths& deep, ReflectedPaths& reflected);

  /// The same by light group, to be called before: `continuation` of the sample, which becomes that of what is left.
  static void keep_groups(const PathLink& link, std::span<const Rgb> continuation, const ReflectedGroups& deep,
                          const ReflectedGroups& reflected);
  static void divide_groups(const PathLink& link, std::span<Rgb> continuation, const ReflectedGroups& deep,
                            const ReflectedGroups& reflected);

  /// Adds what each vertex of a group reflects of divided samples. Returns how many of them were handed to all.
  size_t share(Group& group, Scratch& scratch) const;

  /// What keeps vertices of paths apart that have not as many bounces left; for CellGroups.
  static uint32_t group_class(const VisiblePoint& vertex);

 private:
  static void choose_samples(const Group& group, Scratch& scratch);
  static void add_own(const PathLink& link, ReflectedPaths& reflected);
  void prepare_vertices(const Group& group, Scratch& scratch) const;
  void share_sample(Group& group, size_t finder, Scratch& scratch) const;
  void connect_pairs(const Group& group, size_t finder, Scratch& scratch) const;
  void evaluate_pair(size_t receiver, const PathSample& sample, Scratch& scratch) const;
  void trace_pairs(const Group& group, size_t finder, Scratch& scratch) const;
  void hand_out(Group& group, size_t finder, float weight, Scratch& scratch) const;
  void hand_out_divided(Group& group, size_t finder, float weight, const Scratch& scratch) const;
  KindColors pair_shares(size_t receiver, const Scratch& scratch, FoundKind kind) const;
  static float finder_weight(PairWeights weights, size_t finder, const Scratch& scratch);

  const PathContext& context_;
};

}  // namespace cistern
