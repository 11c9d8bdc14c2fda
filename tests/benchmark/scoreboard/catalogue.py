"""What the scoreboard compares: benchmark scenes by kind with their bars, and engines with their settings."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "examples"
SCENES_VARIABLE = "CISTERN_TEST_SCENES"


@dataclass(frozen=True)
class Bars:
    """Largest share of the best Cycles setting's error x time that Cistern may take: per pixel and in boxes of 8 x 8
    pixels; and of its CPU time to a given error after denoising."""

    pixel: float
    boxes: float
    denoised: float


KINDS = {
    "hard": Bars(0.1, 0.33, 0.2),  # many lights, light through a gap, a far small emitter
    "easy": Bars(0.33, 0.67, 0.5),  # large lights indoors
    "open": Bars(0.5, 0.8, 0.7),  # sun and sky, gloss
}
PATH_TRACER_BAR = 1.1  # of plain path tracing's error x time, on every scene at every scale


@dataclass(frozen=True)
class Scene:
    """One that a module of examples/ builds, or a .blend file of the folder that CISTERN_TEST_SCENES names."""

    name: str
    kind: str
    module: str = ""
    reference: str = "cycles-front"  # engine of its reference: Cycles but where that takes too long to tell errors

    @property
    def file(self) -> Path | None:
        folder = os.environ.get(SCENES_VARIABLE)
        return Path(folder) / f"{self.name}.blend" if folder else None

    @property
    def is_there(self) -> bool:
        return bool(self.module) or (self.file is not None and self.file.is_file())

    def fingerprint(self) -> str:
        """Changes with what the scene is made from: references are kept under it."""
        shared = [EXAMPLES / "scene_tools.py", *sorted((EXAMPLES / "cistern_hall").glob("*.py"))]
        sources = [EXAMPLES / f"{self.module}.py", *shared] if self.module else [self.file]
        if self.module == "outdoor":
            sources.append(EXAMPLES / "city_grid.py")
        return hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:8]


SCENES = (
    Scene("city_grid", "hard", "city_grid"),
    Scene("market", "hard", "market"),
    Scene("door_ajar", "hard", "door_ajar", reference="final"),
    Scene("veach_ajar", "hard", reference="final"),
    Scene("far_lamp", "hard", "far_lamp", reference="final"),
    Scene("cbox", "easy"),
    Scene("bright_interior", "easy", "bright_interior"),
    Scene("sponza", "easy"),
    Scene("tp_engineer_bedroom", "easy"),
    Scene("outdoor", "open", "outdoor"),
    Scene("glossy_hall", "open", "glossy_hall"),
    Scene("veach_mi", "open"),
    Scene("matpreview", "open"),
)


@dataclass(frozen=True)
class Engine:
    """Settings of `scene.cycles` or `scene.cistern`."""

    name: str
    title: str
    group: str  # CYCLES, PATH, PAPERS, OURS
    settings: dict[str, Any] = field(default_factory=dict)
    emission_sampling: str = ""  # Cycles: of materials left at AUTO

    @property
    def engine_id(self) -> str:
        return "CYCLES" if self.group == "CYCLES" else "CISTERN"


GUIDING = {"use_guiding": True, "use_surface_guiding": True}
# Plain path tracing, whatever the presets choose.
PATH = {
    "preset": "CUSTOM",
    "direct": "NEE",
    "secondary": "NEE",
    "indirect": "PATH",
    "light_sampler": "TREE",
    "use_temporal_reuse": False,
}
LEARNED = {"direct": "LEARNED", "secondary": "LEARNED"}
# Ours shares for denoisers where one follows, as the add-on does: addon/denoise.py.
CYCLES, PATH_TRACER, OURS, OURS_DENOISED = "cycles", "path", "final", "final-denoised"

ENGINES = (
    Engine(CYCLES, "Cycles", "CYCLES"),
    Engine("cycles-front", "Cycles, front emission", "CYCLES", {}, "FRONT"),
    Engine("cycles-flat", "Cycles, no light tree", "CYCLES", {"use_light_tree": False}),
    Engine("cycles-guiding", "Cycles, path guiding", "CYCLES", GUIDING),
    Engine(PATH_TRACER, "path tracer", "PATH", PATH),
    Engine("ris", "RIS [Talbot 2005]", "PAPERS", {"preset": "RIS"}),
    Engine("restir-di", "ReSTIR DI [Bitterli 2020]", "PAPERS", {"preset": "RESTIR_DI"}),
    Engine("cell-cache", "cell cache [Stefanescu 2025]", "PAPERS", {"preset": "CELL_CACHE_UNBIASED"}),
    Engine("cell-reservoirs", "cell reservoirs [Boissé 2021]", "PAPERS", {"preset": "CELL_RESERVOIRS"}),
    Engine("restir-gi", "ReSTIR GI [Ouyang 2021]", "PAPERS", {"preset": "RESTIR_GI"}),
    Engine("world-paths", "world-space paths [Zhang 2023]", "PAPERS", {"preset": "WORLD_PATHS"}),
    Engine("learned", "learned lights (ours)", "OURS", PATH | LEARNED),
    Engine("cell-shared", "cell sharing (ours)", "OURS", PATH | {"indirect": "CELL_SHARED"}),
    Engine("learned-shared", "both (ours)", "OURS", PATH | LEARNED | {"indirect": "CELL_SHARED"}),
    Engine(OURS, "Final (ours)", "OURS", {"preset": "FINAL"}),
    Engine(OURS_DENOISED, "Final, where it is denoised", "OURS", {"preset": "FINAL", "use_share_for_denoiser": True}),
)


def scene_named(name: str) -> Scene:
    return next(scene for scene in SCENES if scene.name == name)


def engine_named(name: str) -> Engine:
    return next(engine for engine in ENGINES if engine.name == name)
