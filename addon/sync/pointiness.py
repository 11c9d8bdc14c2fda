"""Geometry > Pointiness, how far vertices stand out of their surroundings, as Cycles has it (blender/mesh.cpp)."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray


def pointiness(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    """Of each vertex, (n, 1): the angle between its normal and the mean of its edges over pi, 1/2 where it is flat,
    averaged with the vertices next to it. Vertices at one place count as one."""
    positions, normals = (np.empty((len(mesh.vertices), 3), np.float32) for _ in range(2))
    mesh.vertices.foreach_get("co", positions.ravel())
    mesh.vertex_normals.foreach_get("vector", normals.ravel())
    ends = np.empty((len(mesh.edges), 2), np.int32)
    mesh.edges.foreach_get("vertices", ends.ravel())
    places, place_of = np.unique(positions, axis=0, return_inverse=True)
    place_of = place_of.reshape(-1)
    count = len(places)
    edges = np.unique(np.sort(place_of[ends], axis=1), axis=0)
    ones, others = edges.T
    neighbours = np.bincount(edges.ravel(), minlength=count)
    along = _unit(places[others] - places[ones])
    sums = _sum_at(ones, along, count) - _sum_at(others, along, count)
    cosine = (_unit(_sum_at(place_of, normals, count)) * sums).sum(axis=1) / np.maximum(neighbours, 1)
    angle = np.where(neighbours > 0, np.arccos(cosine.clip(-1.0, 1.0)) / np.pi, 0.0)
    around = np.bincount(ones, angle[others], count) + np.bincount(others, angle[ones], count)
    return ((angle + around) / (neighbours + 1))[place_of].astype(np.float32)[:, None]


def _unit(vectors: NDArray) -> NDArray[np.float64]:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0.0, lengths, 1.0)


def _sum_at(places: NDArray, vectors: NDArray, count: int) -> NDArray[np.float64]:
    return np.stack([np.bincount(places, column, count) for column in vectors.T], axis=1)
