"""Blender scenes with light and shadow linking, built by script."""

from __future__ import annotations

import math
from collections.abc import Iterable

import bpy

from . import blender_scenes as build

Linked = bpy.types.Object | bpy.types.Collection


def links(name: str, include: Iterable[Linked] = (), exclude: Iterable[Linked] = ()) -> bpy.types.Collection:
    """A collection for `receiver_collection` or `blocker_collection`, in no scene."""
    collection = bpy.data.collections.new(name)
    for state, things in (("INCLUDE", include), ("EXCLUDE", exclude)):
        for thing in things:
            if isinstance(thing, bpy.types.Object):
                collection.objects.link(thing)
                entries, index = collection.collection_objects, list(collection.objects).index(thing)
            else:
                collection.children.link(thing)
                entries, index = collection.collection_children, list(collection.children).index(thing)
            entries[index].light_linking.link_state = state
    return collection


def light_only(emitter: bpy.types.Object, *things: Linked) -> None:
    emitter.light_linking.receiver_collection = links("lit", include=things)


def light_all_but(emitter: bpy.types.Object, *things: Linked) -> None:
    emitter.light_linking.receiver_collection = links("unlit", exclude=things)


def blocked_only(emitter: bpy.types.Object, *things: Linked) -> None:
    emitter.light_linking.blocker_collection = links("blocking", include=things)


def blocked_by_all_but(emitter: bpy.types.Object, *things: Linked) -> None:
    emitter.light_linking.blocker_collection = links("passing", exclude=things)


def ball(scene: bpy.types.Scene, name: str, place: tuple, radius: float = 0.5, **inputs: object) -> bpy.types.Object:
    """On the floor."""
    surface = build.principled(name, **({"Base_Color": (0.7, 0.6, 0.5, 1)} | inputs))
    sphere = build.add_sphere(scene, surface, radius=radius, segments=24)
    sphere.name, sphere.location = name, place
    return sphere


def stage(scene: bpy.types.Scene) -> None:
    """Two balls on a floor before a wall, "left" and "right", under a dim sky and a lamp that is not linked."""
    build.add_camera(scene, (0.0, -4.6, 2.2), (math.radians(68), 0.0, 0.0), lens=45.0)
    build.add_floor(scene)
    wall = [(-3, 1.8, 0), (3, 1.8, 0), (3, 1.8, 3), (-3, 1.8, 3)]
    build.add_mesh(scene, "wall", wall, [(0, 1, 2, 3)], build.principled("wall", Base_Color=(0.5, 0.6, 0.7, 1)))
    ball(scene, "left", (-0.8, 0.0, 0.0))
    ball(scene, "right", (0.8, 0.0, 0.0), Base_Color=(0.8, 0.8, 0.8, 1), Metallic=1.0, Roughness=0.3)
    build.set_world(scene, strength=0.1)
    build.add_light(scene, "POINT", (-2.0, -2.0, 2.5), energy=30.0, shadow_soft_size=0.2).name = "fill"


LAMPS = {
    "POINT": {"energy": 150.0, "shadow_soft_size": 0.3},
    "SPOT": {"energy": 400.0, "spot_size": 1.2, "spot_blend": 0.3, "shadow_soft_size": 0.2},
    "AREA": {"energy": 100.0, "shape": "DISK", "size": 1.0},
    "SUN": {"energy": 2.0, "angle": 0.3},
}


def key_lamp(scene: bpy.types.Scene, kind: str, place: tuple = (0.0, 0.0, 2.5)) -> bpy.types.Object:
    lamp = build.add_light(scene, kind, place, **LAMPS[kind])
    lamp.name = "key"
    return lamp


def key_panel(scene: bpy.types.Scene, height: float = 2.2, half: float = 0.4) -> bpy.types.Object:
    """An emissive square above the balls; light leaves both sides."""
    glow = build.material("glow", lambda tree: build.shader(tree, "ShaderNodeEmission", Strength=12.0).outputs[0])
    corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    panel = build.add_mesh(scene, "key", corners, [(0, 1, 2, 3)], glow)
    panel.location = (0.0, 0.0, height)
    return panel


def shade(scene: bpy.types.Scene, surface: bpy.types.Material | None = None) -> bpy.types.Object:
    """A board between the key light and the balls."""
    corners = [(-0.9, -0.6, 1.5), (0.3, -0.6, 1.5), (0.3, 0.6, 1.5), (-0.9, 0.6, 1.5)]
    return build.add_mesh(scene, "shade", corners, [(0, 1, 2, 3)], surface or build.principled("shade"))
