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


def grid_with_cubes(size: int, material: bpy.types.Material | None = None) -> bpy.types.Object:
    """Geometry nodes put a cube on each point."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=size - 1, y_subdivisions=size - 1, size=size)
    tree = bpy.data.node_groups.new("Cubes", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    place, cube = tree.nodes.new("GeometryNodeInstanceOnPoints"), tree.nodes.new("GeometryNodeMeshCube")
    paint = tree.nodes.new("GeometryNodeSetMaterial")
    paint.inputs["Material"].default_value = material
    tree.links.new(start.outputs[0], place.inputs["Points"])
    tree.links.new(cube.outputs[0], paint.inputs["Geometry"])
    tree.links.new(paint.outputs[0], place.inputs["Instance"])
    tree.links.new(place.outputs[0], end.inputs[0])
    bpy.context.object.modifiers.new("Cubes", "NODES").node_group = tree
    return bpy.context.object
