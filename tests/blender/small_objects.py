"""Objects and meshes of a line each, for scenes built in tests."""

import bpy


def link(name: str, data: bpy.types.ID | None, collection=None, location=(0, 0, 0)) -> bpy.types.Object:
    """A new object, in a collection or in the scene's own."""
    obj = bpy.data.objects.new(name, data)
    obj.location = location
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def triangle(name: str = "Triangle") -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    return mesh
