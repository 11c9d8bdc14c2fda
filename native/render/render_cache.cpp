#include "render/render_cache.h"

#include <algorithm>

namespace cistern {

std::shared_ptr<const Accel> RenderCache::accel(const std::shared_ptr<const Scene>& scene, bool keep_instances,
                                                const std::function<bool()>& is_stopped) {
  std::shared_ptr<const Accel> previous;
  {
    const std::lock_guard lock(mutex_);
    previous = accel_;
  }
  std::shared_ptr<const Accel> accel = Accel::build(scene, previous, keep_instances, is_stopped);
  const std::lock_guard lock(mutex_);
  if (accel) accel_ = accel;
  return accel;
}

std::shared_ptr<const LightSet> RenderCache::lights(const std::shared_ptr<const Scene>& scene, LightSampling sampling,
                                                    EnvironmentDensity density,
                                                    const std::vector<AreaLight>& openings) {
  Lights& kept = lights_[openings.empty() ? 0 : 1];
  Lights previous;
  {
    const std::lock_guard lock(mutex_);
    previous = kept;
  }
  const LightSet* same_sky = nullptr;
  if (previous.lights && previous.density == density) {
    const SceneChange change = compare_scenes(*previous.scene, *scene);
    if (previous.sampling == sampling && previous.openings == openings &&
        has_same_emitters(*previous.scene, *scene, change))
      return previous.lights;
    if (!change.environment && !(change.camera && change.camera_is_shaded)) same_sky = previous.lights.get();
  }
  auto lights = openings.empty()
                    ? std::make_shared<const LightSet>(scene, sampling, density, same_sky)
                    : std::make_shared<const LightSet>(*this->lights(scene, sampling, density), std::span(openings));
  const std::lock_guard lock(mutex_);
  kept = {scene, sampling, density, openings, lights};
  return lights;
}

std::optional<std::vector<AreaLight>> RenderCache::openings(const Scene& scene, const Settings& settings) const {
  const std::lock_guard lock(mutex_);
  if (settings.is_draft) return openings_;
  if (!settings.keep_history || !scene_of_openings_) return std::nullopt;
  const SceneChange change = compare_scenes(*scene_of_openings_, scene);
  const bool is_lit_anew = change.surfaces || change.materials || change.lamps || change.environment ||
                           settings.passes_panes(scene) != openings_pass_panes_;
  return is_lit_anew || (change.camera && openings_.empty()) ? std::nullopt : std::optional(openings_);
}

void RenderCache::keep_openings(const std::shared_ptr<const Scene>& scene, const Settings& settings,
                                const std::vector<AreaLight>& openings) {
  const std::lock_guard lock(mutex_);
  openings_pass_panes_ = settings.passes_panes(*scene);
  scene_of_openings_ = scene;
  openings_ = openings;
  if (openings_.empty()) lights_[1] = {};
}

std::shared_ptr<const LightCacheCells> RenderCache::light_cache_cells(const Scene& scene, uint32_t point_count,
                                                                      uint64_t seed, const WorkMonitor& monitor) {
  {
    const std::lock_guard lock(mutex_);
    if (cells_ && cells_->fits(scene)) return cells_;
  }
  std::shared_ptr<const LightCacheCells> cells = LightCacheCells::build(scene, point_count, seed, monitor);
  const std::lock_guard lock(mutex_);
  if (cells) cells_ = cells;
  return cells;
}

std::unique_ptr<ReuseFrame> RenderCache::take_history(const Settings& settings) {
  const std::lock_guard lock(mutex_);
  std::unique_ptr<ReuseFrame>& history = settings.is_draft ? draft_history_ : history_;
  if (!history || !shares_history(history->world()->settings, settings)) return nullptr;
  return std::move(history);
}

void RenderCache::leave_history(std::unique_ptr<ReuseFrame> frame) {
  {
    const std::lock_guard lock(mutex_);
    const bool is_draft = frame->world()->settings.is_draft;
    if (frame->has_finished_frame()) is_finer_newest_ = !is_draft;
    std::swap(is_draft ? draft_history_ : history_, frame);
  }
  // What was kept before is freed here, when nobody waits for the lock.
}

std::unique_ptr<ReuseFrame> RenderCache::lend_history(const Settings& draft) {
  const std::lock_guard lock(mutex_);
  if (!history_ || !(is_finer_newest_ || !draft.keep_history)) return nullptr;
  if (!can_borrow_history(draft, history_->world()->settings)) return nullptr;
  return std::move(history_);
}

void RenderCache::return_history(std::unique_ptr<ReuseFrame> frame) {
  const std::lock_guard lock(mutex_);
  if (!history_) std::swap(history_, frame);
}

void RenderCache::drop_history() {
  std::unique_ptr<ReuseFrame> history, draft_history;
  const std::lock_guard lock(mutex_);
  std::swap(history, history_);
  std::swap(draft_history, draft_history_);
}

size_t RenderCache::memory_bytes() const {
  const std::lock_guard lock(mutex_);
  size_t of_lights = 0;  // those with openings share what those without hold
  for (const Lights& kept : lights_) of_lights = std::max(of_lights, kept.lights ? kept.lights->memory_bytes() : 0);
  return of_lights + (accel_ ? accel_->memory_bytes() : 0) + (cells_ ? cells_->memory_bytes() : 0) +
         (history_ ? history_->memory_bytes() : 0) + (draft_history_ ? draft_history_->memory_bytes() : 0);
}

}  // namespace cistern
