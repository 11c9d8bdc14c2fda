"""What passes that add up to Combined have to get along with: settings, on the scene of kind_scenes.build_surfaces."""

from __future__ import annotations

from collections.abc import Callable

import bpy


def see_through_film(scene: bpy.types.Scene) -> None:
    scene.render.film_transparent = scene.cistern.film_transparent_glass = True


def clamped(scene: bpy.types.Scene) -> None:
    scene.cistern.clamp_direct, scene.cistern.clamp_indirect = 0.5, 0.1


def learned(scene: bpy.types.Scene) -> None:
    scene.cistern.direct = scene.cistern.secondary = "LEARNED"


def guided(scene: bpy.types.Scene) -> None:
    scene.cistern.guiding = "ON"


def light_samples(scene: bpy.types.Scene) -> None:
    scene.cistern.light_samples = 4


def hidden_from_kinds(scene: bpy.types.Scene) -> None:
    """The sign from glossy rays, the panel from diffuse ones: then reuse has to tell kinds of rays apart."""
    bpy.data.objects["sign"].visible_glossy = False
    next(o for o in scene.objects if o.type == "LIGHT" and o.data.type == "AREA").visible_diffuse = False


def few_bounces(scene: bpy.types.Scene) -> None:
    scene.cistern.max_bounces, scene.cistern.max_diffuse_bounces, scene.cistern.max_glossy_bounces = 2, 1, 1


def held_out(scene: bpy.types.Scene) -> None:
    bpy.data.objects["leaf"].is_holdout = True


CHANGES: dict[str, Callable[[bpy.types.Scene], None]] = {
    f.__name__: f
    for f in (see_through_film, clamped, learned, guided, light_samples, hidden_from_kinds, few_bounces, held_out)
}
# Each answer to how light is found, once.
DIFFERENT = ("PATH_TRACING", "FINAL", "INTERACTIVE", "RESTIR_DI", "CELL_RESERVOIRS", "RESTIR_GI", "WORLD_PATHS")
