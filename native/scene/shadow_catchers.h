#pragma once

#include "scene/scene.h"

namespace cistern {

/// Whether a surface of the scene catches shadows: it is part of the scene like any other, and what else there is
/// changes of the light that the camera sees on it can be told by a second picture, of `shadow_catchers_alone`.
bool has_shadow_catchers(const Scene& scene);

/// The scene in which light finds nothing but shadow catchers. Other surfaces that the camera sees are held out of its
/// picture, and neither shine nor are they in the way of light.
Scene shadow_catchers_alone(const Scene& scene);

/// The world, without all that stands or shines before it but for what is held out of it.
Scene backdrop(const Scene& scene);

}  // namespace cistern
