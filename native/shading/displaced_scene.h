#pragma once

#include <functional>

#include "scene/scene_builder.h"

namespace cistern {

/// A snapshot in which instances show their meshes as they are diced for its view, and as the displacement of their
/// materials moves them.
struct DisplacedScene {
  std::shared_ptr<const Scene> scene;
  std::vector<std::string> warnings;
};

/// The builder's snapshot; as SceneBuilder::snapshot where nothing is diced or displaced. A mesh is diced for the
/// instance that shows it largest, and displaced once for each set of materials it is shown with; both again only when
/// what they depend on has changed. With `middle`, a snapshot of the middle of a shutter, meshes are cut as those there
/// that have the same polygons and are shown by instances of the same key; others are as they are.
///
/// Without a scene once `is_stopped` was true, if there is such a question: it is asked from any thread, all the time.
DisplacedScene displaced_snapshot(SceneBuilder& builder, const Scene* middle = nullptr,
                                  const std::function<bool()>& is_stopped = {});

}  // namespace cistern
