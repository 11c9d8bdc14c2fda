"""Starts the processes that render, and keeps the references: one picture per scene, in two independent halves."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.scoreboard.catalogue import ROOT, Engine, Scene, engine_named
from tests.benchmark.scoreboard.errors import Reference
from tests.benchmark.scoreboard.render import GUIDES, Job, Picture

PROCESS_SECONDS = 3600
PART_SAMPLES = 64  # of one part of a reference
REFERENCE_SEED = 1_000_001
REFERENCE_ENGINE = "cycles-front"


@dataclass(frozen=True)
class Laboratory:
    """Where pictures are rendered and references kept."""

    cache: Path  # built scenes and parts of references
    pixels: int

    def blend(self, scene: Scene) -> Path:
        return self.cache / f"{scene.name}-{scene.fingerprint()}.blend" if scene.module else scene.file

    def render(self, scene: Scene, engine: Engine, samples: int, seed: int, guides: bool = False) -> Picture:
        """In a process of its own, so that neither time nor memory knows of other renders."""
        self.cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="cistern-scoreboard-") as folder:
            path = Path(folder) / "picture.npz"
            self._run(scene, engine, samples, seed, guides, path)
            return Picture.load(path)

    def _run(self, scene: Scene, engine: Engine, samples: int, seed: int, guides: bool, path: Path) -> None:
        what = dict(blend=str(self.blend(scene)), module=scene.module, pixels=self.pixels, guides=guides)
        job = Job.of(engine, samples=samples, seed=seed, **what)
        command = [sys.executable, "-m", "tests.benchmark.scoreboard.render", job.to_json(), str(path)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PROCESS_SECONDS, check=False)
        if done.returncode != 0 or not path.is_file():
            raise SystemExit(f"{scene.name} with {engine.title} failed:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")

    def _parts(self, scene: Scene) -> list[Path]:
        stem = f"{scene.name}-{scene.fingerprint()}-{self.pixels}"
        return sorted(self.cache.glob(f"{stem}-part*.npz"))

    def extend_reference(self, scene: Scene, samples: int) -> None:
        """Renders what parts are missing, by Cycles; both halves get equally many."""
        self.cache.mkdir(parents=True, exist_ok=True)
        parts = 2 * max(1, round(samples / (2 * PART_SAMPLES)))
        for k in range(parts):
            path = self.cache / f"{scene.name}-{scene.fingerprint()}-{self.pixels}-part{k:04d}.npz"
            if path.is_file():
                continue
            partial = path.with_name(f"partial-{path.name}")
            self._run(scene, engine_named(REFERENCE_ENGINE), PART_SAMPLES, REFERENCE_SEED + k, True, partial)
            partial.replace(path)
            print(f"reference of {scene.name}: part {k + 1} of {parts}", flush=True)

    def reference(self, scene: Scene) -> Reference:
        parts = [Picture.load(path) for path in self._parts(scene)]
        parts = parts[: len(parts) // 2 * 2]
        if not parts:
            raise SystemExit(f"{scene.name} has no reference: run `python -m tests.benchmark.scoreboard references`")

        def mean(pictures: list[NDArray]) -> NDArray:
            return np.mean(np.stack(pictures).astype(np.float64), axis=0)

        halves = [mean([part.combined for part in parts[half::2]]) for half in (0, 1)]
        guides = {name: mean([part.guides[name] for part in parts]).astype(np.float32) for name in GUIDES}
        return Reference(halves[0], halves[1], guides, PART_SAMPLES * len(parts))
