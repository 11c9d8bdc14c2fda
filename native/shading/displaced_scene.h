#pragma once

#include "scene/scene_builder.h"

namespace cistern {

/// A snapshot in which instances show their meshes as the displacement of their materials moves them.
struct DisplacedScene {
  std::shared_ptr<const Scene> scene;
  std::vector<std::string> warnings;
};

/// The builder's snapshot; the very one of SceneBuilder::snapshot where nothing is displaced. A mesh is displaced once
/// for each set of materials it is shown with, and again only when what its displacement depends on has changed.
DisplacedScene displaced_snapshot(SceneBuilder& builder);

}  // namespace cistern
