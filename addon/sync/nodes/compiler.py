"""Compiles one node tree: asks nodes for values from the output backwards, each value once per bump shift."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from enum import Enum
from types import ModuleType
from typing import Any, Protocol

import bpy
from numpy.typing import NDArray

from .. import SyncError
from ..versions import joins_links
from .enums import MATH_OPERATIONS, VECTOR_MATH_OPERATIONS
from .graph import (
    EEVEE_ALONE,
    SHADER,
    Node,
    Port,
    Scope,
    Socket,
    entry_of,
    is_foreign,
    is_group,
    is_lost,
    is_pass_through,
    socket_named,
    source_of,
)
from .instructions import COLOR, FLOAT, VECTOR, InstructionList, Value, constant

LETTERS = {
    "VALUE": FLOAT,
    "INT": FLOAT,
    "BOOLEAN": FLOAT,
    "RGBA": COLOR,
    "VECTOR": VECTOR,
    "ROTATION": VECTOR,
}


class Context(Protocol):
    """What the compiler needs from its caller."""

    core: ModuleType
    aov_names: Set[str]
    """Of the passes of the view layer that materials write themselves."""

    def image_handle(self, image: bpy.types.Image, image_user: bpy.types.ImageUser | None) -> int:
        """Handle of an image, -1 for one that cannot be read."""

    def tile_handles(self, image: bpy.types.Image) -> list[int]:
        """Handles of a tiled image's tiles from 1001 on, -1 for those that are not there."""

    def table_handle(self, key: tuple, name: str, make: Callable[[], NDArray]) -> int:
        """Handle of an image whose colours, in the working space, a node computes; equal keys have equal ones."""

    def layer_value(self, name: str) -> tuple[float, float, float, float]:
        """Colour and alpha of an attribute of the view layer, the scene or the world; 0 where there is none."""

    def warn(self, text: str) -> None:
        """Tell the user."""


ValueHandler = Callable[["NodeView", str], "Value | None"]
ClosureHandler = Callable[["NodeView", Value], None]
VALUE_NODES: dict[str, ValueHandler] = {}
CLOSURE_NODES: dict[str, ClosureHandler] = {}
VOLUME_NODES: dict[str, ClosureHandler] = {}


def value_node(*idnames: str) -> Callable[[ValueHandler], ValueHandler]:
    """Registers what computes an output (by identifier) of these nodes; None means the output is not supported."""

    def register(handler: ValueHandler) -> ValueHandler:
        VALUE_NODES.update(dict.fromkeys(idnames, handler))
        return handler

    return register


def closure_node(*idnames: str) -> Callable[[ClosureHandler], ClosureHandler]:
    """Registers what appends the closures of these nodes under a weight."""

    def register(handler: ClosureHandler) -> ClosureHandler:
        CLOSURE_NODES.update(dict.fromkeys(idnames, handler))
        return handler

    return register


def volume_node(*idnames: str) -> Callable[[ClosureHandler], ClosureHandler]:
    """The same of what these nodes add to a medium."""

    def register(handler: ClosureHandler) -> ClosureHandler:
        VOLUME_NODES.update(dict.fromkeys(idnames, handler))
        return handler

    return register


def default_of(socket: Socket) -> Value:
    """The value shown on an unlinked socket; 0 for kinds that hold no number."""
    letter = LETTERS.get(socket.type, FLOAT)
    default = getattr(socket, "default_value", 0.0)
    if letter == FLOAT:
        return constant(float(default)) if isinstance(default, int | float) else constant(0.0)
    x, y, z = (*tuple(default)[:3], 0.0, 0.0, 0.0)[:3]
    return constant(x, y, z, letter)


class TreeKind(Enum):
    """What a tree shades. Worlds and lamps have no mesh under them; of lamps, area lamps have a UV map."""

    SURFACE = "material"
    WORLD = "world"
    LAMP = "lamp"
    AREA_LAMP = "area lamp"


class Compiler:
    """State of one compilation: the instructions so far, the bump shift, and what to tell the user."""

    def __init__(self, name: str, owner: str, context: Context, kind: TreeKind) -> None:
        self.code = InstructionList(context.core, name)
        self.owner = owner  # as shown in warnings, e.g. "Material 'Wood'"
        self.context = context
        self.kind = kind
        self.normal: Value | None = None  # the shading normal, where displacement has bent it
        self.shift = 0  # where coordinates are read: Bump compiles its height at three places
        self.allow_bump = True
        self.moves_vertices = False  # displacement is compiled as what moves vertices, not as heights of a bump
        self.in_volume = False  # shaders are those of a medium
        self.grids: set[str] | None = None  # of volume objects: names that were asked for
        self.pass_index = 0  # of a material
        self._values: dict[tuple, Value] = {}
        self._in_progress: set[tuple] = set()
        self._unsupported: dict[str, None] = {}  # insertion-ordered set
        self._warnings: dict[str, None] = {}

    @property
    def is_surface(self) -> bool:
        return self.kind is TreeKind.SURFACE

    @property
    def is_world(self) -> bool:
        return self.kind is TreeKind.WORLD

    @property
    def is_lamp(self) -> bool:
        return self.kind in (TreeKind.LAMP, TreeKind.AREA_LAMP)

    @property
    def traces_rays(self) -> bool:
        """Whether nodes may: there is a surface to start from, and the scene is there."""
        return self.is_surface and not (self.in_volume or self.moves_vertices)

    def warn(self, text: str) -> None:
        self._warnings[f"{self.owner}: {text}"] = None

    def unsupported(self, node: Node, output: str = "") -> None:
        self._unsupported[f"{node.bl_label} ({output})" if output else node.bl_label] = None

    def report(self) -> None:
        """One line for all unsupported nodes, and one per other matter."""
        if self._unsupported:
            self.warn(f"nodes replaced by their defaults: {', '.join(self._unsupported)}")
        for text in self._warnings:
            self.context.warn(text)

    @contextmanager
    def shifted(self, shift: int) -> Iterator[None]:
        before, self.shift = self.shift, shift
        try:
            yield
        finally:
            self.shift = before

    def forget_values(self) -> None:
        """Nodes are compiled anew where they are asked again: they read another normal now."""
        self._values.clear()

    def shading_normal(self) -> Value:
        return self.normal or self.code.emit("NORMAL")

    def input(self, port: Port) -> Value | None:
        """The linked value, converted to the socket's type; None when nothing reaches the socket."""
        source = source_of(port)
        value = self.output(source) if source else None
        letter = LETTERS.get(port.socket.type)
        return self.code.convert(value, letter) if value is not None and letter else value

    def input_or_default(self, port: Port) -> Value:
        value = self.input(port)
        return default_of(port.socket) if value is None else value

    def output(self, port: Port) -> Value | None:
        key = (port.scope, port.node.name, port.socket.identifier, self.shift)
        if key not in self._values:
            if key in self._in_progress:
                return None
            self._in_progress.add(key)
            try:
                self._values[key] = self._evaluate(port)
            finally:
                self._in_progress.discard(key)
        return self._values[key]

    def _evaluate(self, port: Port) -> Value | None:
        letter = LETTERS.get(port.socket.type, FLOAT)
        if is_pass_through(port.node):
            entry = entry_of(port)
            if entry is None:
                return self._dead_end(port)
            source, is_reroute = source_of(entry), port.node.bl_idname == "NodeReroute"
            if source is None and (port.node.mute or is_reroute):
                # The socket behind keeps its own value; before Blender resolved trees it read 0.
                value = None if joins_links() else constant(0.0)
            elif source is not None and joins_links():
                return self.output(source)  # a tree that is not resolved: Cycles converts once, from end to end
            elif port.node.mute:
                value = self.output(source)
            elif is_reroute:
                value = self.input(entry)
            else:
                value = self.input_or_default(entry)
        elif port.node.bl_idname in EEVEE_ALONE:
            return self.warn_of_eevee(port.node)
        elif is_foreign(port.node):
            return self.warn(f"node '{port.node.name}' is of another program: it counts as not linked, as in Cycles")
        else:
            handler = VALUE_NODES.get(port.node.bl_idname)
            value = self.read(port, handler, port.socket.identifier) if handler else None
            if value is None:
                self.unsupported(port.node, port.socket.name if handler else "")
                value = substitute(port)
        return None if value is None else self.code.convert(value, letter)

    def read(self, port: Port, handler: Callable[[NodeView, Any], Any], argument: str | Value) -> Any:  # noqa: ANN401
        """What the handler answers of the port's node. Nodes of later versions or of other programs may hold what
        nobody thought of: that costs the node, with a warning, and not the picture."""
        try:
            return handler(NodeView(self, port.scope, port.node), argument)
        except SyncError:
            raise
        except (AttributeError, LookupError, TypeError, ValueError) as error:
            traceback.print_exc()
            self.warn(f"node '{port.node.name}' cannot be read ({type(error).__name__}: {error}): its default is used")
            return None

    def _dead_end(self, port: Port) -> Value | None:
        """A muted node without a way through counts as no link; a broken group as its default."""
        if port.node.mute or not is_group(port.node):
            return None
        self.warn_broken_group(port)
        return default_of(port.socket)

    def warn_of_eevee(self, node: Node) -> None:
        """As in Cycles, its links count as none."""
        self.warn(f"node {node.bl_label} is of EEVEE alone: it counts as not linked, as in Cycles")

    def warn_broken_group(self, port: Port) -> None:
        tree = port.node.node_tree
        if tree is None:
            self.warn(f"node group '{port.node.name}' is missing; its default is used")
        elif port.scope.child(port.node) is None:
            self.warn(f"node group '{tree.name}' contains itself; its default is used")


def substitute(port: Port) -> Value:
    """Stand-in for an unsupported output: the first unlinked input default of its type, else its own default."""
    for socket in port.node.inputs:
        plain = socket.enabled and socket.type == port.socket.type and not socket.hide_value
        if plain and port.scope.link_into(port.node, socket) is None:
            return default_of(socket)
    return default_of(port.socket)


class NodeView:
    """A node as its handler sees it: values by socket identifier, properties, and a place to emit."""

    def __init__(self, compiler: Compiler, scope: Scope, node: Node) -> None:
        self.compiler = compiler
        self.scope = scope
        self.node = node
        self.emit = compiler.code.emit

    @property
    def name(self) -> str:
        """As the user sees it: Blender puts a number before the names of nodes of the trees that it has resolved."""
        number, _, name = self.node.name.partition("_")
        return name if self.scope.owner is not None and number.isdigit() else self.node.name

    def choice(self, setting: str, known: Sequence[str] | Mapping[str, int]) -> int:
        """What the core calls the choice that the user has made; with a warning the default, where a file comes from
        another Blender and this one, or the core, does not know the choice."""
        chosen = getattr(self.node, setting)
        if chosen not in known:
            default = self.node.bl_rna.properties[setting].default
            what = f"{chosen} is not supported" if chosen else "a value that this Blender does not know"
            chosen = default if default in known else next(iter(known))
            self.warn(f"node '{self.name}': {setting.replace('_', ' ')}: {what}, {chosen} is used")
        return known[chosen] if isinstance(known, Mapping) else known.index(chosen)

    def port(self, identifier: str) -> Port | None:
        socket = socket_named(self.node.inputs, identifier)
        return Port(self.scope, self.node, socket) if socket else None

    def linked(self, identifier: str) -> Value | None:
        """The linked value of a socket that has a default of its own."""
        port = self.port(identifier)
        return None if port is None or is_lost(port) else self.compiler.input(port)

    def value(self, identifier: str, missing: Value | float = 0.0) -> Value:
        """The socket's value; `missing` where this version of Blender has no such socket."""
        port = self.port(identifier)
        if port is None:
            return missing if isinstance(missing, Value) else constant(missing)
        return self.compiler.input_or_default(port)

    def values(self, identifiers: str) -> list[Value]:
        """Values of comma-separated identifiers."""
        return [self.value(identifier.strip()) for identifier in identifiers.split(",")]

    def normal(self, identifier: str = "Normal") -> Value:
        """The linked normal, else the shading normal. To shaders a zero vector, as from a group's input, is no link."""
        value = self.given_normal(identifier)
        return self.shading_normal() if value.constant == (0.0, 0.0, 0.0) else value

    def given_normal(self, identifier: str = "Normal") -> Value:
        """The linked normal, a zero vector too, else the shading normal."""
        value = self.linked(identifier)
        return self.shading_normal() if value is None else value

    def shading_normal(self) -> Value:
        return self.compiler.shading_normal()

    def at_shift(self, op: str, parameters: Sequence[int] = ()) -> Value:
        """A coordinate at the current bump shift."""
        return self.emit(op, (), (*parameters, self.compiler.shift))

    def vector_math(self, operation: str, a: Value, b: Value | None = None, c: Value | None = None) -> Value:
        zero = constant(0.0, letter=VECTOR)
        index = VECTOR_MATH_OPERATIONS.index(operation)
        return self.emit("VECTOR_MATH", (a, b or zero, c or zero, constant(1.0)), (index,))

    def math(self, operation: str, a: Value, b: Value | None = None) -> Value:
        zero = constant(0.0)
        return self.emit("MATH", (a, b or zero, zero), (MATH_OPERATIONS.index(operation), 0))

    def warn(self, text: str) -> None:
        self.compiler.warn(text)


def flatten_shader(compiler: Compiler, port: Port, weight: Value) -> None:
    """Append the closures that reach a shader input, scaled by `weight`."""
    if weight.constant is not None and weight.constant[0] == 0.0:
        return
    source = source_of(port)
    if source is None:
        return
    if source.socket.type != SHADER:
        color = compiler.output(source)
        if color is not None:  # a value plugged into a shader socket glows, as in Cycles
            emission = "CLOSURE_VOLUME_EMISSION" if compiler.in_volume else "CLOSURE_EMISSION"
            compiler.code.closure(emission, (weight, color, constant(1.0)))
        return
    if is_pass_through(source.node):
        entry = entry_of(source)
        if entry is not None:
            flatten_shader(compiler, entry, weight)
        elif is_group(source.node):
            compiler.warn_broken_group(source)
        return
    if compiler.in_volume:
        _add_to_medium(compiler, source, weight)
        return
    if source.node.bl_idname in EEVEE_ALONE:
        compiler.warn_of_eevee(source.node)
        return
    handler = CLOSURE_NODES.get(source.node.bl_idname)
    if handler is None and source.node.bl_idname in VOLUME_NODES:
        return  # nothing on a surface, as in Cycles
    if handler is None:
        compiler.unsupported(source.node)
        handler = CLOSURE_NODES["unsupported"]
    compiler.read(source, handler, weight)


def _add_to_medium(compiler: Compiler, source: Port, weight: Value) -> None:
    """Shaders of surfaces are nothing there, as in Cycles."""
    handler = VOLUME_NODES.get(source.node.bl_idname)
    if handler is not None:
        compiler.read(source, handler, weight)
    elif source.socket.name == "Volume":
        compiler.unsupported(source.node)
