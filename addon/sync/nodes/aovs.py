"""AOV Output nodes: values of a material or a world that go to passes of their own."""

from __future__ import annotations

from collections.abc import Iterator

from .compiler import Compiler, NodeView
from .graph import Node, Scope, is_group
from .instructions import constant


def write_aovs(compiler: Compiler, scope: Scope) -> None:
    """One instruction for each node whose pass the view layer has, in groups too. Each counts, as in Cycles."""
    if not compiler.context.aov_names:
        return
    for inner, node in _aov_nodes(scope):
        name = aov_name(node)
        if name not in compiler.context.aov_names:
            continue
        view = NodeView(compiler, inner, node)
        inputs = (constant(1.0), view.value("Color"), view.value("Value"))
        compiler.code.closure("CLOSURE_AOV", inputs, (compiler.code.program.attribute(name),))


def aov_name(node: Node) -> str:
    return getattr(node, "aov_name", None) or node.name


def _aov_nodes(scope: Scope) -> Iterator[tuple[Scope, Node]]:
    for node in scope.tree.nodes:
        if node.mute:
            continue
        if node.bl_idname == "ShaderNodeOutputAOV":
            yield scope, node
        elif is_group(node):
            inside = scope.child(node)
            if inside is not None:
                yield from _aov_nodes(inside)
