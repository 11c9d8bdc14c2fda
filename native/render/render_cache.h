#pragma once

#include <array>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "render/reuse_frame.h"

namespace cistern {

/// What a render can take over from an earlier one: Embree scenes of meshes; the lights where none changed; the cells
/// of the light cache, which depend on geometry alone; and the history of frames. May be used by several sessions at
/// once, of which one has the history.
class RenderCache {
 public:
  /// For the scene, from parts of those built last. Null when stopped (Accel::build); what was kept stays.
  std::shared_ptr<const Accel> accel(const std::shared_ptr<const Scene>& scene, bool keep_instances,
                                     const std::function<bool()>& is_stopped = {});
  /// Those built last with or without openings, if the same things emit light in this scene, else new ones.
  std::shared_ptr<const LightSet> lights(const std::shared_ptr<const Scene>& scene, LightSampling sampling,
                                         EnvironmentDensity density, const std::vector<AreaLight>& openings = {});
  /// What was last found of a scene's openings (opening_search.h), if these settings are content with that: drafts are,
  /// which have no time to search; other pictures of a viewport while nothing changes that openings depend on, but that
  /// the camera may move where there are some. Others look for themselves, or pictures would depend on earlier ones.
  std::optional<std::vector<AreaLight>> openings(const Scene& scene, const Settings& settings) const;
  void keep_openings(const std::shared_ptr<const Scene>& scene, const Settings& settings,
                     const std::vector<AreaLight>& openings);
  /// The cells kept, if they were built from the very surfaces of `scene`, else newly built ones, which are kept from
  /// then on. Null when stopped.
  std::shared_ptr<const LightCacheCells> light_cache_cells(const Scene& scene, uint32_t point_count, uint64_t seed,
                                                           const WorkMonitor& monitor);

  /// The frame left last, of drafts for a draft, if settings agree; it is gone from here. Otherwise null, and what was
  /// left is kept.
  std::unique_ptr<ReuseFrame> take_history(const Settings& settings);
  /// In place of what was left before, by drafts if it is one.
  void leave_history(std::unique_ptr<ReuseFrame> frame);
  /// For a draft: the frame of a finer picture, if it was left after the last draft's or the draft keeps no history of
  /// its own, and can_borrow_history; to be returned. Otherwise null.
  std::unique_ptr<ReuseFrame> lend_history(const Settings& draft);
  void return_history(std::unique_ptr<ReuseFrame> frame);
  void drop_history();

  size_t memory_bytes() const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const Accel> accel_;
  struct Lights {
    std::shared_ptr<const Scene> scene;
    LightSampling sampling{};
    EnvironmentDensity density{};
    std::vector<AreaLight> openings;
    std::shared_ptr<const LightSet> lights;
  };
  std::array<Lights, 2> lights_;  // without openings and with some
  std::shared_ptr<const Scene> scene_of_openings_;
  bool openings_pass_panes_ = false;  // were sought through them
  std::vector<AreaLight> openings_;
  std::shared_ptr<const LightCacheCells> cells_;
  std::unique_ptr<ReuseFrame> history_, draft_history_;
  bool is_finer_newest_ = false;  // of the two
};

}  // namespace cistern
