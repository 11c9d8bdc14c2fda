"""The Particle Info node against Cycles: what instances of particles read of them, one output to a picture.

Cards shine evenly: what is compared are numbers, within rounding of single precision."""

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = pytest.mark.usefixtures("registered_addon")

ROUNDING = 1e-4
# Outputs and by what they are divided: all are about 1.
OUTPUTS = {
    **{"Index": 10.0, "Random": 1.0, "Age": 10.0, "Lifetime": 50.0, "Size": 1.0},
    **{"Location": 3.0, "Velocity": 1.0, "Angular Velocity": 1.0},
}


def shining(output: str, kind: str) -> bpy.types.Material:
    def make(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        node = tree.nodes.new("ShaderNodeParticleInfo")
        scaled = tree.nodes.new("ShaderNodeVectorMath")
        scaled.operation, scaled.inputs["Scale"].default_value = "SCALE", 1.0 / OUTPUTS[output]
        tree.links.new(node.outputs[output], scaled.inputs[0])
        lifted = build.shader(tree, "ShaderNodeVectorMath", Vector=scaled.outputs[0])
        lifted.inputs[1].default_value = (1.0, 1.0, 1.0)  # negative light is another test's
        return build.shader(tree, "ShaderNodeEmission", Color=lifted.outputs[0]).outputs[0]

    return build.material(kind, make)


def particles(scene: bpy.types.Scene, output: str, shows: str = "OBJECT") -> bpy.types.ParticleSettings:
    """Cards that fly off a floor, by their tenth frame; and one that no particle shows."""
    points = [(-0.2, -0.2, 0.0), (0.2, -0.2, 0.0), (0.2, 0.2, 0.0), (-0.2, 0.2, 0.0)]
    card = build.add_mesh(scene, "card", points, [(0, 1, 2, 3)], shining(output, "card"))
    card.location = (-1.5, 1.5, 0.0)
    floor = build.add_mesh(scene, "floor", [(x * 4, y * 4, 0) for x, y, _ in points], [(0, 1, 2, 3)])
    floor.modifiers.new("particles", "PARTICLE_SYSTEM")
    settings = floor.particle_systems[0].settings
    settings.count, settings.frame_start, settings.frame_end = 24, 1.0, 8.0
    settings.lifetime, settings.lifetime_random = 60.0, 0.5
    settings.normal_factor, settings.factor_random = 2.0, 1.5
    settings.use_rotations, settings.angular_velocity_mode, settings.angular_velocity_factor = True, "RAND", 1.0
    settings.particle_size, settings.size_random = 1.6, 0.5
    settings.render_type = shows
    if shows == "OBJECT":
        settings.instance_object = card
    else:
        group = bpy.data.collections.new("cards")
        group.objects.link(card)
        settings.instance_collection = group
    camera = build.add_camera(scene, (0.0, 0.0, 8.0), (0.0, 0.0, 0.0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 5.0
    for frame in range(1, 11):  # caches of particles go frame by frame
        scene.frame_set(frame)
    return settings


@pytest.mark.parametrize("output", OUTPUTS)
def test_outputs(empty_scene, output):
    particles(empty_scene, output)
    assert compare_with_cycles(empty_scene, samples=16, count=4, blocks=12, floor=ROUNDING).agrees


def test_particles_that_show_a_collection(empty_scene):
    particles(empty_scene, "Random", "COLLECTION")
    assert compare_with_cycles(empty_scene, samples=16, count=4, blocks=12, floor=ROUNDING).agrees


@pytest.mark.parametrize("output", ["Age", "Location", "Index"])
def test_other_particles_are_seen(empty_scene, output):
    """Planted: another frame in the picture of Cycles, or other particles."""
    settings = particles(empty_scene, output)

    def plant(scene: bpy.types.Scene) -> None:
        settings.count = 23
        for frame in range(1, 11):
            scene.frame_set(frame)

    assert not compare_with_cycles(empty_scene, samples=16, count=4, blocks=12, floor=ROUNDING, plant=plant).agrees


def emitter_coordinate(what: str) -> bpy.types.Material:
    """Shines by where on a surface an instance sits."""

    def make(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        node = tree.nodes.new("ShaderNodeUVMap" if what == "UV Map" else "ShaderNodeTexCoord")
        node.from_instancer = True
        lifted = build.shader(tree, "ShaderNodeVectorMath", Vector=node.outputs["UV" if what == "UV Map" else what])
        lifted.inputs[1].default_value = (1.0, 1.0, 1.0)  # negative light is another test's
        return build.shader(tree, "ShaderNodeEmission", Color=lifted.outputs[0]).outputs[0]

    return build.material("card", make)


def emitter(scene: bpy.types.Scene, what: str, shows: str) -> bpy.types.Object:
    """A grid whose particles, faces or points show cards; and a card that is itself."""
    points = [(-0.2, -0.2, 0.0), (0.2, -0.2, 0.0), (0.2, 0.2, 0.0), (-0.2, 0.2, 0.0)]
    card = build.add_mesh(scene, "card", points, [(0, 1, 2, 3)], emitter_coordinate(what))
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=6, y_subdivisions=5, size=3.0)
    grid = bpy.context.object
    if shows == "PARTICLES":
        card.location = (-1.5, 1.7, 0.0)
        grid.modifiers.new("particles", "PARTICLE_SYSTEM")
        settings = grid.particle_systems[0].settings
        settings.count, settings.frame_end, settings.physics_type = 40, 1.0, "NO"
        settings.render_type, settings.instance_object, settings.particle_size = "OBJECT", card, 1.0
        for frame in (1, 2):
            scene.frame_set(frame)
    else:
        card.parent, grid.instance_type = grid, shows
    camera = build.add_camera(scene, (0.0, 0.0, 8.0), (0.0, 0.0, 0.0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 5.0
    return grid


@pytest.mark.parametrize("shows", ["PARTICLES", "FACES", "VERTS"])
@pytest.mark.parametrize("what", ["Generated", "UV", "UV Map"])
def test_coordinates_from_the_instancer(empty_scene, what: str, shows: str):
    emitter(empty_scene, what, shows)
    assert compare_with_cycles(empty_scene, samples=16, count=4, blocks=12, floor=ROUNDING).agrees


@pytest.mark.parametrize("shows", ["PARTICLES", "FACES"])
def test_other_coordinates_from_the_instancer_are_seen(empty_scene, shows: str):
    """Planted: in the picture of Cycles they are those of another output."""
    emitter(empty_scene, "UV", shows)
    node = next(n for n in bpy.data.materials["card"].node_tree.nodes if n.bl_idname == "ShaderNodeTexCoord")

    def plant(_: bpy.types.Scene) -> None:
        link = node.outputs["UV"].links[0]
        bpy.data.materials["card"].node_tree.links.new(node.outputs["Generated"], link.to_socket)

    assert not compare_with_cycles(empty_scene, samples=16, count=4, blocks=12, floor=ROUNDING, plant=plant).agrees
