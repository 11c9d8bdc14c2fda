"""Small scenes whose light arrives by way of other surfaces, unkind to reuse of path samples. All are meant for square
pictures of 20 pixels. Lamps are big and walls between them near: what is rare would take too many replicas to compare.
"""

from __future__ import annotations

from collections.abc import Callable

import cistern_core as core

from tests.support.core_scenes import (
    CAMERA,
    DIFFUSE,
    GLOSSY,
    SHADOW,
    VISIBLE_TO_ALL,
    SceneDescription,
    principled,
)
from tests.support.direct_light_scenes import NOT_TO_CAMERA, leaning_lobes, point_on, sky, transparent

GRAY = principled((0.7, 0.7, 0.7))
RED, GREEN = principled((0.8, 0.3, 0.2)), principled((0.3, 0.7, 0.3))


def room(
    scene: SceneDescription,
    floor: core.MaterialProgram = GRAY,
    back: core.MaterialProgram = GRAY,
    ceiling: core.MaterialProgram = GRAY,
    left: core.MaterialProgram = RED,
    right: core.MaterialProgram = GREEN,
) -> None:
    """Five walls of a closed box from (-1, -1, 0) to (1, 1, 2), and a sixth behind the camera."""
    scene.add_quad((-1, -3, 0), (2, 0, 0), (0, 4, 0), floor, name="floor")
    scene.add_quad((-1, -3, 2), (0, 4, 0), (2, 0, 0), ceiling, name="ceiling")
    scene.add_quad((-1, 1, 0), (2, 0, 0), (0, 0, 2), back, name="back")
    scene.add_quad((-1, -3, 0), (0, 4, 0), (0, 0, 2), left, name="left")
    scene.add_quad((1, -3, 0), (0, 0, 2), (0, 4, 0), right, name="right")
    scene.add_quad((-1, -3, 0), (0, 0, 2), (2, 0, 0), GRAY, name="front")
    scene.set_camera((0.0, -2.8, 1.0), (0.0, 0.0, 0.95), half_width=0.55)


def lamp_to_ceiling(scene: SceneDescription, strength: float = 6.0, **common) -> None:
    """A panel that shines at the ceiling alone: below it all light has bounced."""
    color = (strength, 0.9 * strength, 0.7 * strength)
    scene.builder.add_area_light(
        "panel", (0.1, 0.0, 1.5), (1.0, 0.0, 0.0), (0.0, 1.2, 0.0), (0.0, 0.0, 1.0), color,
        visibility=NOT_TO_CAMERA, **common,
    )  # fmt: skip
    scene.add_quad((-0.45, -0.65, 1.49), (1.1, 0, 0), (0, 1.3, 0), GRAY, name="blocker")


def indirect_room() -> core.Scene:
    """Everything is diffuse; a thin wall stands on the floor, with different light on its sides."""
    scene = SceneDescription()
    room(scene)
    lamp_to_ceiling(scene)
    scene.add_quad((0.0, -0.6, 0.0), (0.3, 1.2, 0.0), (0.0, 0.0, 0.8), GRAY, name="thin wall")
    return scene.snapshot()


def glossy_room() -> core.Scene:
    """Rough-glossy walls, a metal wall and a metal ball of roughness 0.3, lit from the side."""
    scene = SceneDescription()
    coated = principled((0.4, 0.4, 0.5), specular=0.5, roughness=0.35)
    metal = principled((0.9, 0.7, 0.4), metallic=1.0, roughness=0.3)
    room(scene, floor=coated, back=metal, left=coated)
    scene.add_sphere(0.4, metal, (-0.4, 0.1, 0.4), rings=12)
    scene.builder.add_area_light(
        "panel", (0.9, -0.6, 1.0), (0.0, 1.4, 0.0), (0.0, 0.0, 1.2), (-1.0, 0.0, 0.0), (2.5, 2.0, 1.5),
        visibility=NOT_TO_CAMERA,
    )  # fmt: skip
    return scene.snapshot()


def mirror_room() -> core.Scene:
    """A mirror, a mirroring ball and a glass ball: rough points seen through smooth ones, smooth ones met by paths."""
    scene = SceneDescription()
    mirror = principled((0.9, 0.9, 0.9), metallic=1.0, roughness=0.0)
    room(scene, right=mirror, floor=principled((0.5, 0.5, 0.6), specular=0.5, roughness=0.0))
    lamp_to_ceiling(scene)
    scene.add_sphere(0.35, mirror, (-0.5, 0.3, 0.35), rings=12)
    glass = principled((1.0, 1.0, 1.0), specular=0.5, roughness=0.0, transmission=1.0)
    scene.add_sphere(0.3, glass, (0.35, -0.5, 0.3), rings=12)
    return scene.snapshot()


def panes() -> core.Scene:
    """Half transparent and tinted panes between the points; coarse meshes with smooth normals."""
    scene = SceneDescription()
    room(scene)
    lamp_to_ceiling(scene, 8.0)
    scene.add_quad((-0.7, -0.5, 0.7), (1.2, 0, 0.2), (0, 1.0, 0), principled((0.9, 0.4, 0.2), alpha=0.5), name="half")
    scene.add_quad((0.3, -0.8, 0.1), (0.0, 1.4, 0.0), (0, 0, 1.0), transparent((0.9, 0.5, 0.3)), name="tinted")
    scene.add_sphere(0.35, principled((0.8, 0.8, 0.8), specular=0.5, roughness=0.5), (-0.4, -0.1, 0.35), rings=4)
    scene.add_sphere(0.3, principled((0.7, 0.6, 0.5)), (0.6, 0.3, 0.3), rings=3)
    return scene.snapshot()


def leaning() -> core.Scene:
    """Lobes whose normals lean away from their surfaces, and surfaces that scatter to both sides."""
    scene = SceneDescription()
    bumpy = core.MaterialProgram("bumpy")
    bumpy.closure(
        "CLOSURE_DIFFUSE",
        [bumpy.constant(1.0), bumpy.constant(0.8, 0.7, 0.6), bumpy.constant(0.0), bumpy.constant(0.8, 0.0, 0.6)],
    )
    room(scene, floor=bumpy)
    lamp_to_ceiling(scene)
    scene.add_quad((-0.9, -0.2, 0.3), (0.8, 0, 0), (0, 0.8, 0.4), leaning_lobes(), name="leaning")
    rough_glass = principled((0.9, 0.95, 1.0), specular=0.5, roughness=0.5, transmission=1.0)
    scene.add_sphere(0.35, rough_glass, (0.4, 0.0, 0.5), rings=8)
    return scene.snapshot()


def open_scene() -> core.Scene:
    """Few things under a sky: most paths meet nothing else. Two lamps stop shining after some bounces."""
    scene = SceneDescription()
    scene.add_quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), GRAY, name="floor")
    scene.add_quad((-0.8, 0.6, 0.0), (1.6, 0, 0), (0, 0, 1.2), RED, name="wall")
    scene.add_sphere(0.4, principled((0.7, 0.7, 0.7), specular=0.5, roughness=0.4), (0.5, -0.1, 0.4), rings=10)
    scene.builder.add_area_light(
        "first bounce", (-1.2, -0.4, 0.7), (0, 0.8, 0), (0, 0, 0.8), (1.0, 0.0, 0.0), (4.0, 3.5, 3.0),
        visibility=NOT_TO_CAMERA, max_bounces=1,
    )  # fmt: skip
    point_on(scene, (0.9, -0.7, 0.9), 0.2, (0.2, 0.3, 0.4))
    sky(scene, 0.1, 0.6)
    scene.set_camera((0.0, -3.4, 1.6), (0.0, 0.1, 0.4), half_width=0.42)
    return scene.snapshot()


def counting_lamp() -> core.Scene:
    """A lamp that shines on what paths meet first, and no further."""
    scene = SceneDescription()
    room(scene)
    lamp_to_ceiling(scene, max_bounces=1)
    return scene.snapshot()


def hidden_objects() -> core.Scene:
    """Walls that only some kinds of scattered ray see, between surfaces that scatter several kinds."""
    scene = SceneDescription()
    mixed = principled((0.5, 0.5, 0.6), specular=0.8, roughness=0.4)
    polished = principled((0.5, 0.4, 0.4), specular=1.0, roughness=0.1)
    room(scene, floor=mixed, back=polished, left=mixed)
    lamp_to_ceiling(scene)
    tinted = transparent((0.9, 0.4, 0.2))
    for x, name, material, visibility in (
        (-0.6, "not to diffuse", RED, VISIBLE_TO_ALL & ~DIFFUSE),
        (-0.2, "not to glossy", GREEN, VISIBLE_TO_ALL & ~GLOSSY),
        (0.2, "no shadow", GRAY, VISIBLE_TO_ALL & ~SHADOW),
        (0.6, "pane to glossy", tinted, CAMERA | GLOSSY | SHADOW),
    ):
        scene.add_quad((x, -0.5, 0.0), (0.15, 0.9, 0.0), (0.0, 0.0, 0.9), material, name=name, visibility=visibility)
    rough_glass = principled((0.9, 0.95, 1.0), specular=0.5, roughness=0.5, transmission=1.0)
    scene.add_sphere(0.25, rough_glass, (0.0, 0.5, 0.5), rings=8)
    return scene.snapshot()


def glowing_room() -> core.Scene:
    """Surfaces that glow and reflect: paths meet them as lamps and as sample points, also by way of a mirror."""
    scene = SceneDescription()
    shade = principled((0.7, 0.5, 0.3), emission=0.4)
    coated = principled((0.4, 0.4, 0.5), specular=0.5, roughness=0.4)
    room(scene, floor=coated, left=principled((0.8, 0.3, 0.2), emission=0.15))
    scene.add_quad(
        (-0.3, 0.4, 0.0), (0.9, 0.2, 0.0), (0.0, 0.0, 0.9), principled((0.9,) * 3, metallic=1.0, roughness=0.0)
    )
    scene.add_sphere(0.35, shade, (-0.4, -0.3, 0.4), rings=8)
    scene.add_sphere(
        0.3, principled((0.6, 0.7, 0.8), metallic=1.0, roughness=0.4, emission=0.2), (0.5, -0.3, 0.9), rings=8
    )
    return scene.snapshot()


def harsh_room(strength: float = 1.0) -> core.Scene:
    """Unkind to arithmetic: surfaces that lie in each other or meet under a degree, slivers, black and white walls,
    lobes just rough enough to reuse, a point lamp near a wall and lamps 10^12 apart in strength."""
    scene = SceneDescription()
    rough_enough = principled((1.0, 1.0, 1.0), metallic=1.0, roughness=0.2)
    room(scene, floor=principled((1.0, 1.0, 1.0)), back=rough_enough, left=principled((0.0, 0.0, 0.0)))
    lamp_to_ceiling(scene, strength)
    scene.add_quad((-0.5, -0.5, 0.0), (1.0, 0, 0), (0, 1.0, 0), GRAY, name="in the floor")
    scene.add_quad((-0.8, 0.0, 0.0), (1.6, 0, 0), (0, 0.5, 0.005), GREEN, name="wedge")
    scene.add_quad((0.2, -0.6, 0.0), (1e-5, 0, 0), (0, 0, 1.0), RED, name="sliver")
    scene.add_sphere(0.3, principled((0.9, 0.9, 1.0), specular=1.0, roughness=0.2, transmission=1.0), (0.5, 0, 0.3))
    point_on(scene, (0.0, 0.999, 1.0), 1e-4, (strength, strength, strength))
    point_on(scene, (0.6, -0.6, 1.0), 0.0, (1e-12 * strength, 1e-12 * strength, 1e-12 * strength))
    return scene.snapshot()


def colored_stripes() -> core.Scene:
    """A floor of red and white stripes between green walls under a white sky. Red light is all that the red ones
    reflect, green all of the walls: a path from one to the other shows nothing, and yet white stripes may use it."""
    scene = SceneDescription()
    red, green, white = (principled(color) for color in ((0.9, 0.0, 0.0), (0.0, 0.9, 0.0), (0.9, 0.9, 0.9)))
    stripes = 8
    for i in range(stripes):
        scene.add_quad((-1 + 2 * i / stripes, -1, 0), (2 / stripes, 0, 0), (0, 2, 0), red if i % 2 else white)
    scene.add_quad((-1, 1, 0), (0, 0, 2), (2, 0, 0), green)
    scene.add_quad((-1, -1, 0), (2, 0, 0), (0, 0, 2), green)
    scene.add_quad((-1, -1, 0), (0, 0, 2), (0, 2, 0), green)
    scene.add_quad((1, -1, 0), (0, 2, 0), (0, 0, 2), green)
    scene.set_environment((1, 1, 1))
    scene.set_camera((0, 0, 6), (0, 0, 0), 0.16)
    return scene.snapshot()


SCENES: dict[str, Callable[[], core.Scene]] = {
    make.__name__: make
    for make in (
        indirect_room,
        glossy_room,
        mirror_room,
        panes,
        leaning,
        open_scene,
        counting_lamp,
        hidden_objects,
        colored_stripes,
        glowing_room,
    )
}
