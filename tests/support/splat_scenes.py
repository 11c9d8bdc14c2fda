"""Clouds of Gaussian splats as Blender's importers make them."""

import bpy
import numpy as np


def splat_cloud(name: str, count: int, seed: int = 5) -> bpy.types.PointCloud:
    """Splats of all shapes, opacities and colours in a ball of 1.5 m about the origin; Blender 5.3."""
    rng = np.random.default_rng(seed)
    cloud = bpy.data.pointclouds.new(name)
    cloud.resize(count)
    cloud.type = "GAUSSIAN_SPLAT"
    directions = rng.normal(size=(count, 3))
    positions = 1.5 * rng.uniform(size=(count, 1)) ** (1 / 3) * directions / np.linalg.norm(directions, axis=1)[:, None]
    base = np.column_stack([rng.uniform(-1.5, 1.5, (count, 3)), rng.uniform(0.05, 1.0, count)])
    values = {
        "position": ("FLOAT_VECTOR", "vector", positions),
        "scale": ("FLOAT_VECTOR", "vector", np.exp(rng.uniform(np.log(0.02), np.log(0.4), (count, 3)))),
        "rotation": ("QUATERNION", "value", rng.normal(size=(count, 4))),
        "radiance:base": ("FLOAT4", "vector", base),
    }
    for i in range(15):
        values[f"radiance:sh_{i}"] = ("FLOAT_VECTOR", "vector", rng.uniform(-0.3, 0.3, (count, 3)))
    for attribute, (kind, member, data) in values.items():
        made = cloud.attributes.get(attribute) or cloud.attributes.new(attribute, kind, "POINT")
        made.data.foreach_set(member, np.ascontiguousarray(data, np.float32).ravel())
    return cloud
