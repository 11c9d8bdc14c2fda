"""A stand-in for `cistern_core` that records what it is given and is as strict about arrays as the real one."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

NATIVE = Path(__file__).resolve().parents[2] / "native"
STUB = NATIVE / "binding" / "cistern_core.pyi"
OP_TABLE = NATIVE / "scene" / "op_table.cpp"


class MaterialProgram:
    def __init__(self, name: str) -> None:
        self.name = name
        self.steps: list[tuple] = []
        self.pass_index, self.has_transparent_shadow, self.corrects_bumps = 0.0, True, True

    def _operand(self, *step: Any) -> int:
        self.steps.append(step)
        return len(self.steps) - 1

    def constant(self, x: float, y: float = 0.0, z: float = 0.0) -> int:
        return self._operand("constant", x, y, z)

    def emit(
        self, op: str, inputs: Sequence[int] = (), parameters: Sequence[int] = (), output: int | None = None
    ) -> int:
        return self._operand("emit", op, tuple(inputs), tuple(parameters), output)

    def closure(self, op: str, inputs: Sequence[int], parameters: Sequence[int] = ()) -> None:
        self._operand("closure", op, tuple(inputs), tuple(parameters))

    def attribute(self, name: str) -> int:
        return self._operand("attribute", name)

    def table(self, values: np.ndarray, alpha: np.ndarray | None = None) -> int:
        return self._operand("table", values, alpha)

    def image(self, handle: int) -> int:
        return self._operand("image", handle)

    def tiles(self, images: Sequence[int]) -> int:
        return self._operand("tiles", tuple(images))


def _signatures() -> dict[str, tuple[list[str], set[str], bool]]:
    """Method of SceneBuilder -> (names in order, required ones, takes more keywords), read from the contract itself."""
    classes = (node for node in ast.parse(STUB.read_text()).body if isinstance(node, ast.ClassDef))
    builder = next(node for node in classes if node.name == "SceneBuilder")
    found = {}
    for method in (node for node in builder.body if isinstance(node, ast.FunctionDef)):
        names = [argument.arg for argument in method.args.args][1:]
        required = set(names[: len(names) - len(method.args.defaults)])
        found[method.name] = (names, required, method.args.kwarg is not None)
    return found


_COMMON_OF_LIGHTS = {
    "object_to_world",
    "visibility",
    "casts_shadow",
    "use_mis",
    "max_bounces",
    "material",
    "light_group",
    "key",
    "lit_sets",
    "blocker_sets",
    "replace",
}
_SIGNATURES = _signatures()


def check_array(values: np.ndarray, dtype: type, *shape: int | None) -> None:
    assert isinstance(values, np.ndarray)
    assert values.dtype == dtype, (values.dtype, dtype)
    assert values.flags.c_contiguous
    assert len(values.shape) == len(shape), (values.shape, shape)
    assert all(want is None or have == want for have, want in zip(values.shape, shape, strict=True)), values.shape


class SceneBuilder:
    """`calls` holds (method, arguments) in order; handles count up per kind."""

    singular_instances = 0

    def __init__(self) -> None:
        self.calls: list[tuple[str, dict[str, Any]]] = []
        self._handles: dict[str, int] = {}

    def of(self, method: str) -> list[dict[str, Any]]:
        return [arguments for name, arguments in self.calls if name == method]

    @staticmethod
    def mesh_statistics(handle: int) -> dict[str, int]:
        return {"triangles": 1, "dropped_triangles": 0, "memory_bytes": 1}

    def __getattr__(self, method: str):
        if method not in _SIGNATURES:
            raise AttributeError(method)

        def call(*positional: Any, **named: Any) -> int:
            return self._record(method, positional, named)

        return call

    def _record(self, method: str, positional: tuple, named: dict[str, Any]) -> int:
        names, required, takes_more = _SIGNATURES[method]
        arguments = dict(zip(names, positional, strict=False)) | named
        unknown = set(arguments) - set(names) - (_COMMON_OF_LIGHTS if takes_more else set())
        assert required <= set(arguments) and not unknown, (method, required - set(arguments), unknown)
        checker = getattr(self, f"check_{method}", None)
        if checker is not None:
            checker(**arguments)
        self.calls.append((method, arguments))
        kind = "add_mesh" if method in ("add_strands", "add_splats") else method  # which are meshes
        handle = self._handles.get(kind, 0)
        self._handles[kind] = handle + (len(arguments["mesh"]) if method == "add_instances" else 1)
        return handle

    @staticmethod
    def check_add_mesh(
        name,
        positions,
        corner_vertices,
        polygon_offsets=None,
        triangle_corners=None,
        triangle_polygons=None,
        material_indices=None,
        normals=None,
        normals_domain="FACE",
        sharp_faces=None,
        attributes=(),
        subdivision=None,
        texture_space=None,
        replace=None,
    ) -> None:
        check_array(positions, np.float32, None, 3)
        check_array(corner_vertices, np.int32, None)
        polygons = len(corner_vertices) // 3
        if polygon_offsets is not None:
            check_array(polygon_offsets, np.int32, None)
            polygons = len(polygon_offsets) - 1
            assert polygon_offsets[0] == 0 and polygon_offsets[-1] == len(corner_vertices)
        lengths = {"POINT": len(positions), "CORNER": len(corner_vertices), "FACE": polygons}
        if triangle_corners is not None:
            check_array(triangle_corners, np.int32, None, 3)
            check_array(triangle_polygons, np.int32, len(triangle_corners))
        if material_indices is not None:
            check_array(material_indices, np.int32, polygons)
        assert (normals is None) == (normals_domain == "FACE")
        if normals is not None:
            check_array(normals, np.float32, lengths[normals_domain], 3)
        if sharp_faces is not None:
            check_array(sharp_faces, np.uint8, polygons)
        for _, domain, values in attributes:
            check_array(values, np.float32, lengths[domain], None)
            assert 1 <= values.shape[1] <= 4
        if texture_space is not None:
            check_array(texture_space, np.float32, 2, 3)

    @staticmethod
    def check_add_strands(name, positions, radii, strand_offsets, material_indices=None, attributes=(), **_) -> None:
        check_array(positions, np.float32, None, 3)
        check_array(radii, np.float32, len(positions))
        check_array(strand_offsets, np.int32, None)
        strands = len(strand_offsets) - 1
        assert strand_offsets[0] == 0 and strand_offsets[-1] == len(positions) and (np.diff(strand_offsets) >= 0).all()
        if material_indices is not None:
            check_array(material_indices, np.int32, strands)
        for _, domain, values in attributes:
            check_array(values, np.float32, {"POINT": len(positions), "FACE": strands}[domain], None)
            assert 1 <= values.shape[1] <= 4

    @staticmethod
    def check_add_splats(
        name, positions, scales, rotations, radiance, harmonics=None, to_working_space=None, attributes=(), **_
    ) -> None:
        check_array(positions, np.float32, None, 3)
        check_array(scales, np.float32, len(positions), 3)
        check_array(rotations, np.float32, len(positions), 4)
        check_array(radiance, np.float32, len(positions), 4)
        if harmonics is not None:
            check_array(harmonics, np.uint8, len(positions), 15, 3)
        assert to_working_space is None or len(to_working_space) == 9
        for _, _, values in attributes:
            check_array(values, np.float32, len(positions), None)

    @staticmethod
    def check_add_instances(
        mesh,
        material_set,
        object,  # noqa: A002
        object_to_world,
        visibility,
        holdout=None,
        random=None,
        keys=None,
        values=None,
        link_sets=None,
        links=None,
        shadow_catcher=None,
        light_group=None,
    ) -> None:
        if shadow_catcher is not None:
            check_array(shadow_catcher, np.uint8, len(mesh))
        if light_group is not None:
            check_array(light_group, np.int16, len(mesh))
        assert (link_sets is None) == (links is None)
        if links is not None:
            check_array(link_sets, np.uint8, len(mesh), 2)
            check_array(links, np.uint64, len(mesh), 2)
            assert link_sets.max(initial=0) < 64
        check_array(values, np.int32, len(mesh))
        check_array(keys, np.uint64, len(mesh))
        for column in (mesh, material_set, object):
            check_array(column, np.int32, len(mesh))
        check_array(object_to_world, np.float32, len(mesh), 4, 4)
        for column in (visibility, holdout):
            check_array(column, np.uint8, len(mesh))
        check_array(random, np.float32, len(mesh))

    @staticmethod
    def check_set_instance_values(names, rows) -> None:
        check_array(rows, np.float32, None, len(names), 4)

    @staticmethod
    def check_add_image(name, pixels, transfer="LINEAR", to_working_space=None, **_) -> None:
        assert pixels.ndim == 3 and pixels.dtype in (np.uint8, np.uint16, np.float16, np.float32)
        assert pixels.flags.c_contiguous and transfer in ("LINEAR", "SRGB")
        assert to_working_space is None or len(to_working_space) == 9

    @staticmethod
    def check_set_camera(camera_to_world, **_) -> None:
        check_array(camera_to_world, np.float32, 4, 4)


def describe_ops() -> dict[str, tuple[str, str, int, bool]]:
    """Read from the core's own table."""
    rows = re.findall(r'\{"(\w+)", "(\w*)", (\'\w\'|0), (\d+), (true|false)\}', OP_TABLE.read_text())
    return {
        name: (inputs, output.strip("'0"), int(count), closure == "true")
        for name, inputs, output, count, closure in rows
    }


CORE = SimpleNamespace(SceneBuilder=SceneBuilder, MaterialProgram=MaterialProgram, describe_ops=describe_ops)
