#pragma once

#include <string>
#include <vector>

#include "film/film.h"
#include "film/pixel_filter.h"
#include "film/surface_passes.h"
#include "grid/cell_key.h"
#include "lights/light_set.h"
#include "restir/cached_light_reservoirs.h"
#include "restir/cell_shared_paths.h"
#include "restir/screen_space_paths.h"
#include "restir/secondary_light_reservoirs.h"
#include "restir/world_space_paths.h"
#include "transport/path_tracer.h"

namespace cistern {

/// How light is found: directly at the visible point, directly at later path vertices, and indirectly at the visible
/// point. NEE, NEE and PATH are the reference path tracer.
enum class DirectAnswer : uint8_t {
  NEE,
  LEARNED,       // next-event estimation, lights chosen by what they brought to the cell in earlier frames
  RIS,           // light candidates resampled at each point by itself
  RESTIR,        // [Bitterli 2020]
  RESTIR_CACHE,  // [Stefanescu 2025]
};
enum class SecondaryAnswer : uint8_t {
  NEE,
  LEARNED,          // as at the visible point
  RIS,              // light candidates resampled at each vertex by itself
  CELL_RESERVOIRS,  // [Boissé 2021]
};
enum class IndirectAnswer : uint8_t {
  PATH,
  SCREEN_REUSE,  // [Ouyang 2021]
  WORLD_REUSE,   // [Zhang and Wang 2023]
  CELL_SHARED,   // our own
};

/// Whether paths take a part of their directions from where light came from in earlier frames.
enum class Guiding : uint8_t {
  OFF,
  ON,
  AUTO,  // where a trial says that it pays; not where samples depend on each other, nor in pictures of few samples
};

/// Part of the full frame to render, in pixels, y up. Width 0: all of it.
struct Region {
  int x = 0, y = 0, width = 0, height = 0;
  friend bool operator==(const Region&, const Region&) = default;
};

/// As in [Zhang and Wang 2023, §5.3], of the diagonal.
inline constexpr float kDefaultMinCellShare = 0.01f;

struct Settings {
  int width = 1920, height = 1080;  // of the full frame
  Region region;
  int samples = 128;  // frames of one sample per pixel
  uint64_t seed = 0;
  int threads = 0;  // 0: all
  DirectAnswer direct = DirectAnswer::NEE;
  SecondaryAnswer secondary = SecondaryAnswer::NEE;
  IndirectAnswer indirect = IndirectAnswer::PATH;
  SecondaryReuse secondary_reuse;
  ScreenPathReuse screen_paths;
  WorldPathReuse world_paths;
  PathSharing path_sharing;
  LightCacheSettings light_cache;  // of RESTIR_CACHE
  DirectReuse direct_reuse;        // numbers that are 0 become the chosen answer's own
  /// Cells of the world-space grid; `min_cell_size` is here a share of the diagonal of the scene's box, `cell_pixels`
  /// where it is 0 becomes the answer's own.
  GridSettings grid{.min_cell_size = kDefaultMinCellShare, .cell_pixels = 0.0f};
  LightSampling light_sampling = LightSampling::TREE;
  bool find_openings = true;        // looks where the sky shines in; see opening_search.h
  bool light_through_panes = true;  // light samples look through clear panes
  int light_samples = 1;            // of the first vertex of a path, with NEE and more than two emitters
  Guiding guiding = Guiding::OFF;
  bool caustic_guide = false;  // bounces look for light of small lamps by way of smooth surfaces
  SampleSequence sequence = SampleSequence::SOBOL;
  FilterKind pixel_filter = FilterKind::BLACKMAN_HARRIS;
  float filter_width = 1.5f;  // pixels
  PathLimits limits;
  double time_limit = 0.0;         // seconds of rendering, 0: none
  double noise_threshold = 0.0;    // the render ends once PictureNoise::of_most() is no more, 0: never; see tells_noise
  bool adaptive_sampling = false;  // with a threshold, and frames that keep nothing: pixels end by themselves
  double display_exposure = 1.0;   // what the picture is shown times, for that
  float film_exposure = 1.0f;      // multiplies all light in passes, after clamping
  std::vector<float> shutter_curve;  // openness at even steps, see time_of_exposure
  std::vector<Pass> passes;          // besides Combined
  SurfacePasses surface_passes;
  int light_groups = 0;             // the first so many have a pass each
  bool groups_behind_film = false;  // see PathContext

  /// Reservoirs resample light samples many times, the BSDF's once: theirs have to find all light.
  EnvironmentDensity environment_density() const;
  /// Whether light samples pass the panes of this scene: not those of reservoirs, which know straight lines alone.
  bool passes_panes(const Scene& scene) const;
  /// Whether some answer hands its reservoirs on from frame to frame.
  bool has_temporal_reuse() const;
  /// What frames after the first are made by: these, unless paths are shared and the first alone has history.
  Settings of_later_frames() const;
  /// Whether frames use what the one before found: by temporal reuse, or because world-space paths take those of a cell
  /// from there. Their errors are then correlated.
  bool uses_earlier_frames() const;
  /// Whether all frames but the first are independent of each other, so that what they differ by tells their noise.
  bool tells_noise() const;
  /// These by the reference path tracer.
  Settings by_path_tracing() const;
  /// Whether history is taken from the RenderCache and left there. It needs temporal reuse.
  bool keep_history = false;
  /// Whether the picture only bridges the time until a finer one: the cache keeps its history apart, since one of few
  /// large pixels would be a poor substitute for that of the finer picture; at which a draft may look, see
  /// RenderCache::lend_history.
  bool is_draft = false;
  /// Whether each mesh has an Embree scene of its own, which snapshots share: moves are cheap, rays cost a little more.
  bool keep_instances = false;
  friend bool operator==(const Settings&, const Settings&) = default;
};

/// Whether the light samples of these vertices are left by the paths to stages of reservoirs.
inline bool uses_reservoirs(DirectAnswer direct) {
  return direct != DirectAnswer::NEE && direct != DirectAnswer::LEARNED;
}
inline bool uses_reservoirs(SecondaryAnswer secondary) {
  return secondary != SecondaryAnswer::NEE && secondary != SecondaryAnswer::LEARNED;
}

/// Throws Error naming the first setting that is out of range, its value and the range. Fills an empty region and the
/// numbers of `direct_reuse` that are 0; reuse that the chosen answer does not have is switched off, and `bias` reaches
/// all answers.
void check_settings(Settings& settings);

}  // namespace cistern
