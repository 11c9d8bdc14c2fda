"""Blender scenes built by script for comparisons with Cycles."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import bpy
import numpy as np

Nodes = bpy.types.ShaderNodeTree


def material(name: str, build: Callable[[Nodes], bpy.types.NodeSocket], place: str = "Surface") -> bpy.types.Material:
    """A material whose surface, or what else `place` names, is the socket that `build` returns."""
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    tree = result.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(build(tree), output.inputs[place])
    return result


def shader(tree: Nodes, kind: str, **inputs: object) -> bpy.types.Node:
    """A node with inputs set by name or identifier (underscores are spaces): values, or sockets to link."""
    node = tree.nodes.new(kind)
    for name, value in inputs.items():
        socket = next(s for s in node.inputs if name.replace("_", " ") in (s.name, s.identifier) and s.enabled)
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node


def principled(name: str = "principled", **inputs: object) -> bpy.types.Material:
    return material(name, lambda tree: shader(tree, "ShaderNodeBsdfPrincipled", **inputs).outputs[0])


def add_mesh(
    scene: bpy.types.Scene,
    name: str,
    points: Sequence,
    polygons: Sequence,
    surface: bpy.types.Material | None = None,
    smooth: bool = False,
) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, p)) for p in points], [], [tuple(map(int, p)) for p in polygons])
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(mesh.polygons))
    if surface:
        mesh.materials.append(surface)
    result = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(result)
    return result


def add_floor(scene: bpy.types.Scene, surface: bpy.types.Material | None = None, half: float = 3.0) -> bpy.types.Object:
    points = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    floor = add_mesh(
        scene, "floor", points, [(0, 1, 2, 3)], surface or principled("grey", Base_Color=(0.6, 0.6, 0.6, 1))
    )
    layer = floor.data.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32).ravel())
    return floor


def add_sphere(
    scene: bpy.types.Scene, surface: bpy.types.Material, radius: float = 0.7, segments: int = 64
) -> bpy.types.Object:
    """Smooth, standing on the floor, with a latitude-longitude UV map."""
    rings = segments // 2
    theta = np.arange(1, rings) * np.pi / rings
    phi = np.arange(segments) * 2 * np.pi / segments
    body = [(np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)) for t in theta for p in phi]
    points = radius * np.array([(0, 0, 1), *body, (0, 0, -1)]) + np.array([0, 0, radius])
    low = lambda r, k: 1 + r * segments + k % segments  # noqa: E731
    faces: list[tuple[int, ...]] = [(0, low(0, k), low(0, k + 1)) for k in range(segments)]
    for r in range(rings - 2):
        faces += [(low(r, k), low(r + 1, k), low(r + 1, k + 1), low(r, k + 1)) for k in range(segments)]
    faces += [(len(points) - 1, low(rings - 2, k + 1), low(rings - 2, k)) for k in range(segments)]
    sphere = add_mesh(scene, "sphere", points, faces, surface, smooth=True)
    add_longitude_uv(sphere.data)
    return sphere


def add_longitude_uv(mesh: bpy.types.Mesh) -> None:
    """u along longitude, without a wrapped face; v along height."""
    vertices = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", vertices)
    corners = np.zeros(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    position = vertices.reshape(-1, 3)[corners]
    low, high = position[:, 2].min(), position[:, 2].max()
    u = np.arctan2(position[:, 1], position[:, 0]) / (2 * np.pi) + 0.5
    for polygon in mesh.polygons:
        span = slice(polygon.loop_start, polygon.loop_start + polygon.loop_total)
        if np.ptp(u[span]) > 0.5:
            u[span] = np.where(u[span] < 0.5, u[span] + 1.0, u[span])
    layer = mesh.uv_layers.new(name="UVMap")
    uv = np.stack([u, (position[:, 2] - low) / (high - low)], 1).astype(np.float32)
    layer.data.foreach_set("uv", uv.ravel())


def add_camera(
    scene: bpy.types.Scene,
    position: Sequence[float] = (0.0, -4.0, 2.0),
    rotation: Sequence[float] = (math.radians(68), 0.0, 0.0),
    lens: float = 50.0,
) -> bpy.types.Object:
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler, camera.data.lens = position, rotation, lens
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def add_light(
    scene: bpy.types.Scene,
    kind: str,
    position: Sequence[float] = (1.0, -1.0, 2.5),
    rotation: Sequence[float] = (0.0, 0.0, 0.0),
    scale: Sequence[float] = (1.0, 1.0, 1.0),
    **members: object,
) -> bpy.types.Object:
    data = bpy.data.lights.new(kind.lower(), kind)
    for name, value in members.items():
        setattr(data, name, value)
    light = bpy.data.objects.new(kind.lower(), data)
    light.location, light.rotation_euler, light.scale = position, rotation, scale
    scene.collection.objects.link(light)
    return light


def set_world(
    scene: bpy.types.Scene, color: Sequence[float] = (0.4, 0.5, 0.7), strength: float = 0.5
) -> bpy.types.World:
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    scene.world = world
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*color, 1.0)
    background.inputs["Strength"].default_value = strength
    return world


def gradient_image(name: str = "gradient", width: int = 32, height: int = 16, bright: float = 1.0) -> bpy.types.Image:
    """A float image with structure in every direction, linear."""
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    rgb = np.stack([0.2 + 0.8 * u, 0.1 + 0.7 * v, 0.5 + 0.5 * np.sin(9 * u + 5 * v)], -1) * bright
    image = bpy.data.images.new(name, width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.concatenate([rgb, np.ones_like(rgb[..., :1])], -1).astype(np.float32).ravel())
    image.pack()
    return image


def tile_pixels(number: int, width: int = 16, height: int = 8) -> np.ndarray:
    """8-bit blocks with alpha, (height, width, 4), of which products of colour and alpha are whole codes: Cycles keeps
    them in 8 bits, Cistern does not round. Tiles are told apart by their colours."""
    rng = np.random.default_rng(number)
    pixels = rng.integers(0, 52, (height, width, 4)) * 5
    pixels[..., number % 3] //= 25
    pixels[..., number % 3] *= 5
    pixels[..., 3] = rng.integers(1, 6, (height, width)) * 51
    return pixels.astype(np.uint8)


def save_tile(path: str, number: int) -> None:
    pixels = tile_pixels(number)
    image = bpy.data.images.new("tile", pixels.shape[1], pixels.shape[0], alpha=True)
    image.pixels.foreach_set((pixels / np.float32(255.0)).astype(np.float32).ravel())
    image.filepath_raw, image.file_format = path, "PNG"
    image.save()
    bpy.data.images.remove(image)


def tiled_image(path: str, numbers: Sequence[int]) -> bpy.types.Image:
    """`path` holds <UDIM> or <UVTILE>; no files are looked for."""
    image = bpy.data.images.new("tiles", 1, 1, tiled=True)
    image.filepath = path
    for number in numbers[1:]:
        image.tiles.new(number)
    image.tiles[0].number = numbers[0]
    return image


def set_environment_image(scene: bpy.types.Scene, image: bpy.types.Image, **mapping: Sequence[float]) -> None:
    world = set_world(scene, strength=1.0)
    tree = world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    if mapping:
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        node = shader(tree, "ShaderNodeMapping", Vector=coordinates.outputs["Generated"], **mapping)
        tree.links.new(node.outputs[0], texture.inputs["Vector"])


def stage(
    scene: bpy.types.Scene, surface: bpy.types.Material, world: Mapping | None = None, segments: int = 64
) -> bpy.types.Object:
    """The test sphere: on a grey floor, lit by an area light, a point light and a dim sky."""
    add_floor(scene)
    sphere = add_sphere(scene, surface, segments=segments)
    add_light(scene, "AREA", (1.5, -1.0, 2.5), (0.4, 0.5, 0.0), energy=60.0, size=1.0)
    add_light(scene, "POINT", (-1.5, -1.5, 1.5), energy=30.0, shadow_soft_size=0.25)
    set_world(scene, **(world or {}))
    add_camera(scene, (0.0, -3.2, 1.5), (math.radians(74), 0.0, 0.0), lens=60.0)
    return sphere
