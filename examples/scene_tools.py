"""What the scripts that build scenes share: an empty scene, plain materials and shapes, placing things, saving, and the
command line."""

import argparse
import os
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

from cistern_hall.shapes import Shape, box, patch

Colour = tuple[float, float, float]
Place = tuple[float, float, float]


def empty_scene() -> bpy.types.Scene:
    """Replaces what is open in Blender by an empty scene without a world."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True, load_ui=False)
    bpy.context.scene.world = None
    return bpy.context.scene


def surface(name: str, kind: str, **inputs: object) -> bpy.types.Material:
    """A material of one closure; inputs by the names of its sockets with underscores for blanks."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    closure = tree.nodes.new(kind)
    for socket, value in inputs.items():
        closure.inputs[socket.replace("_", " ")].default_value = value
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(closure.outputs[0], output.inputs["Surface"])
    return material


def matt(name: str, colour: Colour) -> bpy.types.Material:
    """Lambertian, of this albedo."""
    return surface(name, "ShaderNodeBsdfDiffuse", Color=(*colour, 1.0))


def glow(name: str, colour: Colour, strength: float) -> bpy.types.Material:
    """Emits `colour` x `strength` W/(m2 sr) from its front and reflects nothing: the panes of a lantern would else
    waste half their samples on its inside."""
    material = surface(name, "ShaderNodeEmission", Color=(*colour, 1.0))
    tree = material.node_tree
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    geometry, front = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeMath")
    front.operation = "MULTIPLY_ADD"
    front.inputs[1].default_value, front.inputs[2].default_value = -strength, strength
    tree.links.new(geometry.outputs["Backfacing"], front.inputs[0])
    tree.links.new(front.outputs[0], emission.inputs["Strength"])
    return material


def place(scene: bpy.types.Scene, name: str, what: bpy.types.ID, at: Place, turn: float = 0.0) -> bpy.types.Object:
    """A mesh or light as an object, turned about Z (radians)."""
    thing = bpy.data.objects.new(name, what)
    thing.location = at
    thing.rotation_euler = (0.0, 0.0, turn)
    scene.collection.objects.link(thing)
    return thing


def block(low: Place, high: Place) -> Shape:
    """A box between two corners, its edges hardly broken."""
    size, middle = np.subtract(high, low), 0.5 * np.add(low, high)
    return box(tuple(size), 0.02 * float(size.min())).moved(middle)


def ground(low: tuple[float, float], high: tuple[float, float], height: float = 0.0, tile: float = 1.0) -> Shape:
    """A level rectangle that faces up, with UVs that repeat every `tile` metres."""
    (x0, y0), (x1, y1) = low, high
    corners = np.array([[(x0, y0, height), (x1, y0, height)], [(x0, y1, height), (x1, y1, height)]])
    return patch(corners, ((x1 - x0) / tile, (y1 - y0) / tile))


def upright_quad(corner: Place, along: float, up: float, turn: float = 0.0, tile: float = 1.0) -> Shape:
    """A rectangle that faces -Y before it is turned about Z, with UVs that repeat every `tile` metres."""
    x, y, z = corner
    rows = [[(x, y, z), (x + along, y, z)], [(x, y, z + up), (x + along, y, z + up)]]
    return patch(np.array(rows), (along / tile, up / tile)).moved(turn=turn)


def sphere_light(name: str, colour: Colour, power_w: float, radius: float) -> bpy.types.Light:
    light = bpy.data.lights.new(name, "POINT")
    light.color, light.energy, light.shadow_soft_size = colour, power_w, radius
    return light


def aim_camera(scene: bpy.types.Scene, eye: Place, target: Place, lens_mm: float) -> None:
    """Gives the scene a camera at `eye` that looks at `target`, upright."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_start, data.clip_end = lens_mm, 0.05, 5000.0
    camera = place(scene, "Camera", data, (0.0, 0.0, 0.0))
    direction = Vector(target) - Vector(eye)
    camera.matrix_world = Matrix.Translation(eye) @ direction.to_track_quat("-Z", "Y").to_matrix().to_4x4()
    scene.camera = camera


def set_picture(scene: bpy.types.Scene) -> None:
    """The shape and the view of all these scenes' pictures."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 960, 540, 100
    scene.view_settings.view_transform = "AgX"


def save(path: Path) -> None:
    """Saves what is open in Blender; the file gets its name when it is whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".partial-{os.getpid()}.blend")
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(partial), copy=True, compress=True)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def count_between(low: int, high: int) -> Callable[[str], int]:
    """A type for argparse."""

    def parse(text: str) -> int:
        if not low <= int(text) <= high:
            raise argparse.ArgumentTypeError(f"{text} is not between {low} and {high}")
        return int(text)

    return parse


def argument_parser(description: str, name: str) -> argparse.ArgumentParser:
    """For a script that writes a scene; more options may be added."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("blend", nargs="?", type=Path, default=Path(f"out/{name}.blend"))
    return parser


def run_script(description: str, name: str, build: Callable[[bpy.types.Scene], None]) -> None:
    """All of a script that builds one scene without options."""
    blend = argument_parser(description, name).parse_args().blend
    build(empty_scene())
    save(blend)
    print(f"Wrote {blend}")
