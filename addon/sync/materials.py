"""Materials of a scene: compiled once each, grouped into the sets that instances share."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING

import bpy

from . import SyncReport
from .images import ImageCache
from .nodes import compile_light, compile_material, compile_world
from .nodes.inputs import DEFAULT_COLOR_ATTRIBUTE

if TYPE_CHECKING:
    from cistern_core import MaterialProgram, SceneBuilder

CompileTree = Callable[[bpy.types.ID, "MaterialContext"], "MaterialProgram | None"]

_EMPTY_SLOT = 0


@dataclass(frozen=True)
class MaterialContext:
    """What the node compiler may ask for while it compiles a tree."""

    core: ModuleType
    builder: SceneBuilder
    depsgraph: bpy.types.Depsgraph
    images: ImageCache
    report: SyncReport

    def image_handle(self, image: bpy.types.Image, image_user: bpy.types.ImageUser | None) -> int:
        """Handle of an image in the builder; -1 for one that cannot be read, which the core draws magenta."""
        return self.images.handle(image, image_user, self.builder, self.report)

    def warn(self, text: str) -> None:
        self.report.warn(text)


class MaterialTable:
    """Handles of compiled programs, by the address of the evaluated data-block; lives as long as one sync."""

    def __init__(self, context: MaterialContext, override: bpy.types.Material | None = None) -> None:
        self._context = context
        self._override = override
        self._handles: dict[int, int | None] = {}
        self._sets: dict[tuple[int, ...], int] = {}

    def set_handle(self, evaluated_object: bpy.types.Object) -> int:
        """Material set of an object's slots, whether they are linked to the object or to its data."""
        slots = evaluated_object.material_slots
        handles = tuple(self._handle(self._override or slot.material, compile_material) for slot in slots)
        if not handles and self._override is not None:
            handles = (self._handle(self._override, compile_material),)
        if handles not in self._sets:
            self._sets[handles] = self._context.builder.add_material_set(list(handles), evaluated_object.name)
        return self._sets[handles]

    def light_handle(self, light: bpy.types.Light) -> int:
        """The program that multiplies a lamp's light, or -1 for a lamp of one colour."""
        handle = self._handle(light, compile_light)
        return -1 if handle is None else handle

    def world_handle(self, world: bpy.types.World) -> int | None:
        return self._handle(world, compile_world)

    def _handle(self, data_block: bpy.types.ID | None, compile_tree: CompileTree) -> int | None:
        key = _EMPTY_SLOT if data_block is None else data_block.as_pointer()
        if key not in self._handles:
            program = compile_tree(data_block, self._context)
            self._handles[key] = None if program is None else self._context.builder.add_material(program)
        return self._handles[key]


@dataclass(frozen=True)
class TreeUses:
    """What the node trees of a scene read from elsewhere."""

    attributes: frozenset[str]
    images: list[tuple[bpy.types.Image, bpy.types.ImageUser]]


def tree_uses(depsgraph: bpy.types.Depsgraph) -> TreeUses:
    """Mesh attributes and images that any material, world or lamp of the dependency graph names."""
    owners = (i for i in depsgraph.ids if isinstance(i, bpy.types.Material | bpy.types.World | bpy.types.Light))
    attributes: set[str] = set()
    images: dict[int, tuple[bpy.types.Image, bpy.types.ImageUser]] = {}
    for node in _nodes(owner.node_tree for owner in owners if owner.node_tree is not None):
        attributes.add(getattr(node, "attribute_name", ""))
        if node.bl_idname == "ShaderNodeVertexColor":
            attributes.add(node.layer_name or DEFAULT_COLOR_ATTRIBUTE)
        image = getattr(node, "image", None)
        if image is not None and hasattr(node, "image_user"):
            images.setdefault(image.as_pointer(), (image, node.image_user))
    return TreeUses(frozenset(attributes - {""}), list(images.values()))


def _nodes(trees: Iterable[bpy.types.NodeTree]) -> Iterator[bpy.types.Node]:
    """Every node of the trees and of the groups they use, each group once even where it contains itself."""
    pending, seen = list(trees), set()
    while pending:
        tree = pending.pop()
        if tree.as_pointer() in seen:
            continue
        seen.add(tree.as_pointer())
        for node in tree.nodes:
            yield node
            if node.type == "GROUP" and node.node_tree is not None:
                pending.append(node.node_tree)
