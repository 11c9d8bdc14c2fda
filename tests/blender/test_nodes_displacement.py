"""What becomes of displacement in the program of a material."""

from __future__ import annotations

import pytest
from node_trees import Context, Tree


def displaced(tree: Tree) -> None:
    displacement = tree.node("ShaderNodeDisplacement")
    noise = tree.node("ShaderNodeTexNoise")
    tree.link(noise, noise.outputs[0].identifier, displacement, "Height")
    tree.link(displacement, "Displacement", tree.output, "Displacement")
    tree.link(tree.node("ShaderNodeBsdfDiffuse"), "BSDF", tree.output, "Surface")


def test_displacement_bends_the_normal_of_all_closures(empty_scene):
    tree = Tree()
    displaced(tree)
    context = Context()
    normal, diffuse = tree.compile(context).closures
    assert (normal.op, diffuse.op) == ("CLOSURE_NORMAL", "CLOSURE_DIFFUSE")
    assert normal.inputs[1] == diffuse.inputs[3] and diffuse.inputs[3].op == "BUMP"
    assert not context.warnings


@pytest.mark.parametrize(
    ("method", "ops"),
    [("DISPLACEMENT", ["CLOSURE_DISPLACEMENT"]), ("BOTH", ["CLOSURE_DISPLACEMENT", "CLOSURE_DISPLACED_BUMP"])],
)
def test_true_displacement_moves_vertices(empty_scene, method, ops):
    """The closures of the surface read the normal as it is: the core bends it where there is bump too."""
    tree = Tree()
    displaced(tree)
    tree.material.displacement_method = method
    context = Context()
    *moving, diffuse = tree.compile(context).closures
    assert [closure.op for closure in moving] == ops
    assert list(moving[0].parameters) == [int(method == "BOTH")]
    assert diffuse.op == "CLOSURE_DIFFUSE" and diffuse.inputs[3].op == "NORMAL"
    assert not context.warnings


def test_even_displacement_is_no_bump(empty_scene):
    tree = Tree()
    tree.link(tree.node("ShaderNodeDisplacement"), "Displacement", tree.output, "Displacement")
    tree.link(tree.node("ShaderNodeBsdfDiffuse"), "BSDF", tree.output, "Surface")
    (closure,) = tree.compile().closures
    assert closure.op == "CLOSURE_DIFFUSE" and closure.inputs[3].op == "NORMAL"
