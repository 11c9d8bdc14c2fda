"""What an evaluation of a dependency graph touched."""

from __future__ import annotations

from collections.abc import Iterable, Set
from dataclasses import dataclass

import bpy

from .nodes.graph import all_groups

SHADED = bpy.types.Material | bpy.types.World | bpy.types.Light
# Data-blocks whose changes reach objects and materials, which are listed themselves.
_FOLLOWED = ("Armature", "Camera", "Curve", "Curves", "Key", "Lattice", "MetaBall", "NodeTree", "PointCloud")


@dataclass(frozen=True)
class Changes:
    """Session ids of the original data-blocks that were touched. What is not listed is as it was at the last sync."""

    has_unlisted: bool = True
    """Whether objects may also have come, gone, or changed without being listed."""
    is_everything: bool = True
    """Whether nothing may be taken for known."""
    moved: Set[int] = frozenset()
    """Objects of which nothing but the place changed."""
    meshes: Set[int] = frozenset()
    """With each, the objects that show it are listed, too."""
    objects: Set[int] = frozenset()
    shading: Set[int] = frozenset()
    """Materials, worlds and lamps."""
    has_images: bool = False

    @property
    def are_moves_only(self) -> bool:
        return not (self.has_unlisted or self.meshes or self.objects or self.shading or self.has_images)

    def lists_any(self, uids: Iterable[int]) -> bool:
        return not all(listed.isdisjoint(uids) for listed in (self.meshes, self.objects, self.shading))


EVERYTHING = Changes()
UNLISTED = Changes(is_everything=False)
NOTHING = Changes(has_unlisted=False, is_everything=False)


def original_uid(data_block: bpy.types.ID | None) -> int:
    """Session id of a data-block as the user knows it: the same before and after an undo; 0 for None."""
    return 0 if data_block is None else (data_block.original or data_block).session_uid


def data_uid(data_block: bpy.types.ID) -> int:
    """Session id of an evaluated data-block; of the original one, where Blender takes that as it is."""
    return data_block.session_uid or original_uid(data_block)


def read_changes(depsgraph: bpy.types.Depsgraph) -> Changes:
    """The changes since the evaluation before this one.

    A deleted object is on no list: then its scene or collection is. An empty list says nothing at all."""
    moved, meshes, objects, shading, groups = set(), set(), set(), set(), set()
    has_unlisted = not len(depsgraph.updates)
    has_images = depsgraph.id_type_updated("IMAGE")  # Blender 4.2 does not list them
    for update in depsgraph.updates:
        data_block = update.id
        if isinstance(data_block, bpy.types.Object):
            is_move = update.is_updated_transform and not (update.is_updated_geometry or update.is_updated_shading)
            (moved if is_move else objects).add(original_uid(data_block))
            if update.is_updated_geometry and isinstance(data_block.data, bpy.types.Mesh):
                meshes.add(original_uid(data_block.data))  # where that is not listed itself, as under a brush
        elif isinstance(data_block, bpy.types.Mesh):
            meshes.add(original_uid(data_block))
        elif isinstance(data_block, SHADED):
            shading.add(original_uid(data_block))
        elif isinstance(data_block, bpy.types.Image | bpy.types.Texture):
            has_images = True
        elif isinstance(data_block, bpy.types.ShaderNodeTree):
            if not data_block.is_embedded_data:  # in its owner, which is listed
                groups.add(original_uid(data_block))
        elif not isinstance(data_block, _followed_types()):
            has_unlisted = True
    if groups:
        shading |= _users_of_groups(depsgraph, groups)
    sets = (frozenset(some) for some in (moved - objects, meshes, objects, shading))
    return Changes(has_unlisted, False, *sets, has_images)


def _users_of_groups(depsgraph: bpy.types.Depsgraph, groups: Set[int]) -> set[int]:
    """What is shaded by groups of these: Blender lists the groups alone where one in them was removed or remapped."""
    shaded = (i for i in depsgraph.ids if isinstance(i, SHADED) and i.node_tree is not None)
    return {original_uid(i) for i in shaded if not groups.isdisjoint(map(original_uid, all_groups([i.node_tree])))}


def _followed_types() -> tuple[type, ...]:
    return tuple(getattr(bpy.types, name) for name in _FOLLOWED if hasattr(bpy.types, name))
