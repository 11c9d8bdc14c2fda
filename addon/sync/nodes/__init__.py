"""Shader node trees to material programs of the core.

`context` offers `core` (the module cistern_core), `image_handle(image, image_user) -> int` (-1: missing),
`tile_handles(image) -> list[int]`, `table_handle(key, name, make) -> int` and `warn(text)`. Nothing here raises for
what a tree contains: what cannot be expressed becomes a default, with one line per material that says so.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import bpy

from .. import versions
from . import (  # noqa: F401 - they register
    aovs,
    closures,
    color,
    converter,
    displacement,
    hair,
    ies,
    inputs,
    rays,
    sky,
    textures,
    vector,
    volumes,
)
from .compiler import Compiler, Context, TreeKind, flatten_shader
from .graph import Port, active_output, scope_of, socket_named, source_of
from .instructions import COLOR, MAX_REGISTERS, constant
from .lobes import MAX_LOBES, most_lobes

if TYPE_CHECKING:
    from cistern_core import MaterialProgram

SPLAT_RADIANCE = "radiance"  # that splats have without there being such an attribute
DEFAULT_NAME = "default_surface"  # as Cycles calls it, whose mattes go by names
DEFAULT_SURFACE = (0.8, 0.8, 0.8)  # of what has no material, before Blender 5.0
WHITE = (1.0, 1.0, 1.0)
ONE = constant(1.0)
RECURSION_LIMIT = 10000  # a node takes about seven calls


def compile_material(material: bpy.types.Material | None, context: Context) -> MaterialProgram:
    """The program of a material; of None, what an object without one looks like. Without a surface it is black."""
    program = _compile_material(material, context)
    if material is not None:
        program.pass_index = material.pass_index
        program.has_transparent_shadow = material.use_transparent_shadow
        program.corrects_bumps = bool(versions.cycles_setting(material, "use_bump_map_correction", True))
    return program


def _compile_material(material: bpy.types.Material | None, context: Context) -> MaterialProgram:
    name = material.name if material else DEFAULT_NAME
    owner = f"Material '{name}'"
    if material is None and versions.materials_are_trees():
        return _compile(closures.new_principled, name, owner, context, TreeKind.SURFACE)
    if material is None or not versions.uses_nodes(material):
        rgb = tuple(material.diffuse_color[:3]) if material else DEFAULT_SURFACE
        return _compile(lambda compiler: _diffuse(compiler, rgb), name, owner, context, TreeKind.SURFACE)
    surface = _output_port(material, "ShaderNodeOutputMaterial")

    def build(compiler: Compiler) -> None:
        compiler.pass_index = material.pass_index
        if surface is not None:
            displacement.displace(compiler, surface, material.displacement_method)
            _flatten_surface(compiler, surface)
            volumes.add_medium(compiler, _volume_port(surface))
            aovs.write_aovs(compiler, surface.scope)

    return _compile(build, name, owner, context, TreeKind.SURFACE)


def compile_splats(_: None, context: Context) -> MaterialProgram:
    """The program of Gaussian splats without a material: they shine as they were seen."""

    def build(compiler: Compiler) -> None:
        radiance = compiler.code.emit("ATTRIBUTE", (), (compiler.code.program.attribute(SPLAT_RADIANCE), 0))
        compiler.code.closure("CLOSURE_EMISSION", (ONE, radiance, ONE))

    return _compile(build, "default_gsplat", "Gaussian splats", context, TreeKind.SURFACE)


def compile_volume(material: bpy.types.Material | None, context: Context) -> MaterialProgram | None:
    """What a material makes of the grids of a volume object; None where it has no volume. Tells the context which."""
    if material is not None and not versions.uses_nodes(material):
        return None
    name = material.name if material else "default_volume"
    surface = _output_port(material, "ShaderNodeOutputMaterial") if material else None
    if material is not None and (surface is None or source_of(_volume_port(surface)) is None):
        return None
    names: set[str] = set()

    def build(compiler: Compiler) -> None:
        compiler.grids = names
        compiler.code.program.is_boundary = True
        compiler.code.closure("CLOSURE_TRANSPARENT", (ONE, constant(*WHITE, COLOR)))
        if surface is None:
            return volumes.add_default_medium(compiler)
        compiler.pass_index = material.pass_index
        return volumes.add_medium(compiler, _volume_port(surface))

    program = _compile(build, name, f"Material '{name}'", context, TreeKind.SURFACE)
    program.pass_index = material.pass_index if material else 0
    context.used_grids.update(names)
    return program


def compile_world(world: bpy.types.World | None, context: Context) -> MaterialProgram | None:
    """The program of a world, whose emission is the radiance from a direction; None for a black one."""
    if world is None:
        return None
    owner = f"World '{world.name}'"
    if not versions.uses_nodes(world):
        rgb = tuple(world.color[:3])
        if not any(rgb):
            return None
        return _compile(lambda compiler: _emit(compiler, rgb), world.name, owner, context, TreeKind.WORLD)
    surface = _output_port(world, "ShaderNodeOutputWorld")

    def build(compiler: Compiler) -> None:
        flatten_shader(compiler, surface, ONE)
        volumes.add_medium(compiler, _volume_port(surface))
        aovs.write_aovs(compiler, surface.scope)

    return _compile(build, world.name, owner, context, TreeKind.WORLD, needs_closures=True) if surface else None


def compile_light(light: bpy.types.Light, context: Context) -> MaterialProgram | None:
    """The program that scales a lamp's own emission; None where the tree leaves it as it is (white, strength 1).

    A tree without an output is black, as in Cycles."""
    if not versions.uses_nodes(light):
        return None
    surface = _output_port(light, "ShaderNodeOutputLight")
    source = source_of(surface) if surface else None
    if source is not None and source.node.bl_idname == "ShaderNodeEmission" and _is_plain_emission(source):
        return None

    def build(compiler: Compiler) -> None:
        if surface is not None:
            flatten_shader(compiler, surface, ONE)

    kind = TreeKind.AREA_LAMP if light.type == "AREA" else TreeKind.LAMP
    return _compile(build, light.name, f"Light '{light.name}'", context, kind)


def _is_plain_emission(source: Port) -> bool:
    color_socket, strength = (socket_named(source.node.inputs, name) for name in ("Color", "Strength"))
    changed = source.node.mute or any(source.scope.link_into(source.node, s) for s in (color_socket, strength))
    return not changed and tuple(color_socket.default_value[:3]) == WHITE and strength.default_value == 1.0


def _output_port(block: bpy.types.Material | bpy.types.World | bpy.types.Light, idname: str) -> Port | None:
    scope = scope_of(block, idname)
    node = active_output(scope.tree, idname)
    return Port(scope, node, socket_named(node.inputs, "Surface")) if node else None


def _volume_port(surface: Port) -> Port:
    return Port(surface.scope, surface.node, socket_named(surface.node.inputs, "Volume"))


def _flatten_surface(compiler: Compiler, surface: Port) -> None:
    """A volume without a surface is passed through, everything else without one is black."""
    volume = _volume_port(surface).socket
    has_surface = surface.scope.link_into(surface.node, surface.socket) is not None
    if not has_surface and surface.scope.link_into(surface.node, volume) is not None:
        compiler.code.program.is_boundary = True
        compiler.code.closure("CLOSURE_TRANSPARENT", (ONE, constant(*WHITE, COLOR)))
    flatten_shader(compiler, surface, ONE)


def _diffuse(compiler: Compiler, rgb: Sequence[float]) -> None:
    normal = compiler.code.emit("NORMAL")
    compiler.code.closure("CLOSURE_DIFFUSE", (ONE, constant(*rgb, COLOR), constant(0.0), normal), (0,))


def _emit(compiler: Compiler, rgb: Sequence[float]) -> None:
    compiler.code.closure("CLOSURE_EMISSION", (ONE, constant(*rgb, COLOR), ONE))


class _DeepRecursion:
    """Room for chains of a thousand nodes, each of which waits for the one before it. The limit is the process's, and
    several threads may compile: the last of them restores it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0
        self._limit = 0

    def __enter__(self) -> None:
        with self._lock:
            if self._users == 0:
                self._limit = sys.getrecursionlimit()
                sys.setrecursionlimit(max(self._limit, RECURSION_LIMIT))
            self._users += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._users -= 1
            if self._users == 0:
                sys.setrecursionlimit(self._limit)


_DEEP_RECURSION = _DeepRecursion()


def _compile(
    build: Callable[[Compiler], None],
    name: str,
    owner: str,
    context: Context,
    kind: TreeKind,
    needs_closures: bool = False,
) -> MaterialProgram | None:
    """Compile; a tree too large for the core loses its bumps, then its nodes."""
    reasons: list[str] = []
    for allow_bump in (True, False):
        compiler = Compiler(name, owner, context, kind)
        compiler.allow_bump = allow_bump
        try:
            with _DEEP_RECURSION:
                build(compiler)
        except RecursionError:
            break
        if len(set(compiler.code.registers().values())) <= MAX_REGISTERS:
            if compiler.is_surface and most_lobes(compiler.code.closures) > MAX_LOBES:
                reasons.append(f"more lobes than {MAX_LOBES}, of which a Principled BSDF has up to 6: light is missing")
            for reason in reasons:
                compiler.warn(reason)
            compiler.report()
            return compiler.code.write() if compiler.code.closures or not needs_closures else None
        reasons.append("the node tree is too large for bump, which is left out")
    compiler = Compiler(name, owner, context, kind)
    compiler.warn("the node tree is too large: plain grey is used")
    (_diffuse if compiler.is_surface else _emit)(compiler, DEFAULT_SURFACE)
    compiler.report()
    return compiler.code.write()
