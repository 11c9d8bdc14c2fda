"""Materials of a scene: compiled once each, grouped into the sets that instances share."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Set
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING

import bpy
from numpy.typing import NDArray

from . import SyncReport
from .changes import EVERYTHING, SHADED, Changes, original_uid
from .image_source import ImageSource, animated_source
from .images import ImageCache
from .instance_values import Rgba, layer_value
from .nodes import compile_light, compile_material, compile_splats, compile_volume, compile_world
from .nodes.graph import all_nodes
from .nodes.value_names import GENERATED, RENDER_COLOR, output_attributes, value_names
from .splats import is_splat_cloud
from .studio_light import StudioLight, compile_studio_light

if TYPE_CHECKING:
    from cistern_core import MaterialProgram, SceneBuilder

CompileTree = Callable[[bpy.types.ID, "MaterialContext"], "MaterialProgram | None"]
Animations = frozenset[tuple[int, ImageSource | None]]

_EMPTY_SLOT = 0
_EMPTY_SLOT_OF_SPLATS = 1 << 62  # no session id of Blender's is as large
_STUDIO_LIGHT = 1 << 61  # and up to twice that
_EMPTY_SLOTS = {_EMPTY_SLOT, _EMPTY_SLOT_OF_SPLATS}
# Textures that read something else where no vector is linked.
_WITHOUT_GENERATED = frozenset(
    f"ShaderNodeTex{kind}" for kind in ("Image", "Environment", "Sky", "IES", "PointDensity")
)


@dataclass(frozen=True)
class MaterialContext:
    """What the node compiler may ask for while it compiles a tree."""

    core: ModuleType
    builder: SceneBuilder
    depsgraph: bpy.types.Depsgraph
    images: ImageCache
    report: SyncReport
    aov_names: frozenset[str] = frozenset()
    """Of the view layer's passes that materials write themselves."""
    used_images: set[int] = field(default_factory=set)
    """Handles of the images that were asked for."""
    used_layer_values: dict[str, Rgba] = field(default_factory=dict)
    used_grids: set[str] = field(default_factory=set)
    """Names of the grids that the material of a volume object reads."""

    def image_handle(self, image: bpy.types.Image, image_user: bpy.types.ImageUser | None) -> int:
        """Handle of an image in the builder; -1 for one that cannot be read, which the core draws magenta."""
        handle = self.images.handle(image, image_user, self.builder, self.report)
        self.used_images.add(handle)
        return handle

    def tile_handles(self, image: bpy.types.Image) -> list[int]:
        """Handles of a tiled image's tiles from 1001 on; -1 for those that are not there."""
        handles = self.images.tile_handles(image, self.builder, self.report)
        self.used_images.update(handles)
        return handles

    def table_handle(self, key: tuple, name: str, make: Callable[[], NDArray]) -> int:
        """Handle of an image that a node computes, unless one of an equal key is there."""
        handle = self.images.table_handle(key, name, make, self.builder)
        self.used_images.add(handle)
        return handle

    def layer_value(self, name: str) -> Rgba:
        """An attribute of the view layer, the scene or the world."""
        self.used_layer_values[name] = layer_value(self.depsgraph, name)
        return self.used_layer_values[name]

    def warn(self, text: str) -> None:
        self.report.warn(text)


@dataclass(frozen=True)
class CompiledMaterial:
    """A program of the builder; handle None where a data-block needs none."""

    handle: int | None
    images: frozenset[int]
    layer_values: dict[str, Rgba] = field(default_factory=dict)
    """Attributes of the view layer that it was made with."""
    animations: Animations = frozenset()
    """The images that follow the scene's frame."""
    grids: frozenset[str] = frozenset()
    """Of volume objects: the names that are read."""

    def has_new_layer_values(self, depsgraph: bpy.types.Depsgraph) -> bool:
        return any(layer_value(depsgraph, name) != value for name, value in self.layer_values.items())


@dataclass
class KeptMaterials:
    """What the builder holds of earlier syncs, by the session id of the original data-block."""

    compiled: dict[int, CompiledMaterial] = field(default_factory=dict)
    sets: dict[tuple[int, ...], int] = field(default_factory=dict)
    free_handles: list[int] = field(default_factory=list)
    frame: int = 0
    """Of the scene, when animations were last looked at."""

    def have_new_layer_values(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether what any was made with has changed, which may be of whatever a path leads to."""
        return any(compiled.has_new_layer_values(depsgraph) for compiled in self.compiled.values())

    def with_new_frames(self, depsgraph: bpy.types.Depsgraph) -> frozenset[int]:
        """Data-blocks whose images show another frame now, which Blender does not list."""
        frame, before = depsgraph.scene_eval.frame_current, self.frame
        self.frame = frame
        candidates = {uid for uid, compiled in self.compiled.items() if compiled.animations}
        if frame == before or not candidates:
            return frozenset()
        owners = shaded_data_blocks(depsgraph, {data_block_uid(key) for key in candidates})
        return frozenset(
            data_block_uid(key)
            for key in candidates
            if animations(owners.get(data_block_uid(key)), frame) != self.compiled[key].animations
        )


class MaterialTable:
    """Handles of compiled programs; lives as long as one sync. `compiled` counts what the builder got or lost."""

    def __init__(
        self,
        context: MaterialContext,
        override: bpy.types.Material | None = None,
        kept: KeptMaterials | None = None,
        changes: Changes = EVERYTHING,
    ) -> None:
        self._context = context
        self._override = override
        self._kept = kept if kept is not None else KeptMaterials()
        self._changes = changes
        self._checked: set[int] = set()
        self._asked: set[int] = set()
        self._in_use: set[int] = set()
        self.compiled = 0
        self.has_new_layer_values = self._kept.have_new_layer_values(context.depsgraph)
        """Whether programs may be out of date although nothing that asks for them was touched."""

    def refresh(self) -> None:
        """Compile anew what was touched, whoever asks: geometry nodes give materials to objects that are not listed."""
        compiled = {} if self._changes.is_everything else self._kept.compiled
        touched = {uid for uid, before in compiled.items() if self._is_touched(uid, before)} - _EMPTY_SLOTS
        found = shaded_data_blocks(self._context.depsgraph, {data_block_uid(key) for key in touched})
        for key in touched & (found.keys() | {volume_key(uid) for uid in found}):
            data_block = found[data_block_uid(key)]
            self._compiled_handle(key, data_block, _compiler_of(data_block) if key >= 0 else compile_volume)

    def set_handle(self, evaluated_object: bpy.types.Object) -> int:
        """Material set of an object's slots, whether they are linked to the object or to its data."""
        slots = evaluated_object.material_slots
        materials = [self._override or slot.material for slot in slots] or [self._override]
        is_cloud = is_splat_cloud(evaluated_object.data)
        handles = tuple(
            self._splat_handle() if is_cloud and m is None else self._handle(m, compile_material) for m in materials
        )
        sets = self._kept.sets
        if handles not in sets:
            sets[handles] = self._context.builder.add_material_set(list(handles), evaluated_object.name)
        return sets[handles]

    def volume_handle(self, evaluated_object: bpy.types.Object) -> tuple[int, frozenset[str]] | None:
        """Material set of a volume object, and the grids it reads: of the first slot with a volume, as in Cycles."""
        slots = evaluated_object.material_slots
        for material in [self._override or slot.material for slot in slots] or [self._override]:
            key = volume_key(_EMPTY_SLOT if material is None else original_uid(material))
            self._asked.add(key)
            handle = self._compiled_handle(key, material, compile_volume)
            if handle is not None:
                sets = self._kept.sets
                if (handle,) not in sets:
                    sets[(handle,)] = self._context.builder.add_material_set([handle], evaluated_object.name)
                return sets[(handle,)], self._kept.compiled[key].grids
        return None

    def _splat_handle(self) -> int:
        """What shows splats as they are."""
        self._asked.add(_EMPTY_SLOT_OF_SPLATS)
        return self._compiled_handle(_EMPTY_SLOT_OF_SPLATS, None, compile_splats)

    def light_handle(self, light: bpy.types.Light) -> int:
        """The program that multiplies a lamp's light, or -1 for a lamp of one colour."""
        handle = self._handle(light, compile_light)
        return -1 if handle is None else handle

    def world_handle(self, world: bpy.types.World) -> int | None:
        return self._handle(world, compile_world)

    def studio_handle(self, studio: StudioLight, world_color: tuple[float, float, float]) -> int:
        """Of what stands in for the world in a viewport."""
        key = _STUDIO_LIGHT + hash((studio, world_color)) % _STUDIO_LIGHT
        self._asked.add(key)
        return self._compiled_handle(key, None, lambda _, context: compile_studio_light(studio, world_color, context))

    def keep(self, uids: Iterable[int]) -> None:
        """Of data-blocks that are in use although nobody asked for their programs."""
        self._in_use.update(uids)

    def finish(self) -> frozenset[int]:
        """Images in use. Forgets the programs that nothing asked for, if whatever may ask has done so."""
        kept = self._kept
        unasked = set(kept.compiled) - self._asked - self._in_use
        if not self._changes.has_unlisted:
            unasked = {uid for uid in unasked if _STUDIO_LIGHT <= uid < 2 * _STUDIO_LIGHT}  # each has its own number
        for uid in unasked:
            handle = kept.compiled.pop(uid).handle
            if handle is not None:
                kept.free_handles.append(handle)
        return frozenset().union(*(compiled.images for compiled in kept.compiled.values()))

    def _handle(self, data_block: bpy.types.ID | None, compile_tree: CompileTree) -> int | None:
        uid = _EMPTY_SLOT if data_block is None else original_uid(data_block)
        self._asked.add(uid)
        return self._compiled_handle(uid, data_block, compile_tree)

    def _compiled_handle(self, uid: int, data_block: bpy.types.ID | None, compile_tree: CompileTree) -> int | None:
        if uid not in self._checked:
            self._checked.add(uid)
            before = self._kept.compiled.get(uid)
            if before is None or self._is_touched(uid, before):
                self._kept.compiled[uid] = self._compile(uid, data_block, compile_tree, before)
        return self._kept.compiled[uid].handle

    def _is_touched(self, uid: int, before: CompiledMaterial) -> bool:
        changes = self._changes
        is_listed = data_block_uid(uid) in changes.shading or (changes.has_images and bool(before.images))
        return changes.is_everything or is_listed or before.has_new_layer_values(self._context.depsgraph)

    def _compile(
        self, uid: int, data_block: bpy.types.ID | None, compile_tree: CompileTree, before: CompiledMaterial | None
    ) -> CompiledMaterial:
        self._context.report.look_up()
        self._context.used_images.clear()
        self._context.used_layer_values.clear()
        self._context.used_grids.clear()
        with self._context.report.about(("material", uid)):
            program = compile_tree(data_block, self._context)
        if compile_tree in (compile_material, compile_volume) and program is not None:
            self._context.report.matte_names["material"].add(program.name)
        handle = None if before is None else before.handle
        self.compiled += program is not None or handle is not None
        if program is not None:
            if handle is None and self._kept.free_handles:
                handle = self._kept.free_handles.pop()
            handle = self._context.builder.add_material(program, replace=handle)
        elif handle is not None:
            self._kept.free_handles.append(handle)
            handle = None
        return CompiledMaterial(
            handle,
            frozenset(self._context.used_images),
            dict(self._context.used_layer_values),
            animations(data_block, self._context.depsgraph.scene_eval.frame_current),
            frozenset(self._context.used_grids),
        )


def volume_key(uid: int) -> int:
    """Under which a material is kept as that of volume objects."""
    return ~uid


def data_block_uid(key: int) -> int:
    return key if key >= 0 else ~key


def _compiler_of(data_block: bpy.types.ID) -> CompileTree:
    if isinstance(data_block, bpy.types.Light):
        return compile_light
    return compile_world if isinstance(data_block, bpy.types.World) else compile_material


def shaded_data_blocks(depsgraph: bpy.types.Depsgraph, uids: Set[int]) -> dict[int, bpy.types.ID]:
    """The evaluated materials, worlds and lamps of these ids, as far as the dependency graph has them."""
    found: dict[int, bpy.types.ID] = {}
    for data_blocks in ((update.id for update in depsgraph.updates), depsgraph.ids):
        if found.keys() < uids:
            found |= {original_uid(i): i for i in data_blocks if isinstance(i, SHADED) and original_uid(i) in uids}
    return found


def animations(owner: bpy.types.ID | None, frame: int) -> Animations:
    """The images of a node tree that follow the scene's frame, as they are at one."""
    tree = getattr(owner, "node_tree", None)
    images = ((node.image, node.image_user) for node in all_nodes([tree] if tree else []) if _has_image(node))
    sources = (animated_source(image, image_user, frame) for image, image_user in images)
    return frozenset(source for source in sources if source is not None)


@dataclass(frozen=True)
class TreeUses:
    """What the node trees of a scene read from elsewhere."""

    attributes: frozenset[str] = frozenset()
    instance_values: frozenset[str] = frozenset()
    images: tuple[tuple[bpy.types.Image, bpy.types.ImageUser], ...] = ()


def tree_uses(depsgraph: bpy.types.Depsgraph, only_updated: bool = False) -> TreeUses:
    """Mesh attributes, values of instances and images that any material, world or lamp of the scene names, or
    any of those that the last evaluation touched."""
    data_blocks = (update.id for update in depsgraph.updates) if only_updated else depsgraph.ids
    owners = (i for i in data_blocks if isinstance(i, SHADED))
    attributes: set[str] = set()
    instance_values: set[str] = set()
    images: dict[int, tuple[bpy.types.Image, bpy.types.ImageUser]] = {}
    for node in all_nodes(owner.node_tree for owner in owners if owner.node_tree is not None):
        instance_values |= value_names(node)
        attributes |= output_attributes(node)
        if getattr(node, "attribute_type", "GEOMETRY") == "GEOMETRY":
            attributes.add(getattr(node, "attribute_name", ""))
        if _reads_generated(node):
            attributes.add(GENERATED)
        if node.bl_idname == "ShaderNodeVertexColor":
            attributes.add(node.layer_name or RENDER_COLOR)
        if node.bl_idname == "ShaderNodeUVMap":
            attributes.add(node.uv_map)  # which may be of another kind
        if _has_image(node):
            images.setdefault(node.image.as_pointer(), (node.image, node.image_user))
    return TreeUses(frozenset(attributes - {""}), frozenset(instance_values), tuple(images.values()))


def _reads_generated(node: bpy.types.Node) -> bool:
    """Whether it may: textures do without a vector, and tangents around an axis of the object, of anisotropic
    closures too."""
    if node.bl_idname == "ShaderNodeTexCoord":
        return node.outputs["Generated"].is_linked
    if node.bl_idname == "ShaderNodeNewGeometry":
        return node.outputs["Tangent"].is_linked
    if node.bl_idname == "ShaderNodeTangent":
        return node.direction_type == "RADIAL"
    free = {socket.identifier for socket in node.inputs if not socket.is_linked}
    if node.bl_idname.startswith("ShaderNodeTex"):
        return "Vector" in free and node.bl_idname not in _WITHOUT_GENERATED
    anisotropy = node.inputs.get("Anisotropic") or node.inputs.get("Anisotropy")
    is_anisotropic = anisotropy is not None and (
        anisotropy.is_linked or getattr(anisotropy, "default_value", 0.0) != 0.0
    )
    return is_anisotropic and "Tangent" in free


def _has_image(node: bpy.types.Node) -> bool:
    return getattr(node, "image", None) is not None and hasattr(node, "image_user")
