"""Images made of noise and arithmetic: bricks, marble, limestone, wood, glaze and a sky. All but the sky tile."""

import bpy
import numpy as np
from numpy.typing import NDArray

Plane = NDArray[np.float64]  # (height, width)
Picture = NDArray[np.float64]  # (height, width, 3)


def noise(size: int, slope: float, seed: int, stretch: float = 1.0) -> Plane:
    """Tileable noise in [0, 1] whose spectrum falls as frequency^-slope; `stretch` > 1 draws it out along u."""
    white = np.random.default_rng(seed).standard_normal((size, size))
    fy, fx = np.meshgrid(np.fft.fftfreq(size), np.fft.fftfreq(size), indexing="ij")
    frequency = np.hypot(fx * stretch, fy)
    frequency[0, 0] = np.inf
    field = np.fft.ifft2(np.fft.fft2(white) * frequency**-slope).real
    low, high = np.percentile(field, (0.5, 99.5))
    return np.clip((field - low) / (high - low), 0.0, 1.0)


def mixed(a: tuple[float, float, float], b: tuple[float, float, float], share: Plane) -> Picture:
    return np.asarray(a) + (np.asarray(b) - np.asarray(a)) * share[..., None]


def smoothstep(low: float, high: float, x: Plane) -> Plane:
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def normals(height: Plane, strength: float) -> Picture:
    """A tangent-space normal map, Blender's way: green points along +v. `strength` is height over texel size."""
    dv = (np.roll(height, -1, axis=0) - np.roll(height, 1, axis=0)) * strength
    du = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) * strength
    normal = np.stack([-du, -dv, np.ones_like(height)], axis=2)
    return 0.5 + 0.5 * normal / np.linalg.norm(normal, axis=2, keepdims=True)


def bricks(size: int = 1024, rows: int = 16, across: int = 5) -> tuple[Picture, Picture]:
    """Colour and normals of a wall of thin Roman bricks in wide mortar."""
    rng = np.random.default_rng(11)
    v, u = np.meshgrid(np.arange(size) / size, np.arange(size) / size, indexing="ij")
    wobble = 0.004 * (noise(size, 1.6, 12) - 0.5)
    row = np.floor((v + wobble) * rows).astype(int) % rows
    along = (u + wobble) * across + 0.5 * (row % 2)
    column = np.floor(along).astype(int) % across
    from_joint = np.minimum(
        0.5 - np.abs(((v + wobble) * rows) % 1.0 - 0.5), (0.5 - np.abs(along % 1.0 - 0.5)) * rows / across
    )
    grain = noise(size, 0.9, 13)
    solid = smoothstep(0.10, 0.22, from_joint + 0.10 * (grain - 0.5))
    tone = rng.random((rows, across))[row, column]
    brick = mixed((0.42, 0.23, 0.15), (0.68, 0.45, 0.30), 0.65 * tone + 0.35 * grain)
    mortar = mixed((0.52, 0.46, 0.38), (0.70, 0.64, 0.55), grain)
    soot = 0.72 + 0.28 * smoothstep(0.25, 0.6, noise(size, 1.8, 14))
    colour = (brick * solid[..., None] + mortar * (1.0 - solid[..., None])) * soot[..., None]
    return colour, normals(solid + 0.35 * grain + 0.25 * tone * solid, 1.6)


def marble(size: int = 1024) -> Picture:
    veins = np.abs(noise(size, 1.7, 21) - 0.5) * 2.0
    fine = np.abs(noise(size, 1.4, 22) - 0.5) * 2.0
    base = mixed((0.74, 0.69, 0.60), (0.88, 0.85, 0.79), noise(size, 1.5, 23))
    # Veins fade in and out, or they would close into rings.
    strong, faint = smoothstep(0.45, 0.75, noise(size, 1.5, 24)), smoothstep(0.35, 0.8, noise(size, 1.3, 25))
    dark = (1.0 - smoothstep(0.0, 0.16, veins)) * 0.5 * strong + (1.0 - smoothstep(0.0, 0.08, fine)) * 0.3 * faint
    return base * (1.0 - dark[..., None] * np.array([0.55, 0.60, 0.62]))


def limestone(size: int = 1024) -> tuple[Picture, Picture]:
    broad, grain = noise(size, 1.6, 31), noise(size, 0.7, 32)
    pits = smoothstep(0.68, 0.80, noise(size, 1.1, 33))
    colour = mixed((0.52, 0.45, 0.35), (0.80, 0.73, 0.61), 0.7 * broad + 0.3 * grain) * (1.0 - 0.45 * pits[..., None])
    return colour, normals(0.6 * broad + 0.25 * grain - 0.8 * pits, 2.0)


def wood(size: int = 512) -> Picture:
    rings = noise(size, 1.5, 41, stretch=12.0)
    fibre = noise(size, 0.6, 42, stretch=30.0)
    return mixed((0.20, 0.12, 0.07), (0.48, 0.32, 0.19), 0.6 * (0.5 + 0.5 * np.sin(40.0 * rings)) + 0.4 * fibre)


def glaze(size: int = 512) -> Picture:
    """Bands and a wave for the jars: ochre on deep blue."""
    v, u = np.meshgrid(np.arange(size) / size, np.arange(size) / size, indexing="ij")
    wave = np.abs(v - 0.55 - 0.05 * np.sin(16.0 * np.pi * u)) < 0.022
    bands = (np.abs(v - 0.42) < 0.012) | (np.abs(v - 0.68) < 0.012) | (np.abs(v - 0.25) < 0.03) | (v > 0.86)
    lozenge = (np.abs((8.0 * u) % 1.0 - 0.5) + np.abs(v - 0.33) * 9.0) < 0.33
    figure = smoothstep(0.3, 0.7, (wave | bands | lozenge).astype(float))
    return mixed((0.05, 0.16, 0.38), (0.86, 0.62, 0.27), figure) * (0.85 + 0.15 * noise(size, 1.2, 51))[..., None]


def sky(width: int = 1024) -> Picture:
    """Linear radiance of a late-morning sky with thin cloud and no sun, equirectangular, the zenith in the last row."""
    height = width // 2
    elevation = (np.arange(height) + 0.5) / height * np.pi - 0.5 * np.pi
    up = np.clip(np.sin(elevation), 0.0, 1.0)[:, None] * np.ones(width)
    blue = mixed((0.85, 0.93, 1.0), (0.18, 0.42, 1.0), up**0.55)
    cloud = smoothstep(0.45, 0.85, np.tile(noise(height, 1.6, 61, stretch=0.6), (1, 2)))
    colour = blue * (1.0 - 0.8 * cloud[..., None]) + 1.5 * cloud[..., None]
    below = smoothstep(-0.05, 0.02, np.sin(elevation))[:, None, None]
    return colour * below + np.array([0.12, 0.10, 0.08]) * (1.0 - below)


def to_image(name: str, picture: Picture, colour_space: str, is_float: bool = False) -> bpy.types.Image:
    """A packed image; row 0 of the picture is the bottom. Byte images take display-encoded values."""
    height, width = picture.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=False, float_buffer=is_float)
    image.colorspace_settings.name = colour_space
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = picture
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image
