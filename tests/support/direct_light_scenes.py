"""Five small scenes that are unkind to reuse of direct light. All are meant for square pictures of 32 pixels."""

from __future__ import annotations

from collections.abc import Callable

import cistern_core as core
import numpy as np

from tests.support.core_scenes import SceneDescription, emission, principled

Vector = tuple[float, float, float]
GRAY = principled((0.7, 0.7, 0.7))
NOT_TO_CAMERA = 30
"""Visibility bits. Lamps that the camera sees would be bright pixels whose noise hides everything else."""


def point_on(scene: SceneDescription, position: Vector, radius: float, color: Vector, soft: bool = False) -> None:
    scene.builder.add_point_light("sphere", position, radius, color, soft=soft, visibility=NOT_TO_CAMERA)


def spot(scene: SceneDescription, position: Vector, target: Vector, color: Vector, size: float) -> None:
    """A spot light with a rather hard edge; `size` is the full angle of its cone."""
    back = np.array(position) - np.array(target)
    back /= np.linalg.norm(back)
    right = np.cross([0.0, 0.6, 0.8], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :4] = np.stack([right, np.cross(back, right), back, np.array(position)], 1)
    scene.builder.add_spot_light("spot", matrix.astype(np.float32), 0.02, color, size, 0.15, visibility=NOT_TO_CAMERA)


def sky(scene: SceneDescription, bottom: float, top: float) -> None:
    """An environment that is brighter above, sampled by an importance map."""
    p = core.MaterialProgram("sky")
    up = p.emit("SEPARATE_Z", [p.emit("GENERATED", [], [0])])
    numbers = [p.constant(x) for x in (-1.0, 1.0, bottom, top, 4.0)]
    p.closure(
        "CLOSURE_EMISSION", [p.constant(1.0), p.constant(0.6, 0.8, 1.0), p.emit("MAP_RANGE", [up, *numbers], [0, 1])]
    )
    scene.builder.set_environment(scene.builder.add_material(p), importance_width=64)


def transparent(color: Vector) -> core.MaterialProgram:
    p = core.MaterialProgram("transparent")
    p.closure("CLOSURE_TRANSPARENT", [p.constant(1.0), p.constant(*color)])
    return p


def leaning_lobes(see_through: bool = False) -> core.MaterialProgram:
    """Two diffuse lobes whose normals lean apart, so that no one normal stands for both. Light from behind goes through
    evenly, or with `see_through` only as through clear glass."""
    p = core.MaterialProgram("leaning lobes")
    zero = p.constant(0.0)
    p.closure("CLOSURE_DIFFUSE", [p.constant(0.6), p.constant(0.9, 0.3, 0.3), zero, p.constant(0.8, 0.0, 0.6)])
    p.closure("CLOSURE_DIFFUSE", [p.constant(0.2), p.constant(0.3, 0.3, 0.9), zero, p.constant(-0.9, 0.0, 0.436)])
    if see_through:
        clear = [p.constant(0.2), p.constant(1, 1, 1), zero, p.constant(1.45)]
        p.closure("CLOSURE_GLASS", [*clear, p.emit("NORMAL"), zero, zero, zero, zero, p.constant(0.0, 0.0, 0.0)], [1])
    else:
        p.closure("CLOSURE_TRANSLUCENT", [p.constant(0.2), p.constant(0.5, 0.9, 0.5), p.emit("NORMAL")])
    return p


def strip(scene: SceneDescription, profile: list[tuple[float, float]], material: core.MaterialProgram) -> None:
    """Flat faces between the points (x, z) of a profile, from y = -2 to 2; they look up where x grows."""
    points = [(x, y, z) for x, z in profile for y in (-2.0, 2.0)]
    faces = [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(len(profile) - 1)]
    scene.add_mesh(points, faces, material, name="strip")


def corrugated() -> core.Scene:
    """Normals that change within a pixel: waves on the left, stairs on the right, a flat gap where an area lamp stands
    that lights one side only. The sun is low, and beyond the horizon of the mean normal of a plate that reflects it all
    the same. Nothing lights the underside of the shelf behind the lamp."""
    scene = SceneDescription()
    waves = [(x, 0.05 + 0.05 * np.sin(30.0 * x)) for x in np.linspace(-2.0, -0.8, 49)]
    stairs = [(0.9 + 0.1 * ((k + 1) // 2), 0.1 * (k // 2)) for k in range(24)]
    strip(scene, [*waves, (-0.7, 0.0), (0.9, 0.0), *stairs], GRAY)
    scene.add_quad((-1.6, 0.6, 1.4), (0.0, 1.4, 0.0), (1.0, 0.0, 0.0), GRAY)
    scene.add_quad((-0.6, -1.3, 0.01), (0.5, 0, 0), (0, 1.0, 0), leaning_lobes(see_through=True))
    warm = (6.0, 5.0, 2.0)
    scene.builder.add_area_light("card", (0.1, 0.0, 0.2), (0.0, 1.6, 0.0), (0.0, 0.0, 0.3), (1.0, 0.0, 0.0), warm)
    scene.builder.add_sun_light("low sun", (-0.9, -0.1, 0.42), 0.02, (1.6, 1.8, 2.2))
    scene.set_camera((0.0, -2.6, 0.9), (0.0, 0.2, 0.35), half_width=0.62)
    return scene.snapshot()


def spots() -> core.Scene:
    """Coloured cones with hard edges on a floor and a wall; most points see one or two of them, many none."""
    scene = SceneDescription()
    scene.add_quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), GRAY)
    scene.add_quad((-2, 2, 0), (4, 0, 0), (0, 0, 3), GRAY)
    scene.add_sphere(0.5, principled((0.8, 0.8, 0.8), specular=0.5, roughness=0.4), (0.3, 0.0, 0.5), rings=12)
    colors = [(9, 2, 2), (2, 9, 2), (2, 2, 9), (8, 8, 2), (2, 8, 8), (8, 2, 8), (5, 5, 5), (9, 5, 2)]
    for k, color in enumerate(colors):
        angle = 2.0 * np.pi * k / len(colors)
        target = (1.3 * np.cos(angle), 1.0 * np.sin(angle), 0.0)
        if k % 3 == 2:
            target = (target[0], 2.0, 1.2)
        spot(scene, (-0.5 * target[0], -0.6, 2.5), target, color, 0.45 + 0.05 * k)
    scene.set_camera((0.0, -4.5, 3.0), (0.0, 0.4, 0.6), half_width=0.42)
    return scene.snapshot()


def occluders() -> core.Scene:
    """A thin wall between red and blue light, slats under lamps; and a lamp that throws no shadows."""
    scene = SceneDescription()
    scene.add_quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), GRAY)
    scene.add_quad((0.03, -2, 0), (0, 4, 0), (0, 0, 0.9), GRAY, name="thin wall")
    for k in range(12):
        scene.add_quad((-1.9 + 0.32 * k, -2, 1.2), (0.16, 0, 0), (0, 3, 0), GRAY, name="slat")
    for k in range(6):
        y = -1.8 + 0.7 * k
        point_on(scene, (-0.7, y, 0.4), 0.08, (0.5, 0.1, 0.05))
        point_on(scene, (0.8, y + 0.2, 0.5), 0.05, (0.05, 0.1, 0.6), soft=k % 2 == 0)
        point_on(scene, (-1.5 + 0.6 * k, -0.5, 1.6), 0.1, (0.5, 0.7, 0.4))
    scene.builder.add_point_light("ghost", (0.5, 1.6, 0.3), 0.0, (0.1, 0.06, 0.02), casts_shadow=False)
    scene.add_quad((-1.2, 1.9, 0.0), (0.6, 0, 0), (0, 0, 0.5), emission((1.0, 2.0, 4.0)))
    scene.set_camera((0.5, -3.6, 2.6), (0.0, 0.0, 0.2), half_width=0.55)
    return scene.snapshot()


def many_lights() -> core.Scene:
    """Small coloured lights of every kind over glossy, polished and mirroring things."""
    scene = SceneDescription()
    scene.add_quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), principled((0.6, 0.6, 0.6), specular=0.5, roughness=0.35))
    scene.add_quad((-2, 2, 0), (4, 0, 0), (0, 0, 2), principled((0.8, 0.6, 0.3), metallic=1.0, roughness=0.4))
    scene.add_sphere(0.45, principled((0.9, 0.9, 0.9), metallic=1.0, roughness=0.0), (-0.8, 0.6, 0.45))
    scene.add_sphere(0.35, principled((0.2, 0.5, 0.2), specular=0.5, roughness=0.0), (0.9, 0.5, 0.35))
    scene.add_quad((-0.2, -0.9, 0.02), (1.1, 0, 0), (0, 0.7, 0.3), leaning_lobes())
    rng = np.random.default_rng(5)
    for k in range(48):
        position = (*rng.uniform(-1.9, 1.9, 2), rng.uniform(0.3, 1.8))
        color = 0.12 * rng.dirichlet([0.5, 0.5, 0.5])
        point_on(scene, position, 0.02 * (k % 3), tuple(color), soft=k % 2 == 0)
    for k in range(6):
        x = -1.7 + 0.7 * k
        right, down = ((0.2, 0.0, 0.0), (0.0, 0.0, -1.0)) if k % 3 else ((0.16, 0.0, -0.12), (-0.6, 0.0, -0.8))
        scene.builder.add_area_light(
            "tile", (x, 1.0, 1.7), right, (0, 0.2, 0), down, (4.0, 1.0 + k, 6.0 - k), k % 2 == 1, 2.0 + 0.2 * k,
            visibility=NOT_TO_CAMERA,
        )  # fmt: skip
    for k in range(4):
        scene.add_quad((-1.8 + 1.1 * k, -1.2, 0.3), (0.15, 0, 0), (0.0, 0.05, 0.2), emission((6.0 - k, 2.0, 2.0 + k)))
    scene.builder.add_sun_light("sun", (0.4, -0.5, 0.8), 0.3, (0.3, 0.28, 0.25))
    sky(scene, 0.02, 0.15)
    scene.set_camera((0.0, -4.2, 1.8), (0.0, 0.2, 0.4), half_width=0.4)
    return scene.snapshot()


def transparency() -> core.Scene:
    """Half transparent and tinted things between the lights, the floor and the camera; a mirror shows them again."""
    scene = SceneDescription()
    scene.add_quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), GRAY)
    scene.add_quad((-2, 2, 0), (4, 0, 0), (0, 0, 2), principled((0.9, 0.9, 0.9), metallic=1.0, roughness=0.0))
    scene.add_quad((-1.5, -0.6, 0.5), (1.4, 0, 0), (0, 1.2, 0), principled((0.9, 0.4, 0.2), alpha=0.5))
    scene.add_quad((0.2, 0.0, 0.1), (0.0, 1.4, 0.0), (0, 0, 1.2), transparent((0.9, 0.5, 0.3)))
    scene.add_quad((0.6, -1.2, 0.8), (1.0, 0, 0), (0, 1.0, 0), transparent((0.2, 0.7, 0.9)))
    scene.add_sphere(
        0.3, principled((0.9, 0.95, 1.0), specular=0.5, roughness=0.3, transmission=0.8), (-0.4, -0.9, 0.3)
    )
    scene.builder.add_area_light("panel", (0, 0, 1.8), (0.8, 0, 0), (0, 0.8, 0), (0, 0, -1), (5.0, 4.5, 4.0))
    for k in range(5):
        point_on(scene, (-1.6 + 0.8 * k, 0.8, 0.9), 0.06, (0.3 - 0.05 * k, 0.15, 0.1 + 0.06 * k))
    scene.builder.add_sun_light("sun", (0.5, -0.3, 0.8), 0.1, (0.6, 0.6, 0.5))
    sky(scene, 0.0, 0.3)
    scene.set_camera((0.3, -4.0, 2.0), (0.0, 0.2, 0.5), half_width=0.42)
    return scene.snapshot()


SCENES: dict[str, Callable[[], core.Scene]] = {
    make.__name__: make for make in (corrugated, spots, occluders, many_lights, transparency)
}
