"""The scenes: what a lamp, a world and a few objects are on most days. Each is built into the empty scene it gets."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin

import bpy
import numpy as np

Place = tuple[float, float, float]
GREY, CLAY = (0.8, 0.8, 0.8, 1.0), (0.8, 0.3, 0.2, 1.0)
PLASTER = {"Base Color": (0.7, 0.7, 0.65, 1.0), "Roughness": 0.8}
PANE = "Pane"
GLASS = {"Transmission Weight": 1.0, "Roughness": 0.0}


def painted(**inputs: object) -> bpy.types.Material:
    """Principled; inputs by the names of their sockets with underscores for blanks."""
    material = bpy.data.materials.new("Paint")
    material.use_nodes = True
    sockets = material.node_tree.nodes["Principled BSDF"].inputs
    for name, value in inputs.items():
        sockets[name.replace("_", " ")].default_value = value
    return material


def add(operator: Callable, at: Place, scale: Place | float = 1.0, material: dict | None = None, **options: object):
    """What a mesh operator adds, with a Principled material of these inputs."""
    operator(location=at, **options)
    thing = bpy.context.object
    thing.scale = (scale,) * 3 if isinstance(scale, float) else scale
    thing.data.materials.append(painted(**(material or {"Base Color": GREY, "Roughness": 0.5})))
    if operator.idname_py() != "mesh.primitive_cube_add":
        bpy.ops.object.shade_smooth()
    return thing


def lamp(kind: str, at: Place, watts: float, turn: Place = (0.0, 0.0, 0.0), **settings: object) -> bpy.types.Light:
    data = bpy.data.lights.new("Lamp", kind)
    data.energy = watts
    for name, value in settings.items():
        setattr(data, name, value)
    thing = bpy.data.objects.new("Lamp", data)
    thing.location, thing.rotation_euler = at, turn
    bpy.context.scene.collection.objects.link(thing)
    return data


def world(radiance: float) -> bpy.types.ShaderNode:
    """Grey; returns its Background node."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    background.inputs["Strength"].default_value = radiance
    return background


def texture_world(kind: str, strength: float) -> bpy.types.ShaderNode:
    background = world(strength)
    tree = background.id_data
    texture = tree.nodes.new(kind)
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    return texture


def image_world(sun: float) -> None:
    """A picture of a sky that is lighter above than below, with a soft sun of this radiance."""
    height, width = 128, 256
    row, column = np.mgrid[0:height, 0:width]
    elevation, azimuth = (row / height - 0.5) * pi, column / width * 2.0 * pi
    sky = np.where(elevation > 0.0, 0.6 + 0.4 * np.sin(elevation), 0.15)[..., None] * np.array([0.7, 0.85, 1.0])
    away = (elevation - 0.7) ** 2 + ((azimuth - 2.0) * np.cos(elevation)) ** 2
    sky += sun * np.exp(-away / 0.002)[..., None]
    image = bpy.data.images.new("Sky", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels = np.concatenate([sky, np.ones((height, width, 1))], axis=2).astype(np.float32).ravel()
    image.pack()
    texture_world("ShaderNodeTexEnvironment", 1.0).image = image


def sky_world(elevation: float = 0.6, rotation: float = 0.0) -> None:
    sky = texture_world("ShaderNodeTexSky", 0.1)
    sky.sun_elevation, sky.sun_rotation = elevation, rotation


def camera(at: Place, turn: Place) -> None:
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location, scene.camera.rotation_euler = at, turn
    scene.collection.objects.link(scene.camera)


def table() -> None:
    """Clay, metal and plastic on a floor."""
    mesh = bpy.ops.mesh
    add(mesh.primitive_plane_add, (0, 0, 0), 10.0)
    add(mesh.primitive_monkey_add, (0, 0, 1), material={"Base Color": CLAY, "Roughness": 0.4})
    add(mesh.primitive_uv_sphere_add, (2, 1, 0.7), 0.7, {"Metallic": 1.0, "Roughness": 0.15})
    add(mesh.primitive_cube_add, (-2, 1, 0.5), 0.5, {"Base Color": (0.2, 0.4, 0.8, 1.0), "Roughness": 0.7})
    camera((0, -6, 2.5), (1.25, 0, 0))


def room(has_window: bool) -> None:
    """8 x 8 x 3 m; the window is 2 x 1.4 m."""
    walls = [((0, 0, -0.1), (4.2, 4.2, 0.1)), ((0, 0, 3.1), (4.2, 4.2, 0.1)), ((-4.1, 0, 1.5), (0.1, 4, 1.5))]
    walls += [((0, 4.1, 1.5), (4.2, 0.1, 1.5)), ((0, -4.1, 1.5), (4.2, 0.1, 1.5))]
    if has_window:
        walls += [((4.1, 0, 0.5), (0.1, 1, 0.5)), ((4.1, 0, 2.7), (0.1, 1, 0.3))]
        walls += [((4.1, -2.5, 1.5), (0.1, 1.5, 1.5)), ((4.1, 2.5, 1.5), (0.1, 1.5, 1.5))]
    else:
        walls.append(((4.1, 0, 1.5), (0.1, 4, 1.5)))
    for at, scale in walls:
        add(bpy.ops.mesh.primitive_cube_add, at, scale, PLASTER)
    add(bpy.ops.mesh.primitive_monkey_add, (0, 0, 0.8), 0.8, {"Base Color": CLAY})
    camera((-3, -3, 1.6), (1.5, 0, -0.8))


def default_cube() -> None:
    add(bpy.ops.mesh.primitive_cube_add, (0, 0, 0))
    lamp("POINT", (4.08, 1.0, 5.9), 1000.0, shadow_soft_size=0.1)
    world(0.05)
    camera((7.36, -6.93, 4.96), (1.109, 0, 0.815))


def lamp_and_world() -> None:
    table()
    lamp("POINT", (3, -2, 4), 500.0, shadow_soft_size=0.3)
    lamp("SUN", (0, 0, 5), 1.0, (1.0, 0, 1), angle=0.1)
    world(0.2)


def three_point() -> None:
    table()
    world(0.05)
    lamp("AREA", (4, -3, 4), 300.0, (0.6, 0.6, 0.3), size=1.5)
    lamp("AREA", (-4, -3, 3), 100.0, (0.6, -0.7, -0.3), size=1.5)
    lamp("AREA", (0, 4, 4), 200.0, (-0.8, 0, 0), size=1.5)


def spots() -> None:
    table()
    world(0.01)
    for x in (-3, -1, 1, 3):
        lamp("SPOT", (x, -1, 4), 200.0, (0.2, 0, 0), spot_size=0.7, shadow_soft_size=0.05)


def bulbs() -> None:
    table()
    world(0.02)
    light = {"Emission Color": (1.0, 0.8, 0.6, 1.0), "Emission Strength": 100.0}
    for turn in np.arange(0.0, 2.0 * pi, 0.7):
        add(bpy.ops.mesh.primitive_ico_sphere_add, (3 * cos(turn), 3 * sin(turn), 2), 0.1, light, subdivisions=3)


def grey_world() -> None:
    table()
    world(1.0)


def image_light(sun: float) -> None:
    table()
    image_world(sun)


def sky_light() -> None:
    table()
    sky_world()


def glass_ball() -> None:
    table()
    image_world(300.0)
    add(bpy.ops.mesh.primitive_uv_sphere_add, (0, -1.5, 0.5), 0.5, GLASS)


def window_world() -> None:
    room(has_window=True)
    world(3.0)


def window_sky() -> None:
    room(has_window=True)
    sky_world()


def add_pane() -> None:
    """Glass of a centimetre in the window."""
    add(bpy.ops.mesh.primitive_cube_add, (4.1, 0, 1.7), (0.005, 1.01, 0.71), GLASS)
    bpy.context.object.name = PANE


def glazed_world() -> None:
    window_world()
    add_pane()


def glazed_sky() -> None:
    window_sky()
    add_pane()


def glazed_sun() -> None:
    """The sun of the sky shines in."""
    room(has_window=True)
    sky_world(0.4, pi / 2)
    add_pane()


def add_portal() -> None:
    """In the window; light comes in along -x."""
    data = lamp("AREA", (4.05, 0, 1.7), 1.0, (0, pi / 2, 0), shape="RECTANGLE", size=1.4, size_y=2.0)
    data.cycles.is_portal = True


def portal_world() -> None:
    window_world()
    add_portal()


def portal_sky() -> None:
    window_sky()
    add_portal()


def nine_lamps() -> None:
    room(has_window=False)
    for x in (-2, 0, 2):
        for y in (-2, 0, 2):
            lamp("POINT", (x, y, 2.7), 60.0, shadow_soft_size=0.05)


SCENES: dict[str, Callable[[], None]] = {
    "default_cube": default_cube,
    "lamp_and_world": lamp_and_world,
    "three_point": three_point,
    "spots": spots,
    "bulbs": bulbs,
    "grey_world": grey_world,
    "soft_image": lambda: image_light(5.0),
    "sunny_image": lambda: image_light(3000.0),
    "sky": sky_light,
    "glass_ball": glass_ball,
    "window_world": window_world,
    "window_sky": window_sky,
    "glazed_world": glazed_world,
    "glazed_sky": glazed_sky,
    "glazed_sun": glazed_sun,
    "portal_world": portal_world,
    "portal_sky": portal_sky,
    "nine_lamps": nine_lamps,
}
