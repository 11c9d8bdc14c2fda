"""A builder kept up to date with the scene of a 3D viewport, evaluation after evaluation."""

from __future__ import annotations

import importlib
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from types import ModuleType
from typing import TYPE_CHECKING, Any

import bpy

from . import SyncReport
from .changes import EVERYTHING, Changes, original_uid
from .images import ImageCache
from .instances import InstanceSync, KeptInstances, follow_moves
from .materials import KeptMaterials, MaterialContext, MaterialTable, TreeUses, tree_uses
from .scene import timed
from .studio_light import SCENE_LIGHTING, ViewportLighting, viewport_lighting
from .world import environment_arguments

if TYPE_CHECKING:
    from cistern_core import SceneBuilder


@dataclass
class Exported:
    """How much of the builder's scene one sync replaced."""

    materials: int = 0
    meshes: int = 0
    lamps: int = 0
    instances: bool = False
    environment: bool = False

    @property
    def is_anything(self) -> bool:
        return any(vars(self).values())


@dataclass
class KeptScene:
    """What the builder holds, in plain numbers and arrays: no reference to Blender's data outlives a sync."""

    builder: SceneBuilder
    scene: int
    """Session id of the scene, and the view layer's name below: another one shares nothing."""
    layer: str
    materials: KeptMaterials = field(default_factory=KeptMaterials)
    instances: KeptInstances = field(default_factory=KeptInstances)
    uses: TreeUses = field(default_factory=TreeUses)
    environment: dict[str, Any] = field(default_factory=dict)
    lighting: ViewportLighting = SCENE_LIGHTING
    warnings: dict[Hashable, dict[str, None]] = field(default_factory=dict)
    """By what they tell of, see SyncReport."""

    def take_warnings(self, report: SyncReport) -> None:
        """Let the report tell of all that is there, be it looked at in this sync or not."""
        told = report.earlier | report.by_source
        self.warnings = {source: texts for source, texts in told.items() if self._is_there(source)}
        report.warnings = list(dict.fromkeys(text for texts in self.warnings.values() for text in texts))

    def _is_there(self, source: Hashable) -> bool:
        kind, key = source if isinstance(source, tuple) else (source, None)
        kept = {
            "material": self.materials.compiled,
            "object": self.instances.prototypes,
            "lamp": self.instances.lamps.placed,
        }
        return kind not in kept or key in kept[kind]


class LiveSync:
    """Syncs one viewport's scene. Moved objects cost their matrices; touched lamps, materials and meshes themselves;
    what may have come or gone costs a look at every item. `exported` tells of the last sync."""

    def __init__(self, core: ModuleType | None = None) -> None:
        self._core = core if core is not None else importlib.import_module("cistern_core")
        self._images = ImageCache()
        self._kept: KeptScene | None = None
        self.exported = Exported()

    @property
    def builder(self) -> SceneBuilder | None:
        """Holds the last synced scene, save the camera; None before the first one and after a failed one."""
        return None if self._kept is None else self._kept.builder

    def close(self) -> None:
        """Drop the scene and stop the decoding threads."""
        self._kept = None
        self._images.close()

    def sync(
        self, depsgraph: bpy.types.Depsgraph, changes: Changes, space: bpy.types.SpaceView3D | None = None
    ) -> SyncReport:
        """Bring the builder up to date; `space` may hide objects. The report's warnings are those of the whole scene.
        Lets the core's Error through, after which the next sync starts anew."""
        self.exported = Exported()
        kept = self._kept
        scene, layer = original_uid(depsgraph.scene), depsgraph.view_layer.name
        if kept is None or (kept.scene, kept.layer) != (scene, layer):
            kept, changes = KeptScene(self._core.SceneBuilder(), scene, layer), EVERYTHING
        self._kept = None
        report = SyncReport(earlier={source: texts for source, texts in kept.warnings.items() if source is not None})
        animated = kept.materials.with_new_frames(depsgraph)
        changes = replace(changes, shading=changes.shading | animated) if animated else changes
        changes = kept.instances.with_new_traits(depsgraph, changes)
        lighting, before = viewport_lighting(space), kept.lighting
        kept.lighting = lighting
        if lighting.has_lamps != before.has_lamps:
            changes = replace(changes, has_unlisted=True)
        placed = kept.instances.arrays
        if not (
            lighting == before
            and changes.are_moves_only
            and not kept.materials.have_new_layer_values(depsgraph)
            and follow_moves(depsgraph, kept.builder, kept.instances, changes.moved, report)
        ):
            self._sync(depsgraph, kept, changes, space, report)
        kept.take_warnings(report)
        self.exported.instances = kept.instances.arrays is not placed
        self._kept = kept
        return report

    def _sync(
        self,
        depsgraph: bpy.types.Depsgraph,
        kept: KeptScene,
        changes: Changes,
        space: bpy.types.SpaceView3D | None,
        report: SyncReport,
    ) -> None:
        if changes.is_everything:
            self._images.begin(depsgraph.scene_eval.frame_current)
        else:
            self._images.begin_again(changes.has_images, depsgraph.scene_eval.frame_current)
        with timed(report, "trees"):
            kept.uses = self._tree_uses(depsgraph, changes, kept.uses)
        context = MaterialContext(self._core, kept.builder, depsgraph, self._images, report)
        override = depsgraph.view_layer_eval.material_override
        materials = MaterialTable(context, override, kept.materials, changes)
        materials.refresh()
        with timed(report, "world"):
            environment = environment_arguments(depsgraph, materials, studio=kept.lighting.studio)
            if environment != kept.environment:
                kept.builder.set_environment(**environment)
        with timed(report, "instances"):
            instances = InstanceSync(
                depsgraph, kept.builder, materials, kept.uses, report, kept.instances, changes, space
            )
            instances.run()
        self._images.free_unused(kept.builder, materials.finish())
        self.exported = Exported(materials.compiled, instances.meshes.exported, instances.lamps.exported)
        self.exported.environment = environment != kept.environment
        kept.environment = environment
        report.seconds["meshes"] = instances.meshes.seconds

    def _tree_uses(self, depsgraph: bpy.types.Depsgraph, changes: Changes, before: TreeUses) -> TreeUses:
        """What node trees name, save images, which start being decoded."""
        is_partial = not (changes.has_unlisted or changes.has_images)
        uses = tree_uses(depsgraph, only_updated=is_partial)
        for image, image_user in uses.images:
            self._images.prefetch(image, image_user)
        if not is_partial:
            return TreeUses(uses.attributes, uses.instance_values)
        return TreeUses(before.attributes | uses.attributes, before.instance_values | uses.instance_values)
