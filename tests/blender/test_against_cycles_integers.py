"""Integer Math, Boolean Math and Get Vector Component, which shaders have from Blender 5.3 on, against Cycles: one to a
card that shines evenly, one card to a block. Their numbers are properties of the cards, which nothing folds."""

from collections.abc import Callable

import bpy
import pytest

from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles

pytestmark = [
    pytest.mark.usefixtures("registered_addon"),
    pytest.mark.skipif(bpy.app.version < (5, 3, 0), reason="shaders have them from Blender 5.3 on"),
]

SIDE, ROUNDING = 6, 1e-4
INTEGER = (
    *("ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "ABSOLUTE", "NEGATE", "POWER", "MINIMUM", "MAXIMUM"),
    *("SIGN", "DIVIDE_ROUND", "DIVIDE_FLOOR", "DIVIDE_CEIL", "FLOORED_MODULO", "MODULO", "GCD", "LCM"),
)
BOOLEAN = ("AND", "OR", "NOT", "NAND", "NOR", "XNOR", "XOR", "IMPLY", "NIMPLY")
NUMBERS = [(7, 3, 2), (-7, 3, 1), (8, -3, 0), (-8, -3, 5), (5, 0, 1), (0, -2, 1), (12, 18, 4), (2.7, -1.2, 0.6)]
BITS = [(0, 0), (0, 1), (1, 0), (1, 1), (0.6, -1), (1.5, 0.4)]
Make = Callable[[bpy.types.NodeTree], bpy.types.NodeSocket]


def of(idname: str, operation: str | None, *numbers: str) -> Make:
    """The node with properties of the object as its inputs."""

    def make(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        node = tree.nodes.new(idname)
        if operation is not None:
            node.operation = operation
        for socket, name in zip(node.inputs, numbers, strict=False):
            attribute = tree.nodes.new("ShaderNodeAttribute")
            attribute.attribute_type, attribute.attribute_name = "OBJECT", name
            tree.links.new(attribute.outputs["Color" if name == "vector" else "Fac"], socket)
        return node.outputs[0]

    return make


CARDS = [
    *(of("FunctionNodeIntegerMath", operation, "a", "b", "c") for operation in INTEGER),
    *(of("FunctionNodeBooleanMath", operation, "a", "b") for operation in BOOLEAN),
    *(of("FunctionNodeGetVectorComponent", None, "vector", name) for name in ("a", "b", "c")),
]


def add_cards(scene: bpy.types.Scene, numbers: tuple[float, ...]) -> None:
    for index, make in enumerate(CARDS):

        def shine(tree: bpy.types.NodeTree, make: Make = make) -> bpy.types.NodeSocket:
            shown = tree.nodes.new("ShaderNodeMath")
            shown.operation = "MULTIPLY_ADD"
            shown.inputs[1].default_value, shown.inputs[2].default_value = 0.01, 4.0
            tree.links.new(make(tree), shown.inputs[0])
            return build.shader(tree, "ShaderNodeEmission", Strength=shown.outputs[0]).outputs[0]

        x, y = index % SIDE - SIDE / 2, index // SIDE - SIDE / 2
        corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        card = build.add_mesh(scene, "card", corners, [(0, 1, 2, 3)], build.material(f"card {index}", shine))
        card.location = (x, y, 0)
        for name, number in zip("abc", (*numbers, 0), strict=False):
            card[name] = float(number)
        card["vector"] = [0.5, 1.5, 2.5]
    camera = build.add_camera(scene, (0, 0, 5), (0, 0, 0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", SIDE


def other_numbers(scene: bpy.types.Scene) -> None:
    for card in scene.objects:
        if "a" in card:
            card["a"] = card["a"] + 1.0


@pytest.mark.parametrize("numbers", [*NUMBERS, *BITS])
def test_numbers_are_the_same(empty_scene: bpy.types.Scene, numbers: tuple[float, ...]) -> None:
    """And those of a larger first one are others."""
    add_cards(empty_scene, numbers)
    settings = {"samples": 2, "count": 3, "blocks": SIDE, "floor": ROUNDING}
    result = compare_with_cycles(empty_scene, (24, 24), **settings)
    assert result.agrees, result
    assert not compare_with_cycles(empty_scene, (24, 24), plant=other_numbers, **settings).agrees
