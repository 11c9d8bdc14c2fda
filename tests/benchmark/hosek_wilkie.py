"""Finds the curves of `addon/sync/sky/hosek_wilkie.npz` from what Blender's Sky Texture node shows.

    .venv/bin/python -m tests.benchmark.hosek_wilkie [--output FILE]

Cycles renders a plane of pixels, each of which asks the node for one direction, for all turbidities and albedos of the
model and what is halfway between, at 16 elevations of the sun. Coefficients that an exponential or a power holds (A, B,
E, H) are fitted for each turbidity and albedo of the model, over all elevations at once; the others, times the mean
radiance, follow by linear least squares. Ends with the errors at 60 suns, turbidities and albedos by chance (mean error
9.3e-5). Takes a minute or two; the measurements are kept in `out/`.
"""

from __future__ import annotations

import argparse
import atexit
import os
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from addon.sync.sky import hosek_wilkie as model

SIDE = 64  # of the plane, in pixels
TURBIDITIES = np.arange(1.0, 10.25, 0.5)
ALBEDOS = np.array((0.0, 0.5, 1.0))
NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(16) / 15)  # cube roots of elevations, over that of the zenith
SHAPE_DEGREE, RADIANCE_DEGREE = 5, 10
NEAREST_SUN = 0.03  # radians: nearer, angles in single precision are too coarse
GOOD_ENOUGH, WORST = 3e-5, 2e-4  # root mean square of relative errors
XYZ_OF_RGB = np.linalg.inv(
    ((3.2404542, -1.5371385, -0.4985314), (-0.9692660, 1.8760108, 0.0415560), (0.0556434, -0.2040259, 1.0572252))
)
STARTS = [(-1.1, -0.2, e, 0.65) for e in (-3.0, -1.0, 0.06, 1.5)] + [(-1.05, -0.3, -8.0, 0.5), (-1.2, -0.1, -0.3, 0.7)]
MEASUREMENTS = Path("out/hosek_wilkie_measured.npz")


def elevation(node: float) -> float:
    return node**3 * model.HALF_PI


def directions(sun: float, random: np.random.Generator) -> NDArray[np.float32]:
    """Above the horizon, half of them around the sun."""
    count = SIDE * SIDE // 2
    z, turn = random.uniform(0.0, 1.0, count) ** 2, random.uniform(0.0, 2.0 * np.pi, count)
    across = np.sqrt(1.0 - z * z)
    everywhere = np.stack((across * np.cos(turn), across * np.sin(turn), z), axis=-1)
    apart, turn = (
        0.75 * np.pi * random.uniform(0.0, 1.0, 8 * count) ** 2 + 0.02,
        random.uniform(0, 2 * np.pi, 8 * count),
    )
    axes = ((np.cos(sun), 0.0, np.sin(sun)), (-np.sin(sun), 0.0, np.cos(sun)), (0.0, 1.0, 0.0))
    parts = (np.cos(apart), np.sin(apart) * np.cos(turn), np.sin(apart) * np.sin(turn))
    around = sum(part[:, None] * np.array(axis) for part, axis in zip(parts, axes, strict=True))
    return np.concatenate((everywhere, around[around[:, 2] > 0.0][:count])).astype(np.float32)


class Plane:
    """Renders the node in given directions: each is an attribute of a face of its own."""

    def __init__(self) -> None:
        import bpy

        import addon

        if not hasattr(bpy.types.Scene, "cistern"):
            addon.register()
            atexit.register(addon.unregister)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = self.scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 1, False, False
        scene.cycles.pixel_filter_type = "BOX"
        material = bpy.data.materials.new("sky")
        tree = material.node_tree
        if tree is None:
            material.use_nodes = True
            tree = material.node_tree
        tree.nodes.clear()
        kinds = ("ShaderNodeAttribute", "ShaderNodeTexSky", "ShaderNodeEmission", "ShaderNodeOutputMaterial")
        attribute, self.sky, emission, output = (tree.nodes.new(kind) for kind in kinds)
        attribute.attribute_name, self.sky.sky_type = "direction", "HOSEK_WILKIE"
        tree.links.new(attribute.outputs["Vector"], self.sky.inputs["Vector"])
        tree.links.new(self.sky.outputs["Color"], emission.inputs["Color"])
        tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
        corners = np.stack(np.meshgrid(np.arange(SIDE + 1), np.arange(SIDE + 1)), axis=-1).reshape(-1, 2)
        first = np.add.outer(np.arange(SIDE) * (SIDE + 1), np.arange(SIDE)).ravel()
        faces = first[:, None] + np.array((0, 1, SIDE + 2, SIDE + 1))
        self.mesh = bpy.data.meshes.new("plane")
        self.mesh.from_pydata(np.pad(corners, ((0, 0), (0, 1))).tolist(), [], faces.tolist())
        self.mesh.attributes.new("direction", "FLOAT_VECTOR", "FACE")
        self.mesh.materials.append(material)
        scene.collection.objects.link(bpy.data.objects.new("plane", self.mesh))
        camera = bpy.data.cameras.new("camera")
        camera.type, camera.ortho_scale = "ORTHO", SIDE
        scene.camera = bpy.data.objects.new("camera", camera)
        scene.camera.location = (SIDE / 2, SIDE / 2, 1.0)
        scene.collection.objects.link(scene.camera)

    def show(self, turned: NDArray) -> None:
        self.mesh.attributes["direction"].data.foreach_set("vector", turned.ravel())
        self.mesh.update()

    def xyz(self, sun: float, turbidity: float, albedo: float) -> NDArray[np.float64]:
        """In all directions, from the lower left; nan where a colour was cut off."""
        from tests.support.engines import prepare, render

        self.sky.turbidity, self.sky.ground_albedo = turbidity, albedo
        self.sky.sun_direction = (np.cos(sun), 0.0, np.sin(sun))
        prepare(self.scene, SIDE, SIDE)
        self.scene.cycles.filter_width = 0.01
        rgb = render(self.scene, "CYCLES", 1, 0)[..., :3].reshape(-1, 3).astype(np.float64)
        rgb[(rgb <= 0.0).any(axis=1)] = np.nan
        return rgb @ XYZ_OF_RGB.T


def angles(turned: NDArray, sun: float) -> tuple[NDArray, NDArray]:
    """Cosine of the angle to the zenith, and the angle to the sun."""
    x, _, z = turned.astype(np.float64).T
    zenith = np.minimum(np.arccos(np.clip(z, -1.0, 1.0)), model.LARGEST_ZENITH_ANGLE)
    return np.cos(zenith), np.arccos(np.clip(x * np.cos(sun) + z * np.sin(sun), -1.0, 1.0))


def basis(shape: NDArray, cos_zenith: NDArray, sun_distance: NDArray) -> NDArray:
    """What C, D, F, G and I multiply."""
    units = np.eye(5)
    return np.stack([model.radiance(np.r_[shape, unit], cos_zenith, sun_distance) for unit in units], axis=-1)


def linear_fit(columns: NDArray) -> NDArray:
    """Coefficients of these columns whose sum is nearest to 1."""
    size = np.linalg.norm(columns, axis=0)
    return np.linalg.lstsq(columns / size, np.ones(len(columns)), rcond=1e-10)[0] / size


Samples = list[tuple[NDArray, NDArray, NDArray]]
"""By elevation: cosines, distances, and what was measured."""


def residuals(shape: NDArray, samples: Samples) -> NDArray:
    """Relative errors with the best C to I at each elevation, of (A, B, E, H) by elevation."""
    errors = []
    for one, (cos_zenith, sun_distance, measured) in zip(shape, samples, strict=True):
        with np.errstate(all="ignore"):
            columns = basis(one, cos_zenith, sun_distance) / measured[:, None]
        finite = np.isfinite(columns).all()
        errors.append(columns @ linear_fit(columns) - 1.0 if finite else np.full(len(measured), 1e3))
    return np.concatenate(errors)


def fit_shape(samples: Samples, near: NDArray | None) -> tuple[NDArray, float]:
    """Series of A, B, E and H over the cube root of the elevation, and their error; `near`: where to start."""
    from scipy.optimize import least_squares

    powers = chebvander(2.0 * NODES - 1.0, SHAPE_DEGREE)
    if near is None:
        shape, last = np.zeros((len(NODES), 4)), None
        for i, sample in enumerate(samples):
            best = None
            for start in ([] if last is None else [last]) + STARTS:
                scale = np.abs(start) + 0.05
                found = least_squares(
                    lambda p, sample=sample: residuals(p[None], [sample]), start, x_scale=scale, max_nfev=400
                )
                best = found if best is None or found.cost < best.cost else best
                if np.sqrt(np.mean(best.fun**2)) < GOOD_ENOUGH:
                    break
            shape[i] = last = best.x
        near = np.stack([smooth_series(powers, column) for column in shape.T], axis=-1)
    found = least_squares(
        lambda q: residuals(powers @ q.reshape(-1, 4), samples),
        near.ravel(),
        x_scale=np.maximum(np.abs(near.ravel()), 0.01),
        max_nfev=200,
    )
    return found.x.reshape(-1, 4), float(np.sqrt(np.mean(found.fun**2)))


def smooth_series(powers: NDArray, values: NDArray) -> NDArray:
    """Least squares that soon forgets what does not fit."""
    weights = np.ones(len(values))
    for _ in range(30):
        series = np.linalg.lstsq(powers * weights[:, None], values * weights, rcond=None)[0]
        apart = np.abs(powers @ series - values)
        weights = 1.0 / (1.0 + (apart / (3.0 * max(np.median(apart), 1e-7))) ** 2)
    return series


def measure() -> None:
    plane, random = Plane(), np.random.default_rng(3)
    turned, xyz = [], []
    for node in NODES:
        turned.append(directions(elevation(node), random))
        plane.show(turned[-1])
        xyz.append([[plane.xyz(elevation(node), t, a) for a in ALBEDOS] for t in TURBIDITIES])
    MEASUREMENTS.parent.mkdir(exist_ok=True)
    np.savez(MEASUREMENTS, turned=np.array(turned), xyz=np.array(xyz, np.float32))


def samples_of(turbidity: int, albedo: int, channel: int, step: int) -> Samples:
    """Of those indices, one in `step`."""
    with np.load(MEASUREMENTS) as measured:
        turned, xyz = measured["turned"], measured["xyz"][:, turbidity, albedo, :, channel].astype(np.float64)
    samples = []
    for node, these, values in zip(NODES, turned, xyz, strict=True):
        cos_zenith, sun_distance = angles(these, elevation(node))
        kept = np.flatnonzero(np.isfinite(values) & (sun_distance > NEAREST_SUN))[::step]
        samples.append((cos_zenith[kept], sun_distance[kept], values[kept]))
    return samples


def fit_one_shape(where: tuple[int, int, int], near: NDArray | None = None) -> tuple[NDArray, float]:
    """Of a turbidity, albedo and channel of the model."""
    turbidity, albedo, channel = where
    return fit_shape(samples_of(2 * turbidity, 2 * albedo, channel, 2), near)


def fit_one_radiance(where: tuple[int, int, int], shape: NDArray) -> NDArray:
    """Of halves of turbidities and albedos, all shapes given."""
    turbidity, albedo, channel = where
    powers = chebvander(2.0 * NODES - 1.0, SHAPE_DEGREE)
    low, part = divmod(turbidity, 2)
    ends = shape[[low, min(low + 1, len(shape) - 1)]][:, :, channel]
    series = np.einsum("t,a,taps->ps", (1 - part / 2, part / 2), (1 - albedo / 2, albedo / 2), ends)
    columns = []
    for one, power, (cos_zenith, sun_distance, measured) in zip(
        powers @ series,
        chebvander(2.0 * NODES - 1.0, RADIANCE_DEGREE),
        samples_of(turbidity, albedo, channel, 4),
        strict=True,
    ):
        columns.append((basis(one, cos_zenith, sun_distance) / measured[:, None])[:, None] * power[None, :, None])
    return linear_fit(np.concatenate(columns).reshape(-1, 5 * (RADIANCE_DEGREE + 1))).reshape(-1, 5)


def fit() -> dict[str, NDArray[np.float32]]:
    places = list(product(range(10), range(2), range(3)))
    shape = np.zeros((10, 2, 3, SHAPE_DEGREE + 1, 4))
    with ProcessPoolExecutor() as pool:
        errors = np.zeros(shape.shape[:3])
        for place, (series, error) in zip(places, pool.map(fit_one_shape, places), strict=True):
            shape[place], errors[place] = series, error
        for place in np.argwhere(errors > WORST):  # another valley: from the turbidity beside it
            turbidity, albedo, channel = place
            near = min(
                (t for t in (turbidity - 1, turbidity + 1) if 0 <= t < 10), key=lambda t: errors[t, albedo, channel]
            )
            shape[tuple(place)], errors[tuple(place)] = fit_one_shape(tuple(place), shape[near, albedo, channel])
        print(f"shapes: largest error {errors.max():.1e} (root mean square, relative)")
        halves = list(product(range(19), range(3), range(3)))
        found = pool.map(fit_one_radiance, halves, [shape] * len(halves))
        radiance = np.array(list(found)).reshape(19, 3, 3, RADIANCE_DEGREE + 1, 5)
    return {"shape": shape.astype(np.float32), "radiance": radiance.astype(np.float32)}


def validate() -> None:
    plane, random = Plane(), np.random.default_rng(4)
    errors = []
    for _ in range(60):
        sun, turbidity, albedo = random.uniform(0, 1) ** 2 * model.HALF_PI, random.uniform(1, 10), random.uniform(0, 1)
        turned = directions(sun, random)
        plane.show(turned)
        measured, place = plane.xyz(sun, turbidity, albedo), angles(turned, sun)
        ours = np.stack([model.radiance(c, *place) for c in model.coefficients(sun, turbidity, albedo)], axis=-1)
        errors.append(np.abs(ours / measured - 1.0)[np.isfinite(measured)])
    every = np.concatenate(errors)
    print(f"60 skies by chance: mean error {every.mean():.2e}, worst of a sky {max(e.mean() for e in errors):.2e}, ")
    print(f"99.9 % below {np.quantile(every, 0.999):.2e}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=model.CURVES)
    arguments = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    if not MEASUREMENTS.exists():
        measure()
    np.savez_compressed(arguments.output, **fit())
    if arguments.output == model.CURVES:
        validate()


if __name__ == "__main__":
    main()
