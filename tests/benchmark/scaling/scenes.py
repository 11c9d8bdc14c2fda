"""Scenes of any size, of which only one number grows: straight on the core, 2 x 2 x 1 metres."""

from __future__ import annotations

import cistern_core as core
import numpy as np
from numpy.typing import NDArray

from tests.support.core_scenes import VISIBLE_TO_ALL, SceneDescription, emission, principled

LAMPS = 100  # where lights do not grow
TRIANGLES = 20_000  # where triangles do not grow
LAMP_AREA = 0.04  # m2 of all emissive triangles, or of the discs as which all lamps are seen
LAMP_POWER = 40.0  # W/sr of all lamps; the radiance of triangles gives as much


def sheet(scene: SceneDescription, triangles: int, height: float, up: bool) -> int:
    """A square with waves whose shape does not depend on its triangles; returns its handle."""
    side = max(1, round((triangles / 2) ** 0.5))
    x, y = np.meshgrid(*2 * [np.linspace(-1.0, 1.0, side + 1, dtype=np.float32)])
    points = np.stack([x, y, height + 0.01 * np.sin(40 * x) * np.sin(40 * y)], -1).reshape(-1, 3).astype(np.float32)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    quads = np.stack([first, first + 1, first + side + 2, first + side + 1], 1)
    corners = (quads if up else quads[:, ::-1]).ravel().astype(np.int32)
    normals = np.broadcast_to(np.float32([0, 0, 1 if up else -1]), points.shape).copy()
    offsets = np.arange(0, len(corners) + 1, 4, dtype=np.int32)
    return scene.builder.add_mesh("sheet", points, corners, offsets, normals=normals, normals_domain="POINT")


def places(count: int) -> NDArray[np.float32]:
    """Of lights: anywhere between the sheets, the same for the first of more."""
    low, high = (-0.9, -0.9, 0.3), (0.9, 0.9, 0.8)
    return np.random.default_rng(1).uniform(low, high, (count, 3)).astype(np.float32)


def add_lamps(scene: SceneDescription, count: int, area: float) -> None:
    radius, intensity = (area / (np.pi * count)) ** 0.5, 3 * [LAMP_POWER / count]
    for number, place in enumerate(places(count).tolist()):
        scene.builder.add_point_light(f"lamp {number}", place, radius, intensity)


def emissive_triangles(scene: SceneDescription, count: int) -> int:
    """One mesh of equilateral triangles that look anywhere."""
    edge = (4.0 * LAMP_AREA / (3.0**0.5 * count)) ** 0.5
    random = np.random.default_rng(2)
    u, v = (random.normal(size=(count, 3)) for _ in range(2))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v -= (u * v).sum(axis=1, keepdims=True) * u
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    turns = 2.0 * np.pi * np.arange(3) / 3.0
    arms = edge / 3.0**0.5 * (np.cos(turns)[:, None] * u[:, None] + np.sin(turns)[:, None] * v[:, None])
    points = (places(count)[:, None] + arms).reshape(-1, 3).astype(np.float32)
    corners = np.arange(3 * count, dtype=np.int32)
    return scene.builder.add_mesh("lamps", points, corners, np.arange(0, 3 * count + 1, 3, dtype=np.int32))


def room(triangles: int = TRIANGLES, lamps: int = LAMPS, lights: int = 0, points: int = 0) -> core.Scene:
    """Half of the triangles below, half above; between them lamps, or in their place emissive triangles, or lamps
    without size."""
    scene = SceneDescription()
    gray = scene.builder.add_material_set([scene.builder.add_material(principled((0.7, 0.7, 0.7)))], "sheets")
    handles = [(sheet(scene, triangles // 2, z, up), gray) for z, up in ((0.0, True), (1.0, False))]
    if lights:
        radiance = LAMP_POWER / (np.pi * LAMP_AREA)
        glow = scene.builder.add_material(emission((1.0, 1.0, 1.0), radiance))
        handles.append((emissive_triangles(scene, lights), scene.builder.add_material_set([glow], "lamps")))
    elif points:
        add_lamps(scene, points, 0.0)
    else:
        add_lamps(scene, lamps, LAMP_AREA)
    mesh, materials = (np.array(column, np.int32) for column in zip(*handles, strict=True))
    name = scene.builder.add_object_name("room")
    matrices = np.tile(np.eye(4, dtype=np.float32), (len(handles), 1, 1))
    visibility = np.full(len(handles), VISIBLE_TO_ALL, np.uint8)
    scene.builder.add_instances(mesh, materials, np.full(len(handles), name, np.int32), matrices, visibility)
    scene.set_camera((0.0, -1.6, 0.5), (0.0, 0.0, 0.3))
    return scene.snapshot()
