"""The meshes of a scene in a builder: each evaluated geometry once, and from sync to sync only what changed."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Hashable, Set
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import bpy
import numpy as np

from . import SyncReport
from .changes import original_uid
from .drift import Drift
from .fluid_grids import gas_arrays, gas_domain
from .meshes import MeshArrays, mesh_arrays, whole_mesh
from .points import point_arrays
from .splats import SplatArrays, is_splat_cloud, splat_arrays
from .strands import StrandArrays, curve_arrays, particle_arrays
from .subdivision import Subdivision, final_mesh
from .volume_drift import volume_drift
from .volume_grids import volume_arrays, volume_version

if TYPE_CHECKING:
    from cistern_core import SceneBuilder

# Ray tracing leaves out triangles beyond this, in metres (Embree's largest coordinate, rounded).
_LARGEST_COORDINATE = 1.8e18


@dataclass(frozen=True)
class PlacedMesh:
    """A mesh of the builder."""

    handle: int
    flat_axis: int
    version: int
    """See mesh_version. 0: unknown, as while the mesh is edited."""
    warnings: tuple[str, ...] = ()
    subdivision: Subdivision | None = None


@dataclass
class KeptMeshes:
    """What the builder holds of earlier syncs, by the object that showed a geometry first and a count of its own."""

    by_owner: dict[tuple[int, int], PlacedMesh] = field(default_factory=dict)
    editions: Counter[int] = field(default_factory=Counter)
    """How often meshes were changed, by the session ids of the original ones."""
    attributes: frozenset[str] = frozenset()
    free_handles: list[int] = field(default_factory=list)


class MeshTable:
    """Lives as long as one sync. `exported` counts the meshes that were read from Blender."""

    def __init__(
        self,
        builder: SceneBuilder,
        wanted_attributes: Set[str],
        report: SyncReport,
        kept: KeptMeshes,
        changed: Set[int] = frozenset(),
    ) -> None:
        """`changed`: session ids of the original meshes that were."""
        self._builder = builder
        self._wanted_attributes = frozenset(wanted_attributes)
        self._report = report
        self._kept = kept
        kept.editions.update(changed)
        self.knows_attributes = self._wanted_attributes <= kept.attributes
        """Whether the meshes of the last sync have the attributes that are wanted now."""
        known = kept.by_owner.values() if self.knows_attributes else ()
        # With levels of 0, objects with and without adaptive subdivision have one and the same mesh.
        self._by_version = {(mesh.version, mesh.subdivision): mesh for mesh in known if mesh.version}
        self._by_address: dict[tuple[int, Hashable], PlacedMesh | None] = {}
        self._by_owner: dict[tuple[int, int], PlacedMesh] = {}
        self._used: set[int] = set()
        self._counts: Counter[int] = Counter()
        self._empty: PlacedMesh | None = None
        self.seconds = 0.0
        self.exported = 0

    def placed(
        self, obj: bpy.types.Object, owner: int, subdivision: Subdivision | None = None, drift: Drift | None = None
    ) -> PlacedMesh | None:
        """The mesh that an evaluated object shows; None for one without polygons. `owner` is the object's id."""
        address = (obj.data.as_pointer(), (subdivision, drift))
        if address not in self._by_address:
            self._report.look_up()
            start = time.perf_counter()
            self._by_address[address] = self._place(obj, owner, subdivision, drift)
            self.seconds += time.perf_counter() - start
        return self._by_address[address]

    def placed_hair(self, obj: bpy.types.Object, number: int, owner: int, is_render: bool) -> PlacedMesh | None:
        """The strands of modifier `number`, a particle system, of an evaluated object; None for one without any."""
        address = (obj.as_pointer(), number)
        if address not in self._by_address:
            self._report.look_up()
            start = time.perf_counter()
            modifier = obj.modifiers[number]
            arrays = particle_arrays(obj, modifier, is_render, self._wanted_attributes)
            name = f"{obj.name} {modifier.particle_system.name}"
            self._by_address[address] = self._place_strands(arrays, f"Particle system '{name}'", name, owner)
            self.seconds += time.perf_counter() - start
        return self._by_address[address]

    def placed_volume(
        self, obj: bpy.types.Object, owner: int, names: frozenset[str], frame: int, drift: Drift | None = None
    ) -> PlacedMesh | None:
        """The box of an evaluated volume object, or domain of gas, whose material reads the grids `names`; None for one
        without any."""
        address = (obj.data.as_pointer(), (names, drift))
        if address not in self._by_address:
            self._report.look_up()
            start = time.perf_counter()
            self._by_address[address] = self._place_volume(obj, owner, names, frame, drift)
            self.seconds += time.perf_counter() - start
        return self._by_address[address]

    def _place_volume(
        self, obj: bpy.types.Object, owner: int, names: frozenset[str], frame: int, drift: Drift | None
    ) -> PlacedMesh | None:
        key = (owner, self._counts[owner])
        self._counts[owner] += 1
        is_volume = isinstance(obj.data, bpy.types.Volume)
        goes_on = volume_drift(obj.data, drift) if is_volume else None
        version = volume_version(obj.data, names, goes_on) if is_volume else 0
        mesh = self._by_version.get((version, None))
        if mesh is None:
            heard = SyncReport(is_stopped=self._report.is_stopped)
            if is_volume:
                arrays = volume_arrays(obj.data, f"Object '{obj.name}'", names, heard, goes_on)
            else:
                arrays = gas_arrays(obj, gas_domain(obj), frame, names, heard)
            if arrays is None:
                for text in heard.warnings:
                    self._report.warn(text)
                return None
            self.exported += 1
            handle = self._builder.add_volume(obj.data.name, **vars(arrays), replace=self._handle_for(key))
            mesh = PlacedMesh(handle, -1, version, tuple(heard.warnings))
            if version:
                self._by_version[version, None] = mesh
        self._used.add(mesh.handle)
        self._by_owner[key] = mesh
        return mesh

    def empty(self) -> PlacedMesh:
        """A mesh without points: what is placed, but has no shape."""
        if self._empty is None:
            handle = self._builder.add_mesh("", np.empty((0, 3), np.float32), np.empty(0, np.int32))
            self._empty = PlacedMesh(handle, -1, 0)
        return self._empty

    def keep(self, handle: int) -> None:
        """Strands of the last sync that are shown again."""
        if handle not in self._used:
            self._used.add(handle)
            for key, mesh in self._kept.by_owner.items():
                if mesh.handle == handle:
                    owner, number = key
                    self._by_owner[key] = mesh
                    self._counts[owner] = max(self._counts[owner], number + 1)  # the key is taken

    def finish(self) -> None:
        """Free what no object showed, and remember the rest for the next sync."""
        kept = self._kept
        for handle in {mesh.handle for mesh in kept.by_owner.values()} - self._used:
            self._builder.remove_mesh(handle)
            kept.free_handles.append(handle)
        kept.by_owner, kept.attributes = self._by_owner, self._wanted_attributes

    def _place(
        self, obj: bpy.types.Object, owner: int, subdivision: Subdivision | None, drift: Drift | None
    ) -> PlacedMesh | None:
        if isinstance(obj.data, bpy.types.Curves):
            arrays = curve_arrays(obj.data, self._wanted_attributes, drift)
            return self._place_strands(arrays, f"Curves '{obj.data.name}'", obj.data.name, owner)
        if isinstance(obj.data, bpy.types.PointCloud):
            label = f"Point cloud '{obj.data.name}'"
            if is_splat_cloud(obj.data):
                return self._place_splats(splat_arrays(obj.data, self._wanted_attributes), label, obj.data.name, owner)
            arrays = point_arrays(obj.data, self._wanted_attributes, drift)
            return self._place_strands(arrays, label, obj.data.name, owner)
        key = self._next_key(owner)
        version = mesh_version(obj.data, self._kept.editions)
        mesh = self._by_version.get((version, subdivision)) or self._export(obj, key, subdivision, drift)
        if mesh is not None:
            self._used.add(mesh.handle)
            self._by_owner[key] = mesh
        return mesh

    def _handle_for(self, key: tuple[int, int]) -> int | None:
        """The handle whose mesh is to be replaced; None for a new one."""
        before = self._kept.by_owner.get(key)
        if before is not None and before.handle not in self._used:
            self._by_version.pop((before.version, before.subdivision), None)
            return before.handle
        return self._kept.free_handles.pop() if self._kept.free_handles else None

    def _export(
        self, obj: bpy.types.Object, key: tuple[int, int], subdivision: Subdivision | None, drift: Drift | None
    ) -> PlacedMesh | None:
        arrays = read_mesh(obj, self._wanted_attributes, subdivision, drift)
        if arrays is None:
            return None
        self.exported += 1
        name = obj.data.name
        flat_axis = next((axis for axis in range(3) if not arrays.positions[:, axis].any()), -1)
        handle = self._builder.add_mesh(name, **vars(arrays), replace=self._handle_for(key))
        # Triangles without area are dropped too, but nobody misses them.
        dropped = self._builder.mesh_statistics(handle)["dropped_triangles"]
        warnings = ()
        if dropped and not np.isfinite(arrays.positions).all():
            warnings = (f"Mesh '{name}': coordinates are not finite, {dropped} triangles are left out",)
        elif np.abs(arrays.positions).max(initial=0.0) > _LARGEST_COORDINATE:
            warnings = (f"Mesh '{name}': triangles beyond {_LARGEST_COORDINATE:.1e} m are left out",)
        version = 0 if obj.data.is_editmode else mesh_version(obj.data, self._kept.editions)
        return PlacedMesh(handle, flat_axis, version, warnings, subdivision)

    def _place_strands(self, arrays: StrandArrays | None, label: str, name: str, owner: int) -> PlacedMesh | None:
        """`label`: as a warning calls them."""
        key = self._next_key(owner)
        if arrays is None:
            return None
        handle = self._builder.add_strands(name, **vars(arrays), replace=self._handle_for(key))
        warnings = []
        if self._builder.mesh_statistics(handle)["dropped_triangles"]:
            warnings.append(f"{label}: what has positions or radii that are not finite is left out")
        counts = np.diff(arrays.strand_offsets)
        if arrays.shape != "BALLS" and (counts < 2).any():
            warnings.append(f"{label}: strands with fewer than two keys are left out")
        return self._placed(key, handle, warnings)

    def _place_splats(self, arrays: SplatArrays | None, label: str, name: str, owner: int) -> PlacedMesh | None:
        key = self._next_key(owner)
        if arrays is None:
            return None
        handle = self._builder.add_splats(name, **vars(arrays), replace=self._handle_for(key))
        dropped = self._builder.mesh_statistics(handle)["dropped_triangles"]
        text = f"{label}: {dropped} splats are left out, whose values are not finite, or whose scale or rotation is 0"
        return self._placed(key, handle, [text] if dropped else [])

    def _next_key(self, owner: int) -> tuple[int, int]:
        key = (owner, self._counts[owner])
        self._counts[owner] += 1
        return key

    def _placed(self, key: tuple[int, int], handle: int, warnings: list[str]) -> PlacedMesh:
        """Of strands and splats: Blender does not tell one evaluation of them from another."""
        self.exported += 1
        mesh = PlacedMesh(handle, -1, 0, tuple(warnings))
        self._used.add(handle)
        self._by_owner[key] = mesh
        return mesh


def mesh_version(mesh: bpy.types.Mesh, editions: Counter[int]) -> int:
    """A number that stands for an evaluated mesh as it is now. Blender gives a new session id to the result of every
    evaluation; from 5.3 on, to what is but the original mesh it gives none. 0: unknown."""
    origin = original_uid(mesh)
    return mesh.session_uid or (hash((origin, editions[origin])) if origin else 0)


def read_mesh(
    obj: bpy.types.Object,
    wanted_attributes: Set[str],
    subdivision: Subdivision | None = None,
    drift: Drift | None = None,
) -> MeshArrays | None:
    """Arrays of the mesh of an evaluated object; None for one without polygons.

    While a mesh is edited, Blender keeps it in another form and has to be asked for a copy."""
    groups = {group.name: group.index for group in obj.vertex_groups}
    if not obj.data.is_editmode:
        with final_mesh(obj, subdivision) as mesh:
            return mesh_arrays(mesh, wanted_attributes, subdivision, groups, drift) if len(mesh.polygons) else None
    with whole_mesh(obj, obj.data) as mesh:
        return mesh_arrays(mesh, wanted_attributes, vertex_groups=groups) if len(mesh.polygons) else None
