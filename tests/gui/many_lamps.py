"""A field of half a million triangles under 2,000 lamps, to measure on."""

import math

import bpy
import numpy as np

SIDE = 16  # lumps along a side of the field
LAMPS = 2000
PITCH = 3.0


def build_scene() -> None:
    """A field of lumps of stone, each a mesh of its own, under a sky of small lamps."""
    scene = bpy.context.scene
    for obj in list(bpy.data.objects):
        if obj.type != "CAMERA":
            bpy.data.objects.remove(obj)
    random = np.random.default_rng(7)
    material = bpy.data.materials.new("Stone")
    material.diffuse_color = (0.6, 0.55, 0.5, 1.0)
    vertices, triangles = lump()
    for index in range(SIDE * SIDE):
        mesh = bpy.data.meshes.new(f"Lump {index}")
        mesh.from_pydata(vertices * (1.0 + 0.02 * random.standard_normal((len(vertices), 1))), [], triangles)
        mesh.materials.append(material)
        place(mesh, (PITCH * (index % SIDE), PITCH * (index // SIDE), 0.0))
    floor = bpy.data.meshes.new("Floor")
    width = PITCH * SIDE
    floor.from_pydata(
        [(-9, -9, -1), (width + 9, -9, -1), (width + 9, width + 9, -1), (-9, width + 9, -1)], [], [(0, 1, 2, 3)]
    )
    place(floor, (0.0, 0.0, 0.0))
    for index in range(LAMPS):
        lamp = bpy.data.lights.new(f"Lamp {index}", "POINT")
        lamp.energy, lamp.shadow_soft_size, lamp.color = 3.0, 0.05, random.uniform(0.3, 1.0, 3)
        place(lamp, (*random.uniform(-3.0, width + 3.0, 2), random.uniform(1.5, 3.0)))
    scene.camera.location = (-12.0, -12.0, 14.0)


def place(data: bpy.types.ID, location: tuple[float, float, float]) -> None:
    obj = bpy.data.objects.new(data.name, data)
    obj.location = location
    bpy.context.scene.collection.objects.link(obj)


def lump(rings: int = 32, segments: int = 32) -> tuple[np.ndarray, list[tuple[int, int, int]]]:
    """A unit sphere of 2 * segments * (rings - 1) triangles."""
    polar, around = np.meshgrid(np.linspace(0.0, math.pi, rings + 1)[1:-1], np.arange(segments) * math.tau / segments)
    ball = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], -1)
    vertices = np.concatenate([ball.transpose(1, 0, 2).reshape(-1, 3), [(0, 0, 1), (0, 0, -1)]])
    top, bottom = len(vertices) - 2, len(vertices) - 1
    triangles = []
    for s in range(segments):
        n = (s + 1) % segments
        triangles.append((top, s, n))
        triangles.append((bottom, (rings - 2) * segments + n, (rings - 2) * segments + s))
        for r in range(rings - 2):
            a, b = r * segments + s, r * segments + n
            c, d = a + segments, b + segments
            triangles += [(a, c, b), (b, c, d)]
    return vertices, triangles
