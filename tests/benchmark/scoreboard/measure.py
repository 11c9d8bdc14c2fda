"""Starts the processes that render, and keeps the references: one picture per scene, in two independent halves.

Guides of denoisers are Cycles' in every scene. Where the reference is not, parts by Cycles also tell whether both
engines render the same picture. Parts by ours are worth what the core was that rendered them: delete them when a fault
of it was mended.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.scoreboard.catalogue import ROOT, Engine, Scene, engine_named
from tests.benchmark.scoreboard.errors import Errors, Reference
from tests.benchmark.scoreboard.render import GUIDES, Job, Picture

PROCESS_SECONDS = 3600
PART_SAMPLES = 64  # of one part of a reference
REFERENCE_SEED = 1_000_001
GUIDE_ENGINE = "cycles-front"


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

    def _part(self, scene: Scene, engine: str, index: int) -> Path:
        of_engine = "" if engine == GUIDE_ENGINE else f"-{engine}"
        return self.cache / f"{scene.name}-{scene.fingerprint()}-{self.pixels}{of_engine}-part{index:04d}.npz"

    def parts(self, scene: Scene, engine: str) -> list[Picture]:
        """An even number of them, in turn of one half and of the other."""
        first = self._part(scene, engine, 0)
        paths = sorted(self.cache.glob(first.name.replace("0000", "*")))
        return [Picture.load(path) for path in paths[: len(paths) // 2 * 2]]

    def extend_reference(self, scene: Scene, samples: int) -> None:
        """Renders what parts are missing; both halves get equally many."""
        self.cache.mkdir(parents=True, exist_ok=True)
        parts = 2 * max(1, round(samples / (2 * PART_SAMPLES)))
        for engine, count in ({GUIDE_ENGINE: 2} | {scene.reference: parts}).items():
            for k in range(count):
                path = self._part(scene, engine, k)
                if path.is_file():
                    continue
                partial = path.with_name(f"partial-{path.name}")
                self._run(
                    scene, engine_named(engine), PART_SAMPLES, REFERENCE_SEED + k, engine == GUIDE_ENGINE, partial
                )
                partial.replace(path)
                print(f"reference of {scene.name}: {engine}, part {k + 1} of {count}", flush=True)

    def reference(self, scene: Scene) -> Reference:
        parts, guiding = self.parts(scene, scene.reference), self.parts(scene, GUIDE_ENGINE)
        if not parts or not guiding:
            raise SystemExit(f"{scene.name} has no reference: run `python -m tests.benchmark.scoreboard references`")
        first, second = halves(parts)
        guides = {name: mean([part.guides[name] for part in guiding]).astype(np.float32) for name in GUIDES}
        base = without_noise(0.5 * (first + second), guides)
        return Reference(first, second, base, guides, PART_SAMPLES * len(parts))

    def difference_to_cycles(self, scene: Scene, reference: Reference) -> tuple[Errors, Errors] | None:
        """What of the errors of Cycles is no noise, and what of it can be told; None where the reference is its own."""
        if scene.reference == GUIDE_ENGINE:
            return None
        theirs = halves(self.parts(scene, GUIDE_ENGINE))
        return reference.common(theirs), reference.least_common(theirs)


def mean(pictures: list[NDArray]) -> NDArray[np.float64]:
    return np.mean(np.stack(pictures).astype(np.float64), axis=0)


def halves(parts: list[Picture]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    first, second = (mean([part.combined for part in parts[half::2]]) for half in (0, 1))
    return first, second


def without_noise(picture: NDArray, guides: dict[str, NDArray]) -> NDArray[np.float64]:
    """By the denoiser, for guides without noise."""
    from addon.denoise import denoise

    found = denoise(picture.astype(np.float32), **guides, has_clean_guides=True)
    assert found is not None  # as for all who do not lose interest
    return found.astype(np.float64)
