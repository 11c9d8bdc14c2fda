"""Nodes that trace rays; Bevel is in vector.py."""

from __future__ import annotations

from .compiler import NodeView, value_node
from .instructions import COLOR, Value, constant
from .value_names import OCCLUSION_DISTANCE

_DISTANCE_WITHOUT_WORLD = 10.0  # m
_RAYCAST_PARTS = {"Is Hit": "SEPARATE_X", "Self Hit": "SEPARATE_Y", "Hit Distance": "SEPARATE_Z"}


@value_node("ShaderNodeAmbientOcclusion")
def ambient_occlusion(node: NodeView, output: str) -> Value:
    color = node.value("Color")
    if not node.compiler.traces_rays:
        return constant(1.0) if output == "AO" else color
    parameters = (node.node.samples, int(node.node.inside), int(node.node.only_local))
    part = node.emit("AMBIENT_OCCLUSION", (_occlusion_distance(node), node.normal()), parameters)
    return part if output == "AO" else node.vector_math("MULTIPLY", color, part).retyped(COLOR)


def _occlusion_distance(node: NodeView) -> Value:
    """Where the node shows 0, that of the world's Ambient Occlusion, or without a world Cycles' own."""
    distance = node.value("Distance")
    if node.linked("Distance") is not None or distance.constant[0] != 0.0:
        return distance
    of_world, *_, is_there = node.compiler.context.layer_value(OCCLUSION_DISTANCE)
    return constant(of_world if is_there else _DISTANCE_WITHOUT_WORLD)


@value_node("ShaderNodeRaycast")
def raycast(node: NodeView, output: str) -> Value | None:
    """Attributes of what is met are not supported."""
    position = node.linked("Position") or node.at_shift("POSITION")
    direction = node.linked("Direction") or node.shading_normal()
    length = node.value("Length")
    is_local = int(node.node.only_local)

    def ask(wants_normal: bool) -> Value:
        if node.compiler.traces_rays:
            return node.emit(
                "RAYCAST", (position, direction, length), (int(wants_normal), is_local, node.compiler.shift)
            )
        zero = constant(0.0)
        return node.emit("COMBINE_XYZ", (zero, zero, zero if wants_normal else length))

    if output == "Hit Normal":
        return ask(True)
    met = ask(False)
    if output in _RAYCAST_PARTS:
        return node.emit(_RAYCAST_PARTS[output], (met,))
    if output != "Hit Position":
        return None
    way = node.vector_math("MULTIPLY", direction, node.emit("SEPARATE_Z", (met,)))
    return node.vector_math("MULTIPLY", node.vector_math("ADD", position, way), node.emit("SEPARATE_X", (met,)))
