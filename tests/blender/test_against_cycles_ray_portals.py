"""Ray portals against Cycles; method as in test_against_cycles_lights."""

from collections.abc import Callable, Sequence

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles
from tests.support.slow_cases import marked

pytestmark = pytest.mark.usefixtures("registered_addon")

WARM = (0.9, 0.7, 0.4, 1.0)
RED = (0.8, 0.2, 0.1, 1.0)
Socket = bpy.types.NodeSocket


def moved(tree: build.Nodes, by: Sequence[float]) -> Socket:
    """Where the surface is, and so far from there."""
    place, add = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeVectorMath")
    add.operation = "ADD"
    add.inputs[1].default_value = by
    tree.links.new(place.outputs["Position"], add.inputs[0])
    return add.outputs[0]


def turned(tree: build.Nodes, by: Sequence[float]) -> Socket:
    """On from where the ray comes from, and so much aside."""
    seen, math = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeVectorMath")
    math.operation = "MULTIPLY_ADD"
    math.inputs[1].default_value = (-1.0, -1.0, -1.0)
    math.inputs[2].default_value = by
    tree.links.new(seen.outputs["Incoming"], math.inputs[0])
    return math.outputs[0]


def portal(tree: build.Nodes, **inputs: object) -> Socket:
    return build.shader(tree, "ShaderNodeBsdfRayPortal", **inputs).outputs[0]


def beside_diffuse(tree: build.Nodes, **inputs: object) -> Socket:
    """Not beside transparent: there Cycles finds light behind by light samples and again by scattered rays."""
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.4
    tree.links.new(portal(tree, **inputs), mix.inputs[1])
    tree.links.new(build.shader(tree, "ShaderNodeBsdfDiffuse", Color=RED).outputs[0], mix.inputs[2])
    return mix.outputs[0]


def two(tree: build.Nodes) -> Socket:
    add = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(portal(tree, Color=(0.5, 0.2, 0.1, 1.0), Position=moved(tree, (0.0, 0.0, 2.0))), add.inputs[0])
    tree.links.new(portal(tree, Color=(0.1, 0.2, 0.6, 1.0), Direction=(0.3, 0.2, 1.0)), add.inputs[1])
    return add.outputs[0]


def dimmer_by_depth(tree: build.Nodes) -> Socket:
    """Of rays that have come through one already less."""
    path, power = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMath")
    power.operation = "POWER"
    power.inputs[0].default_value = 0.4
    tree.links.new(path.outputs["Portal Depth"], power.inputs[1])
    return portal(tree, Color=power.outputs[0], Position=moved(tree, (0.0, 0.5, 0.0)))


PORTALS: dict[str, Callable[[build.Nodes], Socket]] = {
    "straight on": lambda tree: portal(tree, Color=WARM),
    "to the sky": lambda tree: portal(tree, Color=WARM, Direction=(0.1, 0.2, 1.0)),
    "from above": lambda tree: portal(tree, Color=WARM, Position=moved(tree, (0.0, 0.0, 1.5))),
    "into itself": lambda tree: portal(tree, Color=WARM, Position=moved(tree, (-0.3, 0.2, 0.1))),
    "bent": lambda tree: portal(tree, Color=WARM, Direction=turned(tree, (0.3, 0.0, 0.2))),
    "beside diffuse": lambda tree: beside_diffuse(tree, Position=moved(tree, (0.0, 0.0, 1.5))),
    "two": two,
    "by depth": dimmer_by_depth,
}
SLOW = {"into itself", "two"}


@pytest.mark.parametrize("case", marked(PORTALS, SLOW))
def test_ball(empty_scene: bpy.types.Scene, case: str) -> None:
    if case == "by depth" and bpy.app.version < (5, 0, 0):
        pytest.skip("this Blender does not tell how many portals a path has passed")
    build.stage(empty_scene, build.material("ball", PORTALS[case]))
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


@pytest.mark.parametrize("preset", ["FINAL", "WORLD_PATHS", "RESTIR_GI", "CELL_RESERVOIRS", "RESTIR_DI"])
def test_presets(empty_scene: bpy.types.Scene, preset: str) -> None:
    build.stage(empty_scene, build.material("ball", PORTALS["beside diffuse"]))
    result = compare_with_cycles(empty_scene, preset=preset)
    assert result.agrees, result


def test_lamps_shine_through_by_scattered_rays_alone(empty_scene: bpy.types.Scene) -> None:
    """Into the shade of a screen."""
    build.stage(empty_scene, build.principled("ball", Base_Color=RED))
    screen = build.material("screen", lambda tree: portal(tree, Color=WARM, Position=moved(tree, (0.0, 0.0, 0.8))))
    build.add_mesh(
        empty_scene, "screen", [(-2, -2, 1.2), (2, -2, 1.2), (2, 2, 1.2), (-2, 2, 1.2)], [(0, 1, 2, 3)], screen
    )
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


def test_the_film_shows_through(empty_scene: bpy.types.Scene) -> None:
    build.stage(empty_scene, build.material("ball", PORTALS["to the sky"]))
    empty_scene.render.film_transparent = True
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


@pytest.mark.parametrize("most", [0, 1, 2])
def test_portals_are_transparent_bounces(empty_scene: bpy.types.Scene, most: int) -> None:
    build.stage(empty_scene, build.material("ball", PORTALS["straight on"]))
    empty_scene.cycles.transparent_max_bounces = most
    result = compare_with_cycles(empty_scene)
    assert result.agrees, result


@pytest.mark.parametrize("name, value", [("Color", (0.85, 0.7, 0.4, 1.0)), ("Direction", (0.4, 0.2, 1.0))])
def test_planted_bugs(empty_scene: bpy.types.Scene, name: str, value: Sequence[float]) -> None:
    surface = build.material("ball", PORTALS["to the sky"])
    build.stage(empty_scene, surface, world=dict(color=(0.6, 0.7, 1.0)))

    def plant(scene: bpy.types.Scene) -> None:
        node = next(n for n in surface.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfRayPortal")
        node.inputs[name].default_value = value

    result = compare_with_cycles(empty_scene, plant=plant)
    assert not result.agrees, result
