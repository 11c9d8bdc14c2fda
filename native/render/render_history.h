#pragma once

#include "lights/emitter_match.h"
#include "render/frame_run.h"
#include "render/render_world.h"
#include "restir/earlier_world.h"
#include "restir/pixel_reuse.h"

namespace cistern {

/// Where the history that a render took over comes from, for as long as it is used.
class HistorySource {
 public:
  /// `change`: from the scene of `world` to that of `present`.
  HistorySource(std::shared_ptr<const RenderWorld> world, const RenderWorld& present, SceneChange change)
      : world_(std::move(world)), change_(std::move(change)) {
    if (!change_.affects_light()) return;
    emitters_.emplace(*world_->lights, *present.lights, change_);
    earlier_.emplace(world_->paths, *emitters_);
  }
  HistorySource(const HistorySource&) = delete;
  HistorySource& operator=(const HistorySource&) = delete;

  const std::shared_ptr<const RenderWorld>& world() const { return world_; }
  const SceneChange& change() const { return change_; }
  EarlierView view() const {
    return {change_.earlier_camera, image_region(world_->settings), change_.surfaces ? &change_ : nullptr};
  }
  /// Null where light is as it was: all that is looked up there holds now as well.
  const EarlierWorld* earlier() const { return earlier_ ? &*earlier_ : nullptr; }

 private:
  std::shared_ptr<const RenderWorld> world_;
  SceneChange change_;
  std::optional<EmitterMatch> emitters_;
  std::optional<EarlierWorld> earlier_;
};

/// Whether a render can go on with the history of another: all that decides what its reservoirs hold is the same. The
/// size of the picture and the part of it that is rendered may differ.
bool shares_history(const Settings& a, const Settings& b);

/// Whether a draft can look at the history of a finer picture for a frame: all that both decide is the same, and only
/// the reservoirs of pixels are carried over.
bool can_borrow_history(const Settings& draft, const Settings& finer);

}  // namespace cistern
