#pragma once

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
/// what they depend on has changed.
DisplacedScene displaced_snapshot(SceneBuilder& builder);

}  // namespace cistern
