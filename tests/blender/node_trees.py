"""Small materials for the tests of the node compiler, and a context that collects what it says."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from addon.sync.nodes import compile_material
from tests.support import fake_program


class Context:
    core = fake_program
    aov_names: frozenset[str] = frozenset()

    def __init__(self, handle: int = 3) -> None:
        self.warnings: list[str] = []
        self._handle = handle

    def image_handle(self, image: bpy.types.Image, image_user: bpy.types.ImageUser | None) -> int:
        return self._handle

    def table_handle(self, key: tuple, name: str, make: Callable[[], Any]) -> int:
        return self._handle

    def layer_value(self, name: str) -> tuple[float, float, float, float]:
        return (0.25, 0.5, 0.75, 1.0)

    def warn(self, text: str) -> None:
        self.warnings.append(text)


def socket(sockets: Any, identifier: str) -> bpy.types.NodeSocket:
    return next(socket for socket in sockets if socket.identifier == identifier)


class Tree:
    """A material with a fresh tree: `node` adds, `link` joins by identifier, `set` gives defaults."""

    def __init__(self, name: str = "Test") -> None:
        self.material = bpy.data.materials.new(name)
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.output = self.node("ShaderNodeOutputMaterial")

    def node(self, idname: str, **members: Any) -> bpy.types.Node:
        node = self.tree.nodes.new(idname)
        for name, value in members.items():
            setattr(node, name, value)
        return node

    def link(self, source: bpy.types.Node, output: str, target: bpy.types.Node, input: str) -> bpy.types.NodeLink:
        return self.tree.links.new(socket(target.inputs, input), socket(source.outputs, output))

    def set(self, node: bpy.types.Node, **values: Any) -> bpy.types.Node:
        for identifier, value in values.items():
            socket(node.inputs, identifier).default_value = value
        return node

    def shown(self, node: bpy.types.Node, output: str) -> bpy.types.Node:
        """An Emission node that shows this output as its colour on the surface; a float becomes its strength."""
        emission = self.node("ShaderNodeEmission")
        is_float = socket(node.outputs, output).type == "VALUE"
        self.link(node, output, emission, "Strength" if is_float else "Color")
        self.link(emission, "Emission", self.output, "Surface")
        return emission

    def compile(self, context: Context | None = None) -> fake_program.MaterialProgram:
        return compile_material(self.material, context or Context())


def shown_value(build: Callable[[Tree], tuple[bpy.types.Node, str]]) -> Any:
    """Operand that the surface reads when it shows the output `build` returns: three numbers or an Instruction."""
    tree = Tree()
    node, output = build(tree)
    tree.shown(node, output)
    (closure,) = tree.compile().closures
    return closure.inputs[2 if socket(node.outputs, output).type == "VALUE" else 1]


def emission_color(tree: Tree, context: Context | None = None):
    (closure,) = tree.compile(context).closures
    return closure.inputs[1]


def shown_as_colour(tree: Tree, node: bpy.types.Node) -> bpy.types.Node:
    emission = tree.node("ShaderNodeEmission")
    tree.tree.links.new(emission.inputs["Color"], node.outputs[0])
    tree.link(emission, "Emission", tree.output, "Surface")
    return emission
