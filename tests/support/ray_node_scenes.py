"""Scenes whose materials trace rays: Ambient Occlusion and Bevel nodes. Built straight on the core."""

from __future__ import annotations

import cistern_core as core

from tests.support.core_scenes import Color, SceneDescription
from tests.support.path_scenes import GRAY, GREEN, lamp_to_ceiling, room

Operand = object


def occlusion(
    p: core.MaterialProgram, distance: float, rays: int = 16, is_inside: bool = False, is_local: bool = False
) -> Operand:
    return p.emit("AMBIENT_OCCLUSION", [p.constant(distance), p.emit("NORMAL")], [rays, int(is_inside), int(is_local)])


def bevel(p: core.MaterialProgram, radius: float, probes: int = 4) -> Operand:
    return p.emit("BEVEL", [p.constant(radius), p.emit("NORMAL")], [probes])


def scaled(p: core.MaterialProgram, color: Color, factor: Operand) -> Operand:
    multiply = 2
    factors = p.emit("BROADCAST", [factor])
    zero, one = p.constant(0.0, 0.0, 0.0), p.constant(1.0)
    return p.emit("VECTOR_MATH", [p.constant(*color), factors, zero, one], [multiply])


def rest(p: core.MaterialProgram, value: Operand) -> Operand:
    subtract = 1
    return p.emit("MATH", [p.constant(1.0), value, p.constant(0.0)], [subtract, 0])


def shining_occlusion(distance: float, **members: object) -> core.MaterialProgram:
    """Radiance as much as is open."""
    p = core.MaterialProgram("open")
    p.closure("CLOSURE_EMISSION", [p.constant(1.0), scaled(p, (1.0, 1.0, 1.0), occlusion(p, distance, **members)),
                                   p.constant(1.0)])  # fmt: skip
    return p


def shining_normal(radius: float, probes: int) -> core.MaterialProgram:
    """Radiance of the normal's components, which must not be negative."""
    p = core.MaterialProgram("normal")
    p.closure("CLOSURE_EMISSION", [p.constant(1.0), bevel(p, radius, probes), p.constant(1.0)])
    return p


def dirty(color: Color, roughness: float = 1.0, **members: object) -> core.MaterialProgram:
    """What is near other things is dark; of roughness below 1, also glossy."""
    p = core.MaterialProgram("dirty")
    normal, one, zero = p.emit("NORMAL"), p.constant(1.0), p.constant(0.0)
    p.closure("CLOSURE_DIFFUSE", [one, scaled(p, color, occlusion(p, 0.5, **members)), zero, normal])
    if roughness < 1.0:
        weight = rest(p, occlusion(p, 0.4, **members))
        white = p.constant(0.9, 0.9, 0.9)
        p.closure("CLOSURE_GLOSSY", [weight, white, p.constant(roughness), zero, zero, normal, normal], [1])
    return p


def glowing_crevices(strength: float) -> core.MaterialProgram:
    """Shines where it is not open: nowhere, by what light samplers know without rays."""
    p = core.MaterialProgram("crevices")
    p.closure("CLOSURE_DIFFUSE", [p.constant(1.0), p.constant(0.6, 0.6, 0.6), p.constant(0.0), p.emit("NORMAL")])
    glow = scaled(p, (1.0, 0.6, 0.3), rest(p, occlusion(p, 0.5, rays=8)))
    p.closure("CLOSURE_EMISSION", [p.constant(1.0), glow, p.constant(strength)])
    return p


def worn_pane(color: Color) -> core.MaterialProgram:
    """More of it is there where it is near other things."""
    p = core.MaterialProgram("pane")
    part = occlusion(p, 0.6, rays=4)
    p.closure("CLOSURE_DIFFUSE", [rest(p, part), p.constant(*color), p.constant(0.0), p.emit("NORMAL")])
    p.closure("CLOSURE_TRANSPARENT", [part, p.constant(1.0, 1.0, 1.0)])
    return p


def rounded(color: Color, radius: float, roughness: float) -> core.MaterialProgram:
    """Lambertian, with a glossy half where `roughness` is below 1."""
    p = core.MaterialProgram("rounded")
    normal, zero = bevel(p, radius), p.constant(0.0)
    is_glossy = roughness < 1.0
    p.closure("CLOSURE_DIFFUSE", [p.constant(0.5 if is_glossy else 1.0), p.constant(*color), zero, normal])
    if is_glossy:
        white = p.constant(0.9, 0.9, 0.9)
        p.closure("CLOSURE_GLOSSY", [p.constant(0.5), white, p.constant(roughness), zero, zero, normal, normal], [1])
    return p


def add_block(scene: SceneDescription, half: Color, center: Color, material: core.MaterialProgram) -> None:
    signs = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    points = [tuple(c + s * h for c, s, h in zip(center, sign, half, strict=True)) for sign in signs]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    scene.add_mesh(points, faces, material, name="block")


def dirty_room() -> core.Scene:
    """Albedos, a glossy weight, an opacity and a lamp, all by what is near."""
    scene = SceneDescription()
    room(scene, floor=dirty((0.8, 0.8, 0.8)), back=dirty((0.8, 0.7, 0.6), roughness=0.4), left=dirty((0.8, 0.3, 0.2)))
    lamp_to_ceiling(scene)
    scene.add_sphere(0.35, dirty((0.7, 0.8, 0.7), is_local=True), (-0.5, 0.3, 0.4), rings=8)
    add_block(scene, (0.3, 0.3, 0.2), (0.4, 0.1, 0.2), glowing_crevices(1.0))
    scene.add_quad((-0.1, -0.7, 0.0), (0.0, 0.9, 0.0), (0, 0.1, 0.9), worn_pane((0.5, 0.6, 0.8)), name="pane")
    return scene.snapshot()


def bevelled_room() -> core.Scene:
    scene = SceneDescription()
    room(scene, right=GREEN)
    lamp_to_ceiling(scene)
    add_block(scene, (0.35, 0.3, 0.4), (-0.45, 0.2, 0.4), rounded((0.8, 0.5, 0.3), 0.25, 1.0))
    add_block(scene, (0.3, 0.3, 0.3), (0.45, -0.1, 0.3), rounded((0.5, 0.6, 0.8), 0.2, 0.3))
    scene.add_quad((-0.9, -0.9, 0.05), (0.6, 0, 0), (0, 0.6, 0), GRAY, name="card")
    return scene.snapshot()


SCENES = {"dirty_room": dirty_room, "bevelled_room": bevelled_room}
