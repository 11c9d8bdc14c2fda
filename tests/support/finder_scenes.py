"""Small scenes whose light reaches a floor by ways that only some of its finders have: through panes, films and half
transparent surfaces, or by surfaces that look different from elsewhere. All are meant for square pictures of 16 pixels;
floors fill them exactly, and a floor of STRIPS strips has as many groups of two columns of pixels.
"""

from __future__ import annotations

import random
from collections.abc import Callable

import cistern_core as core
import numpy as np

from tests.support.core_scenes import CAMERA, SHADOW, TRANSMISSION, VISIBLE_TO_ALL, Color, SceneDescription, principled
from tests.support.direct_light_scenes import NOT_TO_CAMERA, point_on, transparent
from tests.support.path_scenes import room

STRIPS = 8
WHITE = principled((0.8, 0.8, 0.8))
METAL = principled((0.8, 0.8, 0.8), metallic=1.0, roughness=0.25)
CLEAR = transparent((1.0, 1.0, 1.0))
HIDDEN = VISIBLE_TO_ALL & ~CAMERA
"""From the camera: what hangs over the floor does not cover it in the picture."""

AddClosure = Callable[[core.MaterialProgram, int], None]


def look_down(scene: SceneDescription) -> None:
    """On the square from (-1, -1, 0) to (1, 1, 0)."""
    scene.set_camera((0, 0, 6), (0, 0, 0), half_width=1 / 6)


def add_floor(
    scene: SceneDescription, even: core.MaterialProgram = WHITE, odd: core.MaterialProgram | None = None
) -> None:
    width = 2 / STRIPS
    for k in range(STRIPS):
        scene.add_quad((-1 + k * width, -1, 0), (width, 0, 0), (0, 2, 0), odd if odd and k % 2 else even)


def add_ceiling(scene: SceneDescription, height: float, material: core.MaterialProgram) -> None:
    """Over the floor, facing down."""
    scene.add_quad((-1, -1, height), (0, 2, 0), (2, 0, 0), material, visibility=HIDDEN)


def add_walls(scene: SceneDescription, material: core.MaterialProgram, height: float = 2.0) -> None:
    """Four around the floor, facing inward."""
    up = (0, 0, height)
    scene.add_quad((-1, 1, 0), up, (2, 0, 0), material)
    scene.add_quad((-1, -1, 0), (2, 0, 0), up, material)
    scene.add_quad((-1, -1, 0), up, (0, 2, 0), material)
    scene.add_quad((1, -1, 0), (0, 2, 0), up, material)


def under_sky(scene: SceneDescription) -> core.Scene:
    scene.set_environment((1, 1, 1))
    look_down(scene)
    return scene.snapshot()


def lamp_behind_panes(panes: int) -> core.Scene:
    """A glowing surface that passes 30 % of light, over a floor; clear panes between them take away nothing."""
    scene = SceneDescription()
    add_floor(scene)
    flame = core.MaterialProgram("flame")
    one = flame.constant(1.0)
    flame.closure("CLOSURE_EMISSION", [one, flame.constant(3, 3, 3), one])
    flame.closure("CLOSURE_TRANSPARENT", [one, flame.constant(0.3, 0.3, 0.3)])
    scene.add_quad((-0.3, -0.3, 1), (0, 0.6, 0), (0.6, 0, 0), flame, visibility=HIDDEN)
    for k in range(panes):
        scene.add_quad((-1.5, -1.5, 0.5 + 0.05 * k), (3, 0, 0), (0, 3, 0), CLEAR, visibility=HIDDEN)
    look_down(scene)
    return scene.snapshot()


def foliage(leaves: int) -> core.Scene:
    """White leaves of alpha 0.35, turned at random, in the two metres over a floor under a white sky."""
    numbers = random.Random(3)
    scene = SceneDescription()
    scene.add_quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), WHITE)
    leaf = principled((0.9, 0.9, 0.9), alpha=0.35)

    def direction() -> np.ndarray:
        return np.array([numbers.gauss(0, 1) for _ in range(3)])

    for _ in range(leaves):
        corner = (numbers.uniform(-1, 1), numbers.uniform(-1, 1), numbers.uniform(0.2, 1.6))
        along = direction()
        along /= np.linalg.norm(along)
        across = np.cross(along, direction())
        across /= np.linalg.norm(across)
        scene.add_quad(corner, tuple(0.4 * along), tuple(0.4 * across), leaf)
    scene.set_environment((1, 1, 1))
    scene.set_camera((0, -4, 2), (0, 0, 0.8), half_width=0.3)
    return scene.snapshot()


def translucent_strips() -> core.Scene:
    """Every second strip of the floor lets light through diffusely and reflects none."""
    scene = SceneDescription()
    translucent = core.MaterialProgram("translucent")
    color = translucent.constant(0.8, 0.8, 0.8)
    translucent.closure("CLOSURE_TRANSLUCENT", [translucent.constant(1.0), color, translucent.emit("NORMAL")])
    add_floor(scene, odd=translucent)
    add_walls(scene, WHITE)
    return under_sky(scene)


def film_over_strips(film: Color) -> core.Scene:
    """Red and white strips below a film of the given transparency, in a white box without a lid."""
    scene = SceneDescription()
    white = principled((0.9, 0.9, 0.9))
    add_floor(scene, even=white, odd=principled((0.9, 0.0, 0.0)))
    add_walls(scene, white)
    scene.add_quad((-1, -1, 0.3), (2, 0, 0), (0, 2, 0), transparent(film), visibility=HIDDEN)
    return under_sky(scene)


def frosted_glass(roughness: float) -> core.MaterialProgram:
    return principled((1.0, 1.0, 1.0), specular=0.5, roughness=roughness, transmission=1.0)


def frosted_refraction(roughness: float) -> core.MaterialProgram:
    p = core.MaterialProgram("refraction")
    operands = [p.constant(1.0), p.constant(0.9, 0.9, 0.9), p.constant(roughness), p.constant(1.5), p.emit("NORMAL")]
    p.closure("CLOSURE_REFRACTION", operands, [0])
    return p


def add_frosted_walls(scene: SceneDescription, frosted: core.MaterialProgram) -> None:
    """On three sides of the floor."""
    scene.add_quad((-1, 1, 0), (2, 0, 0), (0, 0, 1), frosted)
    scene.add_quad((-1, -1, 0), (0, 2, 0), (0, 0, 1), frosted)
    scene.add_quad((1, -1, 0), (0, 0, 1), (0, 2, 0), frosted)


def frosted_walls(frosted: core.MaterialProgram) -> core.Scene:
    """Lit from outside, by white walls that panels shine at."""
    scene = SceneDescription()
    add_floor(scene)
    add_frosted_walls(scene, frosted)
    up = np.array([0.0, 0.0, 1.5])
    for outward, along in (((-1, 0, 0), (0, 2, 0)), ((1, 0, 0), (0, 2, 0)), ((0, 1, 0), (2, 0, 0))):
        out, u = np.array(outward, np.float64), np.array(along, np.float64)
        panel = 2.0 * out + np.array([0.0, 0.0, 0.5])
        scene.builder.add_area_light("panel", panel, u, up, out, (6, 6, 6), visibility=NOT_TO_CAMERA)
        scene.add_quad(tuple(panel + 0.8 * out - u - up), tuple(2 * u), tuple(2 * up), WHITE)
    look_down(scene)
    return scene.snapshot()


def lamps_outside_frosted_walls(frosted: core.MaterialProgram) -> core.Scene:
    """Their light reaches the floor through the walls alone, chosen among at the walls."""
    scene = SceneDescription()
    add_floor(scene)
    add_frosted_walls(scene, frosted)
    for position in ((-2, 0, 0.5), (2, 0, 0.5), (0, 2, 0.5)):
        point_on(scene, position, 0.2, (3, 3, 3))
    look_down(scene)
    return scene.snapshot()


def diffuse(color: Color) -> AddClosure:
    return lambda p, weight: p.closure(
        "CLOSURE_DIFFUSE", [weight, p.constant(*color), p.constant(0.0), p.emit("NORMAL")]
    )


def mirror(color: Color, roughness: float) -> AddClosure:
    def add(p: core.MaterialProgram, weight: int) -> None:
        zero = p.constant(0.0)
        operands = [weight, p.constant(*color), p.constant(roughness), zero, zero, p.emit("NORMAL")]
        p.closure("CLOSURE_GLOSSY", [*operands, p.constant(0.0, 0.0, 0.0)], [0])

    return add


def see_through(color: Color) -> AddClosure:
    return lambda p, weight: p.closure("CLOSURE_TRANSPARENT", [weight, p.constant(*color)])


def walls_by_angle(steep: AddClosure, grazing: AddClosure) -> core.Scene:
    """Walls that are one thing where seen at less than 53 degrees from their normal, and another beyond."""
    greater_than, subtract = 14, 1
    p = core.MaterialProgram("by angle")
    facing = p.emit("LAYER_WEIGHT_FACING", [p.constant(0.5), p.emit("NORMAL")])  # 1 - |cos|
    is_grazing = p.emit("MATH", [facing, p.constant(0.4), p.constant(0.0)], [greater_than, 0])
    steep(p, p.emit("MATH", [p.constant(1.0), is_grazing, p.constant(0.0)], [subtract, 0]))
    grazing(p, is_grazing)
    scene = SceneDescription()
    add_floor(scene, principled((0.7, 0.7, 0.7)))
    add_walls(scene, p)
    return under_sky(scene)


def layered() -> core.MaterialProgram:
    """Sheen over coat over metal and a glossy base: most of it looks different from every side."""
    layers = dict(coat=0.7, coat_roughness=0.5, sheen=0.6)
    return principled((0.8, 0.6, 0.4), specular=0.5, roughness=0.4, metallic=0.3, **layers)


def clay() -> core.MaterialProgram:
    """Diffuse, and brighter towards the light."""
    p = core.MaterialProgram("clay")
    p.closure("CLOSURE_DIFFUSE", [p.constant(1.0), p.constant(0.9, 0.9, 0.9), p.constant(1.0), p.emit("NORMAL")])
    return p


def walls_of(material: core.MaterialProgram) -> core.Scene:
    scene = SceneDescription()
    add_floor(scene)
    add_walls(scene, material)
    return under_sky(scene)


def half_transparent_ceiling(alpha: float, lit_by_panel: bool) -> core.Scene:
    """Over the floor, lit by a panel from below or by the sky from above."""
    scene = SceneDescription()
    add_floor(scene)
    add_ceiling(scene, 0.8, principled((0.9, 0.9, 0.9), alpha=alpha))
    if not lit_by_panel:
        return under_sky(scene)
    scene.builder.add_area_light(
        "panel", (0, 0, 0.1), (1.6, 0, 0), (0, 1.6, 0), (0, 0, 1), (1, 1, 1), visibility=NOT_TO_CAMERA
    )
    look_down(scene)
    return scene.snapshot()


def panes_over_every_second_strip(over_strips: int, before_lamp: int, strips: int = STRIPS) -> core.Scene:
    """The light of a panel returns to the floor from a ceiling, through few panes or many: a limit on how many surfaces
    a path may pass stops it on some strips and not on others. Many strips: pixels have both."""
    scene = SceneDescription()
    add_floor(scene)
    add_ceiling(scene, 2.0, WHITE)
    pane, width = transparent((0.95, 0.95, 0.95)), 2 / strips
    for k in range(over_strips):
        for strip in range(1, strips, 2):
            corner = (-1 + strip * width, -1, 0.01 + 0.01 * k)
            scene.add_quad(corner, (width, 0, 0), (0, 2, 0), pane, visibility=HIDDEN)
    for k in range(before_lamp):
        scene.add_quad((-1, -1, 1.5 + 0.02 * k), (2, 0, 0), (0, 2, 0), pane, visibility=HIDDEN)
    scene.builder.add_area_light(
        "panel", (0, 0, 1.2), (1.5, 0, 0), (0, 1.5, 0), (0, 0, 1), (2, 2, 2), visibility=NOT_TO_CAMERA
    )
    look_down(scene)
    return scene.snapshot()


def leaning_metal() -> core.Scene:
    """A ceiling of rough metal, low over the floor, whose shading normals lean far to one side and to the other: seen
    from nearly everywhere below, lobes are bent back towards the view."""
    scene = SceneDescription()
    add_floor(scene)
    metal, lean = principled((0.9, 0.9, 0.9), metallic=1.0, roughness=0.7), np.radians(75.0)
    for k in range(4):
        left, sign = -1.0 + 0.5 * k, 1.0 if k % 2 else -1.0
        corners = [(left, -1, 0.2), (left, 1, 0.2), (left + 0.5, 1, 0.2), (left + 0.5, -1, 0.2)]
        normal = (sign * np.sin(lean), 0.0, -np.cos(lean))
        scene.add_mesh(corners, [(0, 1, 2, 3)], metal, name="leaning", visibility=HIDDEN, normals=[normal] * 4)
    return under_sky(scene)


def normals_beyond_the_horizon(strips: int) -> core.Scene:
    """A floor of thin strips, one as the other but for normals that lean by 84 degrees or by 96: those reflect nothing.
    Pixels have both."""
    scene, width = SceneDescription(), 2 / strips
    for k in range(strips):
        p, lean = core.MaterialProgram("leaning"), np.radians(96.0 if k % 2 else 84.0)
        normal = p.constant(np.sin(lean), 0.0, np.cos(lean))
        p.closure("CLOSURE_DIFFUSE", [p.constant(1.0), p.constant(0.8, 0.8, 0.8), p.constant(0.0), normal])
        scene.add_quad((-1 + k * width, -1, 0), (width, 0, 0), (0, 2, 0), p)
    add_walls(scene, WHITE, 1.0)
    return under_sky(scene)


def lamp_without_shadows(is_covered: bool, floor: core.MaterialProgram = WHITE) -> core.Scene:
    """A wide panel close over a floor, with a card between them or not."""
    scene = SceneDescription()
    add_floor(scene, floor)
    if is_covered:
        add_ceiling(scene, 0.3, WHITE)
    scene.builder.add_area_light(
        "panel", (0, 0, 0.6), (1.6, 0, 0), (0, 1.6, 0), (0, 0, -1), (1, 1, 1),
        visibility=NOT_TO_CAMERA, casts_shadow=False,
    )  # fmt: skip
    look_down(scene)
    return scene.snapshot()


def lamp_that_counts_bounces() -> core.Scene:
    """A panel in a closed room shines for none but paths that have bounced twice before. The camera looks along the
    room: the next vertices of paths lie among the points it sees."""
    multiply, greater_than, ray_depth = 2, 14, 8
    p = core.MaterialProgram("counts bounces")
    depth, zero = p.emit("LIGHT_PATH", [], [ray_depth]), p.constant(0.0)
    is_deep = p.emit("MATH", [depth, p.constant(2.5), zero], [greater_than, 0])
    strength = p.emit("MATH", [is_deep, p.constant(4.0), zero], [multiply, 0])
    p.closure("CLOSURE_EMISSION", [p.constant(1.0), p.constant(1.0, 1.0, 1.0), strength])
    scene = SceneDescription()
    room(scene)
    scene.add_quad((-0.6, -0.6, 1.9), (0, 1.2, 0), (1.2, 0, 0), p)
    return scene.snapshot()


def plastic_below_lamp(seen_by: int, use_mis: bool) -> core.Scene:
    """Red plastic with white highlights in the light of a panel that only some kinds of scattered rays see; without MIS
    light samples alone find it."""
    scene = SceneDescription()
    scene.add_quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), principled((0.9, 0.05, 0.05), specular=1.0, roughness=0.4))
    scene.builder.add_area_light(
        "panel", (0, 0, 0.6), (1.6, 0, 0), (0, 1.6, 0), (0, 0, -1), (1, 1, 1),
        visibility=seen_by | TRANSMISSION | SHADOW, use_mis=use_mis,
    )  # fmt: skip
    scene.set_camera((0, -2, 1.2), (0, 0, 0), half_width=0.3)
    return scene.snapshot()


def facing_of_waves(p: core.MaterialProgram) -> int:
    """Layer Weight's Facing of a surface with waves by bump alone, 0.3 m high and 0.7 m long, along x."""
    multiply, sine, filter_of_one_pixel = 2, 29, 4000
    zero = p.constant(0.0)
    heights = []
    for step in range(3):
        x = p.emit("SEPARATE_X", [p.emit("POSITION", [], [step + filter_of_one_pixel])])
        heights.append(
            p.emit("MATH", [p.emit("MATH", [x, p.constant(9.0), zero], [multiply, 0]), zero, zero], [sine, 0])
        )
    inputs = [*heights, p.constant(1.0), p.constant(0.3), p.emit("NORMAL")]
    return p.emit("LAYER_WEIGHT_FACING", [p.constant(0.5), p.emit("BUMP", inputs, [0, filter_of_one_pixel])])


def pane_with_waves() -> core.Scene:
    """Between a floor and the lit ceiling; clear where its waves do not face what sees it, black elsewhere."""
    scene = SceneDescription()
    add_floor(scene)
    add_ceiling(scene, 1.5, WHITE)
    pane = core.MaterialProgram("waves")
    pane.closure("CLOSURE_TRANSPARENT", [facing_of_waves(pane), pane.constant(1.0, 1.0, 1.0)])
    scene.add_quad((-2, -2, 0.5), (4, 0, 0), (0, 4, 0), pane, visibility=HIDDEN)
    scene.builder.add_area_light(
        "panel", (0, 0, 1), (1.6, 0, 0), (0, 1.6, 0), (0, 0, 1), (5, 5, 5), visibility=NOT_TO_CAMERA
    )
    look_down(scene)
    return scene.snapshot()


def glowing_waves(floor: core.MaterialProgram = WHITE) -> core.Scene:
    """A panel over a floor glows where its waves do not face what sees it."""
    scene = SceneDescription()
    add_floor(scene, floor)
    glow = core.MaterialProgram("glowing waves")
    one = glow.constant(1.0)
    glow.closure("CLOSURE_EMISSION", [one, glow.constant(1.0, 1.0, 1.0), facing_of_waves(glow)])
    add_ceiling(scene, 0.7, glow)
    look_down(scene)
    return scene.snapshot()
