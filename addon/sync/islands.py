"""Geometry > Random Per Island, of the connected parts of a mesh: Cycles' numbers (blender/mesh.cpp)."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

_INITIAL = np.uint32(0xDEADBEEF + (1 << 2) + 13)


def random_per_island(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    """Of each polygon, (n, 1), in [0, 1]: a hash of the vertex that stands for all that edges join."""
    ends = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", ends)
    roots = np.array(_roots(ends.reshape(-1, 2).tolist(), len(mesh.vertices)), np.uint32)
    corners, starts = np.empty(len(mesh.loops), np.int32), np.empty(len(mesh.polygons), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.polygons.foreach_get("loop_start", starts)
    return (_hash(roots[corners[starts]]) / np.float32(0xFFFFFFFF)).astype(np.float32)[:, None]


def _roots(edges: list[list[int]], count: int) -> list[int]:
    """One of the joined vertices for all of them: a union by rank in the order of edges, on which it depends."""
    parents, ranks = list(range(count)), [0] * count

    def find(vertex: int) -> int:
        root = vertex
        while parents[root] != root:
            root = parents[root]
        while parents[vertex] != root:
            parents[vertex], vertex = root, parents[vertex]
        return root

    for one, other in edges:
        a, b = find(one), find(other)
        if a == b:
            continue
        if ranks[a] < ranks[b]:
            a, b = b, a
        parents[b] = a
        ranks[a] += ranks[a] == ranks[b]
    return [find(vertex) for vertex in range(count)]


def _hash(words: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Jenkins' lookup3 for one word (burtleburtle.net/bob/c/lookup3.c, `final`)."""

    def rotated(v: NDArray[np.uint32], bits: int) -> NDArray[np.uint32]:
        return (v << np.uint32(bits)) | (v >> np.uint32(32 - bits))

    b = c = np.full_like(words, _INITIAL)
    a = words + _INITIAL
    c = (c ^ b) - rotated(b, 14)
    a = (a ^ c) - rotated(c, 11)
    b = (b ^ a) - rotated(a, 25)
    c = (c ^ b) - rotated(b, 16)
    a = (a ^ c) - rotated(c, 4)
    b = (b ^ a) - rotated(a, 14)
    return (c ^ b) - rotated(b, 24)
