"""One picture of the scoreboard, rendered by Blender in a process of its own.

    python -m tests.benchmark.scoreboard.render JOB.json FILE.npz

Saves the picture and what it cost: CPU seconds of all threads and wall seconds of the render call, the peak memory of
the process, and as `sync_seconds` the CPU time of the same call for 8 x 4 pixels and one sample without any reuse: the
export of the scene and the building of acceleration structures. Besides the picture, two parts of it for denoisers:
indirect light, and the emission that the camera sees. Of a guide job, albedo and normal too.
"""

from __future__ import annotations

import atexit
import itertools
import json
import resource
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.scoreboard.catalogue import EXAMPLES, PATH, Engine
from tests.support.blender_folder import use_own_folder

if TYPE_CHECKING:
    import bpy

BOUNCES = 12
GUIDES = {"albedo": "Denoising Albedo", "normal": "Denoising Normal"}  # pass names of Cycles
PARTS = ("indirect", "emission")
# Of Cycles' indirect light, whose passes are to be multiplied by colours; before Blender 5.0 their names were short.
KINDS = {"Diffuse": "Diff", "Glossy": "Gloss", "Transmission": "Trans"}


@dataclass(frozen=True)
class Job:
    blend: str
    module: str  # builds `blend` where it is missing; "": it is there
    engine_id: str
    settings: dict[str, Any]
    emission_sampling: str
    pixels: int  # of the picture, in the scene's own shape
    samples: int
    seed: int
    guides: bool = False

    @classmethod
    def of(cls, engine: Engine, **rest: Any) -> Job:
        chosen = {name: getattr(engine, name) for name in ("engine_id", "settings", "emission_sampling")}
        return cls(**chosen, **rest)

    def to_json(self) -> str:
        return json.dumps(asdict(self))


@dataclass
class Picture:
    combined: NDArray[np.float32]  # (height, width, 3), row 0 at the top
    seconds: float  # of CPU, export and building included
    sync_seconds: float
    wall_seconds: float
    peak_mb: float
    guides: dict[str, NDArray[np.float32]] = field(default_factory=dict)
    parts: dict[str, NDArray[np.float32]] = field(default_factory=dict)  # none in references

    @property
    def net_seconds(self) -> float:
        return max(self.seconds - self.sync_seconds, 1e-3)

    @classmethod
    def load(cls, path: Path) -> Picture:
        with np.load(path) as file:
            numbers = {name: float(file[name]) for name in ("seconds", "sync_seconds", "wall_seconds", "peak_mb")}
            guides = {name: file[name] for name in GUIDES if name in file}
            parts = {name: file[name] for name in PARTS if name in file}
            return cls(file["combined"], **numbers, guides=guides, parts=parts)


def open_scene(job: Job) -> None:
    """Opens the file; builds it first where a module of examples/ does that."""
    import bpy

    if job.module and not Path(job.blend).is_file():
        sys.path.append(str(EXAMPLES))
        module, tools = __import__(job.module), __import__("scene_tools")
        module.build(tools.empty_scene())
        tools.save(Path(job.blend))
    bpy.ops.wm.open_mainfile(filepath=job.blend, load_ui=False)


def prepare_picture(scene: bpy.types.Scene, pixels: int) -> None:
    """Settings that mean the same in both engines, and about so many pixels in the scene's shape."""
    from tests.support.engines import prepare

    share = scene.render.resolution_percentage / 100.0
    width, height = scene.render.resolution_x * share, scene.render.resolution_y * share
    scale = (pixels / (width * height)) ** 0.5
    prepare(scene, round(width * scale), round(height * scale), BOUNCES)
    scene.render.film_transparent = False


def set_up(job: Job) -> None:
    import bpy

    scene = bpy.context.scene
    prepare_picture(scene, job.pixels)
    scene.render.engine = job.engine_id
    settings = scene.cycles if job.engine_id == "CYCLES" else scene.cistern
    for name, value in job.settings.items():
        setattr(settings, name, value)
    settings.samples, settings.seed = job.samples, job.seed
    for material in bpy.data.materials:
        if job.emission_sampling and material.cycles.emission_sampling == "AUTO":
            material.cycles.emission_sampling = job.emission_sampling
    ask_for_passes(job)
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"


def ask_for_passes(job: Job) -> None:
    import bpy

    layer = bpy.context.view_layer
    layer.cycles.denoising_store_passes = job.guides
    layer.use_pass_emit = True
    layer.cistern.use_pass_indirect = True
    for kind, part in itertools.product(KINDS, ("indirect", "color")):
        setattr(layer, f"use_pass_{kind.lower()}_{part}", job.engine_id == "CYCLES")


def light_parts(passes: dict[str, NDArray[np.float32]]) -> dict[str, NDArray[np.float32]]:
    """Those of PARTS, by either engine's names."""
    if "Indirect" in passes:
        indirect = passes["Indirect"]
    elif "Diffuse Indirect" in passes:
        indirect = sum(passes[f"{kind} Indirect"] * passes[f"{kind} Color"] for kind in KINDS)
    else:
        indirect = sum(passes[f"{kind}Ind"] * passes[f"{kind}Col"] for kind in KINDS.values())
    return {"indirect": indirect, "emission": passes["Emission" if "Emission" in passes else "Emit"]}


def cpu_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def render(file: Path) -> tuple[float, float]:
    """CPU and wall seconds. Raises with Cistern's own words when its render failed."""
    import bpy

    import addon

    scene = bpy.context.scene
    scene.render.filepath = str(file)
    addon.report.last.clear()
    cpu, wall = cpu_seconds(), time.monotonic()
    bpy.ops.render.render(write_still=True)
    spent = cpu_seconds() - cpu, time.monotonic() - wall
    errors = [line.error for line in addon.report.last if line.error]
    if errors or (scene.render.engine == "CISTERN" and not addon.report.last):
        raise RuntimeError("; ".join(errors) or "nothing was rendered")
    return spent


def read_passes(file: Path) -> dict[str, NDArray[np.float32]]:
    """(height, width, 3) by pass name, of the passes with three channels or more, alpha left out."""
    import OpenImageIO

    source = OpenImageIO.ImageInput.open(str(file))
    planes: dict[str, dict[str, NDArray]] = {}
    part = 0
    while source.seek_subimage(part, 0):
        pixels = source.read_image("float")
        for index, name in enumerate(source.spec().channelnames):
            pass_name, _, channel = name.split(".", 1)[-1].rpartition(".")
            planes.setdefault(pass_name, {})[channel] = pixels[..., index]
        part += 1
    source.close()
    triples = {name: next((k for k in ("RGB", "XYZ") if set(k) <= set(found)), "") for name, found in planes.items()}
    return {name: np.stack([planes[name][c] for c in channels], 2) for name, channels in triples.items() if channels}


def measure(job: Job) -> dict[str, Any]:
    import bpy

    set_up(job)
    with tempfile.TemporaryDirectory(prefix="cistern-scoreboard-") as folder:
        file = Path(folder) / "picture.exr"
        seconds, wall_seconds = render(file)
        passes = read_passes(file)
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        scene = bpy.context.scene
        scene.render.resolution_x, scene.render.resolution_y = 8, 4
        if job.engine_id == "CISTERN":
            for name, value in PATH.items():
                setattr(scene.cistern, name, value)
        (scene.cycles if job.engine_id == "CYCLES" else scene.cistern).samples = 1
        sync_seconds, _ = render(file)
    guides = {name: passes[pass_name] for name, pass_name in GUIDES.items()} if job.guides else {}
    numbers = dict(seconds=seconds, sync_seconds=sync_seconds, wall_seconds=wall_seconds, peak_mb=peak_mb)
    return dict(combined=passes["Combined"], **light_parts(passes), **numbers, **guides)


def main() -> None:
    import bpy  # noqa: F401, after which the core shares its oneTBB

    import addon

    job = Job(**json.loads(sys.argv[1]))
    addon.register()
    atexit.register(addon.unregister)
    open_scene(job)
    found = measure(job)
    path = Path(sys.argv[2])
    with path.open("wb") as file:
        np.savez(file, **found)


if __name__ == "__main__":
    use_own_folder()
    main()
