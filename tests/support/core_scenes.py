"""Small scenes built straight on the native core, for tests that need no Blender. Everything is in metres, z up."""

from __future__ import annotations

from collections.abc import Sequence

import cistern_core as core
import numpy as np

Color = tuple[float, float, float]
# Kinds of ray that may see an object.
CAMERA, DIFFUSE, GLOSSY, TRANSMISSION, SHADOW, VOLUME = 1, 2, 4, 8, 16, 32
VISIBLE_TO_ALL = CAMERA | DIFFUSE | GLOSSY | TRANSMISSION | SHADOW | VOLUME


def principled(
    base: Color = (0.8, 0.8, 0.8),
    metallic: float = 0.0,
    roughness: float = 0.5,
    specular: float = 0.0,
    emission: float = 0.0,
    multiscatter: bool = True,
    is_thin: bool = False,
    **inputs: float,
) -> core.MaterialProgram:
    """A Principled BSDF of constants. Without specular it is Lambertian."""
    p = core.MaterialProgram("principled")
    normal = p.emit("NORMAL")
    zero, one = p.constant(0.0), p.constant(1.0)
    white = p.constant(1.0, 1.0, 1.0)
    value = {name: p.constant(number) for name, number in inputs.items()}
    operands = [
        one, p.constant(*base), p.constant(metallic), p.constant(roughness), value.get("ior", p.constant(1.5)),
        value.get("alpha", one), normal, zero, zero, p.constant(specular), white, zero, zero, normal,
        value.get("transmission", zero), value.get("coat", zero), value.get("coat_roughness", zero),
        p.constant(1.5), white, normal, value.get("sheen", zero), p.constant(0.5), white, white, p.constant(emission),
        normal, zero, one, zero, value.get("film", zero), value.get("film_ior", p.constant(1.33)),
        value.get("inverse_abbe", zero),
    ]  # fmt: skip
    p.closure("CLOSURE_PRINCIPLED", operands, [int(multiscatter), 0, 1, int(is_thin)])
    return p


def portal(color: Color, transparent: Color = (0.0, 0.0, 0.0), move: Color = (0.0, 0.0, 0.0)) -> core.MaterialProgram:
    """A ray portal to so far from where it is, and what passes straight beside it."""
    p = core.MaterialProgram("portal")
    place = p.emit(
        "VECTOR_MATH", [p.emit("POSITION", [], [0]), p.constant(*move), p.constant(0.0), p.constant(0.0)], [0]
    )
    one = p.constant(1.0)
    p.closure("CLOSURE_RAY_PORTAL", [one, p.constant(*color), place, p.constant(0.0, 0.0, 0.0)])
    p.closure("CLOSURE_TRANSPARENT", [one, p.constant(*transparent)])
    return p


def emission(color: Color, strength: float = 1.0) -> core.MaterialProgram:
    p = core.MaterialProgram("emission")
    p.closure("CLOSURE_EMISSION", [p.constant(1.0), p.constant(*color), p.constant(strength)])
    return p


def radiance() -> core.MaterialProgram:
    """Emits what splats send."""
    p = core.MaterialProgram("radiance")
    color = p.emit("ATTRIBUTE", [], [p.attribute("radiance"), 0])
    p.closure("CLOSURE_EMISSION", [p.constant(1.0), color, p.constant(1.0)])
    return p


def same_everywhere(*coefficients: Color, **members: object) -> core.MaterialProgram:
    """A medium that seems to vary: of the density 0 y + 1."""
    return medium(*coefficients, **members, seems_uneven=True)


def medium(
    scattering: Color = (0.0, 0.0, 0.0),
    absorption: Color = (0.0, 0.0, 0.0),
    density: float = 1.0,
    anisotropy: float = 0.0,
    glow: Color = (0.0, 0.0, 0.0),
    is_boundary: bool = True,
    seems_uneven: bool = False,
    phase: tuple[int, float] = (0, 0.0),
) -> core.MaterialProgram:
    """What is inside of a surface that rays pass straight through; of the world without `is_boundary`. `phase`: the
    phase function, and what else it takes beside the anisotropy."""
    p = core.MaterialProgram("medium")
    one = p.constant(1.0)
    if is_boundary:
        p.closure("CLOSURE_TRANSPARENT", [one, p.constant(1.0, 1.0, 1.0)])
        p.is_boundary = True
    factor = p.constant(density)
    if seems_uneven:
        zero = p.constant(0.0)
        nothing = p.emit("MATH", [p.emit("SEPARATE_Y", [p.emit("POSITION", [], [0])]), zero, zero], [2, 0])
        factor = p.emit("MATH", [nothing, factor, zero], [0, 0])
    coefficients = [p.constant(*scattering), p.constant(*absorption), factor]
    p.closure("CLOSURE_VOLUME", [one, *coefficients, p.constant(anisotropy), p.constant(phase[1])], [phase[0]])
    p.closure("CLOSURE_VOLUME_EMISSION", [one, p.constant(*glow), one])
    return p


def uneven_medium(scattering: Color = (0.0, 0.0, 0.0), absorption: Color = (0.0, 0.0, 0.0)) -> core.MaterialProgram:
    """The same of a density of |y|."""
    p = core.MaterialProgram("uneven")
    one, zero = p.constant(1.0), p.constant(0.0)
    p.closure("CLOSURE_TRANSPARENT", [one, p.constant(1.0, 1.0, 1.0)])
    p.is_boundary = True
    y = p.emit("SEPARATE_Y", [p.emit("POSITION", [], [0])])
    density = p.emit("MATH", [y, zero, zero], [9, 0])  # ABSOLUTE
    p.closure("CLOSURE_VOLUME", [one, p.constant(*scattering), p.constant(*absorption), density, zero, zero], [0])
    return p


class SceneDescription:
    """A builder with one-line ways to add things; `render` runs a session to its end."""

    def __init__(self) -> None:
        self.builder = core.SceneBuilder()
        self.instances: list[tuple[int, int, np.ndarray]] = []
        self.visibility: list[int] = []  # by instance
        self.links: np.ndarray | None = None  # (n, 2), of add_instances

    def add_mesh(
        self,
        positions: Sequence[Sequence[float]],
        polygons: Sequence[Sequence[int]],
        material: core.MaterialProgram,
        matrix: np.ndarray | None = None,
        smooth: bool = False,
        name: str = "mesh",
        visibility: int = VISIBLE_TO_ALL,
        normals: Sequence[Sequence[float]] | None = None,
    ) -> None:
        """Normals are by point; of a smooth mesh they lead away from the origin. Without either it is flat."""
        points = np.array(positions, np.float32)
        corners = np.concatenate([np.asarray(p, np.int32) for p in polygons])
        offsets = np.concatenate([[0], np.cumsum([len(p) for p in polygons])]).astype(np.int32)
        if smooth:
            normals = points / np.linalg.norm(points, axis=1, keepdims=True)
        shading = {} if normals is None else dict(normals=np.array(normals, np.float32), normals_domain="POINT")
        mesh = self.builder.add_mesh(name, points, corners, offsets, **shading)
        materials = self.builder.add_material_set([self.builder.add_material(material)], name)
        self.instances.append((mesh, materials, np.eye(4) if matrix is None else matrix))
        self.visibility.append(visibility)

    def add_quad(
        self,
        corner: Color,
        edge_u: Color,
        edge_v: Color,
        material: core.MaterialProgram,
        name: str = "quad",
        visibility: int = VISIBLE_TO_ALL,
    ) -> None:
        """Faces along edge_u x edge_v."""
        c, u, v = (np.array(x, np.float64) for x in (corner, edge_u, edge_v))
        self.add_mesh([c, c + u, c + u + v, c + v], [(0, 1, 2, 3)], material, name=name, visibility=visibility)

    def add_box(self, half: float, material: core.MaterialProgram, name: str = "box") -> None:
        """An axis-aligned cube around the origin."""
        signs = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)]
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        self.add_mesh(signs, faces, material, name=name)

    def add_sphere(
        self, radius: float, material: core.MaterialProgram, center: Color = (0, 0, 0), rings: int = 32
    ) -> None:
        """A smooth-shaded latitude-longitude sphere."""
        theta = np.linspace(0.0, np.pi, rings + 1)[1:-1]
        phi = np.arange(2 * rings) * np.pi / rings
        across, along = np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi))
        ring = np.stack([across, along, np.broadcast_to(np.cos(theta)[:, None], across.shape)], -1)
        points = [(0, 0, 1), *ring.reshape(-1, 3), (0, 0, -1)]
        n, last = 2 * rings, len(points) - 1
        faces = [(0, 1 + k, 1 + (k + 1) % n) for k in range(n)]
        for r in range(rings - 2):
            low, high = 1 + r * n, 1 + (r + 1) * n
            faces += [(low + k, high + k, high + (k + 1) % n, low + (k + 1) % n) for k in range(n)]
        bottom = 1 + (rings - 2) * n
        faces += [(last, bottom + (k + 1) % n, bottom + k) for k in range(n)]
        matrix = np.diag([radius, radius, radius, 1.0])
        matrix[:3, 3] = center
        self.add_mesh(points, faces, material, matrix, smooth=True, name="sphere")

    def add_splats(
        self,
        positions: Sequence[Sequence[float]],
        scales: Sequence[Sequence[float]],
        colors: Sequence[Sequence[float]],
        opacities: Sequence[float],
        rotations: Sequence[Sequence[float]] | None = None,
        material: core.MaterialProgram | None = None,
    ) -> None:
        """Gaussian splats of these sRGB colours; without a material they send them."""
        base = (np.asarray(colors) - 0.5) / 0.2820948
        turned = [(1.0, 0.0, 0.0, 0.0)] * len(positions) if rotations is None else rotations
        arrays = (positions, scales, turned, np.column_stack([base, opacities]))
        mesh = self.builder.add_splats("splats", *(np.ascontiguousarray(a, np.float32) for a in arrays))
        material = self.builder.add_material(radiance() if material is None else material)
        self.instances.append((mesh, self.builder.add_material_set([material], "splats"), np.eye(4)))
        self.visibility.append(VISIBLE_TO_ALL)

    def set_environment(self, color: Color) -> None:
        self.builder.set_environment(self.builder.add_material(emission(color)))

    def set_camera(self, position: Color, target: Color, half_width: float = 0.5) -> None:
        """Square perspective picture; half_width is the tangent of half the field of view."""
        eye, aim = np.array(position, np.float64), np.array(target, np.float64)
        back = (eye - aim) / np.linalg.norm(eye - aim)
        up = np.array([0.0, 1.0, 0.0]) if abs(back[2]) > 0.99 else np.array([0.0, 0.0, 1.0])
        right = np.cross(up, back)
        right /= np.linalg.norm(right)
        matrix = np.eye(4)
        matrix[:3, :4] = np.stack([right, np.cross(back, right), back, eye], 1)
        window = dict(left=-half_width, right=half_width, bottom=-half_width, top=half_width)
        self.builder.set_camera(
            "camera", "PERSPECTIVE", matrix.astype(np.float32), **window, clip_start=1e-3, clip_end=1e9
        )

    def snapshot(self) -> core.Scene:
        if self.instances:
            mesh, materials, matrices = zip(*self.instances, strict=True)
            count = len(mesh)
            name = self.builder.add_object_name("objects")
            self.builder.add_instances(
                np.array(mesh, np.int32), np.array(materials, np.int32), np.full(count, name, np.int32),
                np.array(matrices, np.float32), np.array(self.visibility, np.uint8), links=self.links,
            )  # fmt: skip
            self.instances, self.visibility = [], []
        return self.builder.snapshot()


DEFAULTS = dict(pixel_filter=core.PixelFilter.BOX, filter_width=1.0, max_bounces=1024, max_diffuse_bounces=1024,
                max_glossy_bounces=1024, max_transmission_bounces=1024, max_volume_bounces=1024)  # fmt: skip


def render(scene: core.Scene, size: int = 16, samples: int = 16, **settings) -> dict[str, np.ndarray]:
    """All passes of a finished render; raises when it failed or met samples or weights that are not finite."""
    passes = settings.pop("passes", ["Direct", "Indirect", "Emission", "Environment"])
    members = DEFAULTS | dict(width=size, height=size, samples=samples, passes=passes) | settings
    session = core.Session(core.Settings(**members))
    session.start(scene)
    progress = session.wait(600.0)
    assert progress.status is core.Status.DONE, progress.error
    assert progress.non_finite_samples == 0
    assert progress.non_finite_weights == 0
    return {name: session.read(name) for name in session.pass_names()}


def replicas(scene: core.Scene, count: int, first_seed: int = 1, **settings) -> np.ndarray:
    """Combined RGB of `count` renders with different seeds: (count, height, width, 3)."""
    return np.array([render(scene, seed=first_seed + k, **settings)["Combined"][..., :3] for k in range(count)])
