"""Walking a shader node tree: links, groups, reroutes and muted nodes.

From Blender 5.0 on, trees are taken as Blender resolves them for Cycles: without groups, reroutes, muted nodes, zones,
closures, bundles and menus, and without what nothing reads. What this module knows of groups, reroutes and muted nodes
is for earlier versions, of which nothing is copied: a node inside a group is told apart from its twin in another use of
the group by its `Scope`.
Sockets are named by identifier, since positions and labels change between Blender versions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import bpy

Tree = bpy.types.NodeTree
Node = bpy.types.Node
Socket = bpy.types.NodeSocket
Link = bpy.types.NodeLink

SHADER = "SHADER"
# What only Blender resolves.
ZONES = frozenset(
    {
        "GeometryNodeMenuSwitch",
        "GeometryNodeRepeatOutput",
        "NodeClosureOutput",
        "NodeEvaluateClosure",
        "NodeCombineBundle",
        "NodeSeparateBundle",
    }
)
EEVEE_ALONE = {"ShaderNodeShaderToRGB", "ShaderNodeEeveeSpecular", "ShaderNodeUVAlongStroke", "ShaderNodeSqueeze"}


class Scope:
    """One use of a node tree: the material's own tree, or what stands inside one group node."""

    def __init__(
        self,
        tree: Tree,
        parent: Scope | None = None,
        group_node: Node | None = None,
        owner: object = None,
        libraries: Iterable[bpy.types.Library | None] = (),
    ) -> None:
        self.tree = tree
        self.owner = owner  # with which the tree would go
        self.libraries = tuple(libraries) or (tree.library,)  # from one of which // in paths of its nodes counts
        self.parent = parent
        self.group_node = group_node
        self._children: dict[str, Scope | None] = {}

    @cached_property
    def _links(self) -> dict[tuple[str, str], Link]:
        links = (link for link in self.tree.links if _carries_values(link))
        return {(link.to_node.name, link.to_socket.identifier): link for link in links}

    def link_into(self, node: Node, socket: Socket) -> Link | None:
        return self._links.get((node.name, socket.identifier))

    def child(self, group_node: Node) -> Scope | None:
        """The inside of a group node; None without a tree or when the group contains itself."""
        if group_node.name not in self._children:
            tree = group_node.node_tree
            empty = tree is None or self._is_inside(tree)
            self._children[group_node.name] = None if empty else Scope(tree, self, group_node)
        return self._children[group_node.name]

    def _is_inside(self, tree: Tree) -> bool:
        return self.tree == tree or (self.parent is not None and self.parent._is_inside(tree))


def scope_of(block: bpy.types.Material | bpy.types.World | bpy.types.Light, output: str) -> Scope:
    """The tree of a data-block that has one; resolved by Blender from 5.0 on, unless a group of it is broken and
    nothing needs that, or the node of type `output` that counts is for Cycles alone, which from 5.1 on Blender leaves
    out there.

    Links through groups, reroutes and muted nodes are then joined: what they carry is converted once, from the first
    socket to the last. Resolved trees are no data-blocks: they live as long as what Blender hands out with them."""
    scope = Scope(block.node_tree)
    resolve = getattr(block, "inline_shader_nodes", None)
    if resolve is None or not (_is_whole(scope, set()) or _has_zones(block.node_tree)):
        return scope
    resolved = resolve()
    wanted, found = (active_output(tree, output) for tree in (block.node_tree, resolved.node_tree))
    if wanted is not None and (found is None or found.target != wanted.target):
        return scope
    libraries = dict.fromkeys([block.library, *(tree.library for tree in all_groups([block.node_tree]))])
    return Scope(resolved.node_tree, owner=resolved, libraries=libraries)


def _is_whole(scope: Scope, seen: set[int]) -> bool:
    """Whether each group has a tree, and none contains itself; `seen`: trees that were looked at."""
    pointer = scope.tree.as_pointer()
    children = (scope.child(node) for node in scope.tree.nodes if is_group(node))
    is_whole = pointer in seen or all(child is not None and _is_whole(child, seen) for child in children)
    seen.add(pointer)
    return is_whole


def _has_zones(tree: Tree) -> bool:
    return any(node.bl_idname in ZONES for node in all_nodes([tree]))


def all_groups(trees: Iterable[Tree]) -> Iterator[Tree]:
    """The trees and the groups they use, each once even where it contains itself."""
    pending, seen = list(trees), set()
    while pending:
        tree = pending.pop()
        if tree.as_pointer() in seen:
            continue
        seen.add(tree.as_pointer())
        yield tree
        pending += (node.node_tree for node in tree.nodes if is_group(node) and node.node_tree is not None)


def all_nodes(trees: Iterable[Tree]) -> Iterator[Node]:
    """Every node of the trees and of the groups they use."""
    for tree in all_groups(trees):
        yield from tree.nodes


def _carries_values(link: Link) -> bool:
    usable = link.is_valid and not link.is_muted
    return usable and link.from_socket.enabled and link.to_socket.enabled


@dataclass(frozen=True)
class Port:
    """A socket of a node in a scope; whether it is an input or an output is known from the context."""

    scope: Scope
    node: Node
    socket: Socket


def socket_named(sockets: Iterable[Socket], identifier: str) -> Socket | None:
    return next((socket for socket in sockets if socket.identifier == identifier), None)


def source_of(port: Port) -> Port | None:
    """The output linked to an input; None when there is none, or when it carries a shader to a value."""
    link = port.scope.link_into(port.node, port.socket)
    if link is None:
        return None
    if link.from_socket.type == SHADER and port.socket.type != SHADER:
        return None
    return Port(port.scope, link.from_node, link.from_socket)


def is_pass_through(node: Node) -> bool:
    return node.mute or node.bl_idname in ("NodeReroute", "NodeGroupInput") or is_group(node)


def is_group(node: Node) -> bool:
    """Those of Python add-ons too, which have names of their own."""
    return node.type in {"GROUP", "CUSTOM GROUP"}


def is_foreign(node: Node) -> bool:
    """Whether it is not Blender's own, as in files made with another render engine, which may not be here."""
    return node.type == "CUSTOM" and not is_group(node)


def entry_of(output: Port) -> Port | None:
    """The input whose value leaves through this output of a pass-through node; None if nothing does."""
    node, scope = output.node, output.scope
    if node.mute:
        socket = _bypass(node, output.socket)
    elif node.bl_idname == "NodeReroute":
        socket = node.inputs[0]
    elif node.bl_idname == "NodeGroupInput":
        if scope.parent is None:
            return None
        node, scope = scope.group_node, scope.parent
        socket = socket_named(node.inputs, output.socket.identifier)
    else:
        scope = scope.child(node)
        node = group_output(scope.tree) if scope else None
        socket = socket_named(node.inputs, output.socket.identifier) if node else None
    return Port(scope, node, socket) if socket else None


def is_lost(port: Port) -> bool:
    """Whether what is linked to an input comes from an unlinked socket of a group: sockets that have a default of
    their own, such as coordinates and normals, then take that, as in Cycles before Blender 5.0."""
    source = source_of(port)
    while source is not None and is_pass_through(source.node):
        entry = entry_of(source)
        if entry is None:
            return False
        source = source_of(entry)
        if source is None:
            return True
    return False


def _bypass(node: Node, socket: Socket) -> Socket | None:
    for link in node.internal_links:
        if link.to_socket.identifier == socket.identifier:
            return socket_named(node.inputs, link.from_socket.identifier)
    return None


def group_output(tree: Tree) -> Node | None:
    outputs = [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    return next((node for node in outputs if node.is_active_output), outputs[0] if outputs else None)


def active_output(tree: Tree, idname: str) -> Node | None:
    """The output node Cycles would take: one for Cycles before one for all renderers, the active one of equals."""
    outputs = [node for node in tree.nodes if node.bl_idname == idname and node.target in ("CYCLES", "ALL")]
    return max(outputs, key=lambda node: (node.target == "CYCLES", node.is_active_output), default=None)
