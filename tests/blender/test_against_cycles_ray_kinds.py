"""Kinds of rays that surfaces scatter, as Light Path nodes tell them and lamps and worlds are hidden from them, against
Cycles; method as in test_against_cycles_lights."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support import engines
from tests.support.slow_cases import marked
from tests.support.statistics import compare_replicas

pytestmark = pytest.mark.usefixtures("registered_addon")

WHITE = (0.9, 0.8, 0.7, 1.0)
SURFACES = {
    "diffuse": ("ShaderNodeBsdfDiffuse", {}),
    "rough diffuse": ("ShaderNodeBsdfDiffuse", {"Roughness": 0.5}),
    "glossy": ("ShaderNodeBsdfAnisotropic", {"Roughness": 0.4}),
    "mirror": ("ShaderNodeBsdfAnisotropic", {"Roughness": 0.0}),
    "translucent": ("ShaderNodeBsdfTranslucent", {}),
    "refraction": ("ShaderNodeBsdfRefraction", {"Roughness": 0.0}),
    "rough refraction": ("ShaderNodeBsdfRefraction", {"Roughness": 0.4}),
    "glass": ("ShaderNodeBsdfGlass", {"Roughness": 0.0}),
}
SINGULAR = "Is Singular Ray"
OUTPUTS = ("Is Diffuse Ray", "Is Glossy Ray", "Is Transmission Ray")
SWITCHES = ("diffuse", "glossy", "transmission")


def surface(name: str) -> bpy.types.Material:
    kind, inputs = SURFACES[name]

    return build.material(name, lambda tree: build.shader(tree, kind, Color=WHITE, **inputs).outputs[0])


def sheet(scene: bpy.types.Scene, name: str) -> None:
    """Lying across the view, under nothing but a world that scattered rays alone look for."""
    build.add_floor(scene, surface(name), half=1.5)
    build.add_camera(scene, (0.0, -3.0, 3.0), (0.78, 0.0, 0.0))
    build.set_world(scene, (0.5, 0.6, 0.7), 1.0).cycles.sampling_method = "NONE"


def tell_kinds(world: bpy.types.World) -> None:
    """Its colour: by kind, the three of OUTPUTS in red, green and blue."""
    tree = world.node_tree
    path = tree.nodes.new("ShaderNodeLightPath")
    color = tree.nodes.new("ShaderNodeCombineColor")
    for output, channel in zip(OUTPUTS, color.inputs, strict=True):
        tree.links.new(path.outputs[output], channel)
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    tree.links.new(color.outputs[0], background.inputs["Color"])


def agree(scene: bpy.types.Scene) -> None:
    result = engines.compare_with_cycles(scene)
    assert result.agrees, result


@pytest.mark.parametrize("name", marked(SURFACES, set(SURFACES) - {"translucent", "glass", "rough refraction"}))
def test_light_path_nodes(empty_scene: bpy.types.Scene, name: str) -> None:
    sheet(empty_scene, name)
    tell_kinds(empty_scene.world)
    agree(empty_scene)


HIDDEN = {f"{name}, {switch}": (name, switch) for name in SURFACES for switch in SWITCHES}
# Cycles' light samples and scattered rays disagree: the first do not ask for transmission.
del HIDDEN["translucent, transmission"]


@pytest.mark.parametrize("case", marked(HIDDEN, set(HIDDEN) - {"translucent, diffuse", "glass, glossy"}))
def test_hidden_worlds(empty_scene: bpy.types.Scene, case: str) -> None:
    name, switch = HIDDEN[case]
    sheet(empty_scene, name)
    setattr(empty_scene.world.cycles_visibility, switch, False)
    agree(empty_scene)


@pytest.mark.parametrize("switch", SWITCHES)
def test_hidden_lamps_behind_translucent_surfaces(empty_scene: bpy.types.Scene, switch: str) -> None:
    """A lamp that light samples find."""
    sheet(empty_scene, "translucent")
    empty_scene.world = None
    lamp = build.add_light(empty_scene, "POINT", (0.0, 0.0, -1.0), energy=60.0, shadow_soft_size=0.1)
    setattr(lamp, f"visible_{switch}", False)
    agree(empty_scene)


@pytest.mark.parametrize("switch", SWITCHES)
def test_hidden_objects(empty_scene: bpy.types.Scene, switch: str) -> None:
    """What is let through is of the kind Transmission alone for them. Cycles' light samples count it as diffuse."""
    sheet(empty_scene, "translucent")
    glow = build.material("glow", lambda tree: build.shader(tree, "ShaderNodeEmission", Strength=2.0).outputs[0])
    glow.cycles.emission_sampling = "NONE"
    panel = build.add_floor(empty_scene, glow, half=2.0)
    panel.location.z = -1.0
    setattr(panel, f"visible_{switch}", False)
    agree(empty_scene)


LAMP_OUTPUTS = ("Is Camera Ray", "Is Diffuse Ray", "Is Glossy Ray", "Is Singular Ray", "Is Shadow Ray")


@pytest.mark.parametrize("output", marked(LAMP_OUTPUTS, {"Is Diffuse Ray", "Is Shadow Ray"}))
def test_lamps_know_no_kind(empty_scene: bpy.types.Scene, output: str) -> None:
    """A panel that shines on a mirror, and is in view, unless the ray is of that kind."""
    sheet(empty_scene, "mirror")
    empty_scene.world = None
    lamp = build.add_light(empty_scene, "AREA", (0.0, 0.5, 0.5), energy=20.0, size=1.0)
    lamp.rotation_euler, lamp.visible_camera = (-0.9, 0.0, 0.0), True
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    unless = build.shader(tree, "ShaderNodeMath", Value=1.0)
    unless.operation = "SUBTRACT"
    tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs[output], unless.inputs[1])
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    tree.links.new(unless.outputs[0], emission.inputs["Strength"])
    agree(empty_scene)
    assert engines.render(empty_scene, "CISTERN", 4, 1)[..., 0].max() > 0.5, "it is in view"


def test_shadow_rays_are_not_singular(empty_scene: bpy.types.Scene) -> None:
    """A card that lets through what is singular has a shadow where a mirror shows the floor, too."""
    build.add_floor(empty_scene, surface("diffuse"), half=3.0)
    wall = build.add_floor(empty_scene, surface("mirror"), half=3.0)
    wall.location, wall.rotation_euler = (0.0, 2.0, 0.0), (1.5708, 0.0, 0.0)

    def card(tree: build.Nodes) -> bpy.types.NodeSocket:
        node = build.shader(tree, "ShaderNodeMixShader", Fac=tree.nodes.new("ShaderNodeLightPath").outputs[SINGULAR])
        tree.links.new(build.shader(tree, "ShaderNodeBsdfDiffuse", Color=WHITE).outputs[0], node.inputs[1])
        tree.links.new(build.shader(tree, "ShaderNodeBsdfTransparent").outputs[0], node.inputs[2])
        return node.outputs[0]

    build.add_floor(empty_scene, build.material("card", card), half=0.7).location.z = 1.0
    lamp = build.add_light(empty_scene, "POINT", (0.0, 0.0, 3.0), energy=200.0, shadow_soft_size=0.1)
    lamp.visible_glossy = False
    build.add_camera(empty_scene, (0.0, -4.0, 1.0), (1.35, 0.0, 0.0))
    agree(empty_scene)


REUSE = ("FINAL", "WORLD_PATHS")


@pytest.mark.parametrize("preset", marked(REUSE, {"WORLD_PATHS"}))
def test_a_mix_beside_reuse(empty_scene: bpy.types.Scene, preset: str) -> None:
    """Lets light through by both kinds, and reflects by both: beside path tracing."""

    def mix(tree: build.Nodes) -> bpy.types.NodeSocket:
        node = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(build.shader(tree, "ShaderNodeBsdfTranslucent", Color=WHITE).outputs[0], node.inputs[1])
        glass = build.shader(tree, "ShaderNodeBsdfGlass", Color=WHITE, Roughness=0.6, IOR=1.3)
        tree.links.new(glass.outputs[0], node.inputs[2])
        return node.outputs[0]

    sheet(empty_scene, "diffuse")
    bpy.data.objects["floor"].data.materials[0] = build.material("mix", mix)
    wall = build.add_floor(empty_scene, surface("diffuse"), half=2.0)
    wall.location.z = -1.0
    tell_kinds(empty_scene.world)
    engines.prepare(empty_scene, 48, 48)
    alone = engines.replicas(empty_scene, "CISTERN", 6, 48, 4, first_seed=1001)
    empty_scene.cistern.preset = preset
    result = compare_replicas(engines.replicas(empty_scene, "CISTERN", 6, 24, 4), alone)
    assert result.agrees, result


def test_planted_bug(empty_scene: bpy.types.Scene) -> None:
    """Rays through a translucent sheet count as glossy instead of diffuse."""
    sheet(empty_scene, "translucent")
    tell_kinds(empty_scene.world)
    path = next(n for n in empty_scene.world.node_tree.nodes if n.type == "LIGHT_PATH")

    def plant(scene: bpy.types.Scene) -> None:
        diffuse = path.outputs["Is Diffuse Ray"].links[0].to_socket
        scene.world.node_tree.links.new(path.outputs["Is Glossy Ray"], diffuse)

    assert not engines.compare_with_cycles(empty_scene, plant=plant).agrees
