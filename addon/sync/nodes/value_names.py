"""Names of the numbers that materials read of each instance (`INSTANCE_VALUE` of the core)."""

from __future__ import annotations

import bpy

# Mesh attributes that outputs of the Geometry node read.
RANDOM_PER_ISLAND, POINTINESS = "INFO:island", "INFO:pointiness"
GENERATED = "INFO:generated"  # read by many nodes where nothing is linked; the core knows it by this name
RENDER_COLOR = "INFO:render color"  # what a Color Attribute node without a name reads
GEOMETRY_OUTPUTS = {"Random Per Island": RANDOM_PER_ISLAND, "Pointiness": POINTINESS}
# Attributes of strands that outputs of the Hair Info node read; on meshes they are 0.
STRAND, STRAND_INTERCEPT, STRAND_LENGTH = "INFO:strand", "INFO:intercept", "INFO:length"
STRAND_THICKNESS, STRAND_RANDOM = "INFO:thickness", "INFO:random"
STRAND_NORMAL = "INFO:strand normal"  # of the cross-section of hair curves, which Principled Hair reads
STRAND_OUTPUTS = {
    "Is Strand": STRAND,
    "Intercept": STRAND_INTERCEPT,
    "Length": STRAND_LENGTH,
    "Thickness": STRAND_THICKNESS,
    "Random": STRAND_RANDOM,
}
# Attributes of points that outputs of the Point Info node read; on meshes and strands they are 0.
POINT_POSITION, POINT_RADIUS, POINT_RANDOM = "INFO:point", "INFO:point radius", "INFO:point random"
POINT_OUTPUTS = {"Position": POINT_POSITION, "Radius": POINT_RADIUS, "Random": POINT_RANDOM}
ATTRIBUTE_OUTPUTS = {
    "ShaderNodeNewGeometry": GEOMETRY_OUTPUTS,
    "ShaderNodeHairInfo": STRAND_OUTPUTS,
    "ShaderNodePointInfo": POINT_OUTPUTS,
    "ShaderNodeBsdfHairPrincipled": {"BSDF": STRAND_RANDOM},
    "ShaderNodeBsdfHair": {"BSDF": STRAND},
}
VOLUME_OUTPUTS = {"Color": "color", "Density": "density", "Flame": "flame", "Temperature": "temperature"}
COLOR, INDEX = "INFO:color", "INFO:index"
OBJECT, INSTANCER, VIEW_LAYER = "OBJECT", "INSTANCER", "VIEW_LAYER"  # types of Attribute nodes
OCCLUSION_DISTANCE = "light_settings.distance"  # of the world that a view layer shows
PARTICLE = "PARTICLE"  # outputs of the Particle Info node
NO_PARTICLE = {"Random": 0xDC3D74F9 / 0xFFFFFFFF}  # what is none has the random number of the first, and else zeros
EMITTER = "EMITTER"  # coordinates of where on a surface an instance sits: those outputs of Texture Coordinate
EMITTER_COORDINATES = ("Generated", "UV")
INFO_OUTPUTS = {"Color": COLOR, "Alpha": COLOR, "Object Index": INDEX}


def output_attributes(node: bpy.types.Node) -> set[str]:
    """Mesh attributes without a name in Blender, which outputs that are linked read."""
    outputs = ATTRIBUTE_OUTPUTS.get(node.bl_idname, {})
    found = {name for output, name in outputs.items() if node.outputs[output].is_linked}
    if found and getattr(node, "model", "") == "HUANG":
        found.add(STRAND_NORMAL)
    return found


def attribute_value_name(attribute_type: str, name: str) -> str:
    return f"{attribute_type}:{name}"


def split_value_name(value_name: str) -> tuple[str, str]:
    """The type and name of an attribute; another first word for Object Info."""
    kind, _, name = value_name.partition(":")
    return kind, name


def value_names(node: bpy.types.Node) -> set[str]:
    """Of the values that a node reads."""
    if node.bl_idname == "ShaderNodeObjectInfo":
        linked = [socket.identifier for socket in node.outputs if socket.is_linked]
        return {INFO_OUTPUTS[output] for output in linked if output in INFO_OUTPUTS}
    if node.bl_idname == "ShaderNodeParticleInfo":
        return {attribute_value_name(PARTICLE, socket.identifier) for socket in node.outputs if socket.is_linked}
    if node.bl_idname in ("ShaderNodeTexCoord", "ShaderNodeUVMap") and node.from_instancer:
        linked = [socket.identifier for socket in node.outputs if socket.is_linked]
        return {attribute_value_name(EMITTER, output) for output in linked if output in EMITTER_COORDINATES}
    if node.bl_idname == "ShaderNodeAttribute" and node.attribute_type in (OBJECT, INSTANCER) and node.attribute_name:
        return {attribute_value_name(node.attribute_type, node.attribute_name)}
    return set()
