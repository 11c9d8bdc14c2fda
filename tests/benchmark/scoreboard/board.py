"""Renders one scene by all engines for equal CPU times, and draws the numbers of the scoreboard from it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.scoreboard.catalogue import CYCLES, Engine, Scene, engine_named
from tests.benchmark.scoreboard.errors import Errors, Reference
from tests.benchmark.scoreboard.measure import Laboratory
from tests.benchmark.scoreboard.render import PARTS, Picture

SHARES = (1 / 4, 1 / 2, 1.0)  # of the budget; the pilot is shorter
PILOT_SAMPLES = 4
FILLED = 0.75
SLOWEST = 0.3
TARGET_SEED = 1001
ROUNDING = 1e-4
TARGETS = 3  # pictures by Cycles whose mean error after denoising is to be reached
SCALES = {"pixel": "1 px", "box4": "4 px", "box8": "8 px"}


@dataclass(frozen=True)
class Plan:
    engines: list[Engine]
    samples: int  # of Cycles
    budget_seconds: float | None
    rounds: int


@dataclass(frozen=True)
class Shot:
    """One picture, scored."""

    engine: Engine
    samples: int
    seed: int
    picture: Picture
    denoised: NDArray[np.float32]
    errors: Errors
    denoised_errors: Errors

    @property
    def seconds(self) -> float:
        """CPU time without export and building."""
        return self.picture.net_seconds

    def samples_in(self, seconds: float) -> int:
        """How many would take so long, by its time per sample."""
        return max(round(seconds * self.samples / self.seconds), 1)

    def product(self, scale: str) -> float:
        """Error x time."""
        return self.errors.at(scale) * self.seconds


@dataclass
class SceneScore:
    scene: Scene
    reference: Reference
    targets: list[Shot]  # Cycles with equally many samples, whose error after denoising is to be reached
    # Difference between Cycles and a reference that is not its own, noise left out, and what of it can be told.
    to_cycles: tuple[Errors, Errors] | None = None
    shots: dict[str, list[Shot]] = field(default_factory=dict)  # by engine

    @property
    def target_error(self) -> float:
        """Geometric mean of the targets' errors after denoising."""
        return float(np.exp(np.mean([np.log(shot.denoised_errors.pixel) for shot in self.targets])))

    def last(self, name: str) -> Shot:
        """One with the most samples."""
        return max(self.shots[name], key=lambda shot: shot.samples)

    def product(self, name: str, scale: str) -> float:
        """Error x time of the longest renders, geometric mean over the rounds."""
        enough = 0.75 * self.last(name).samples
        return float(np.exp(np.mean([np.log(s.product(scale)) for s in self.shots[name] if s.samples > enough])))

    def time_to_target(self, name: str) -> float:
        """CPU seconds to the denoised error of the targets, by a line through the logarithms of the two renders about
        it. Where the shortest render is better already, its time; where the longest is worse, the last line goes on,
        falling with at least the power SLOWEST of time."""
        goal = np.log(self.target_error)
        curve = self.denoised_curve(name)
        if curve[0][1] <= goal:
            return float(np.exp(curve[0][0]))
        slope = -SLOWEST
        for (t0, e0), (t1, e1) in itertools.pairwise(curve):
            if e1 <= goal < e0:
                return float(np.exp(t0 + (t1 - t0) * (e0 - goal) / (e0 - e1)))
            slope = min((e1 - e0) / (t1 - t0), -SLOWEST)
        return float(np.exp(curve[-1][0] + (goal - curve[-1][1]) / slope))

    def denoised_curve(self, name: str) -> list[tuple[float, float]]:
        """Logarithms of seconds and of the error after denoising, by samples; means over renders of nearly as many."""
        groups: list[list[Shot]] = []
        shots = [*self.shots[name], *(self.targets if name == CYCLES else ())]
        for shot in sorted(shots, key=lambda shot: shot.samples):
            if groups and shot.samples <= 1.4 * groups[-1][0].samples:
                groups[-1].append(shot)
            else:
                groups.append([shot])
        pairs = [[(np.log(s.seconds), np.log(s.denoised_errors.pixel)) for s in group] for group in groups]
        return [tuple(np.mean(group, axis=0)) for group in pairs]

    def best_cycles(self, scale: str) -> str:
        """Its setting with the smallest error x time at a scale; for "denoised", the fastest to the target."""
        names = [name for name in self.shots if name.startswith(CYCLES)]
        value = self.time_to_target if scale == "denoised" else (lambda name: self.product(name, scale))
        return min(names, key=value)


def denoised_alike(picture: Picture, guides: dict[str, NDArray[np.float32]]) -> NDArray[np.float32]:
    """For every engine: direct light with the sky, indirect light and the emission in view, each by itself. Emission is
    nowhere but where it was found: filters spread its glow over the dark around lamps."""
    from addon.denoise import Layers, denoise, denoise_layers

    def clean(layer: NDArray[np.float32]) -> NDArray[np.float32]:
        return denoise(layer, **guides, has_clean_guides=True)

    indirect, emission = (picture.parts[name] for name in PARTS)
    scattered = picture.combined - indirect - emission
    if scattered.min() < -ROUNDING * picture.combined.max():
        return clean(picture.combined)
    layers = Layers(np.maximum(scattered, 0.0), indirect)
    shown = np.where(emission > 0.0, clean(emission), 0.0) if emission.any() else 0.0
    return denoise_layers(layers, **guides, has_clean_guides=True) + shown


def shoot(laboratory: Laboratory, scene: Scene, reference: Reference, engine: Engine, samples: int, seed: int) -> Shot:
    picture = laboratory.render(scene, engine, samples, seed)
    denoised = denoised_alike(picture, reference.guides)
    shot = Shot(
        engine, samples, seed, picture, denoised, reference.errors(picture.combined), reference.errors(denoised)
    )
    print(
        f"{scene.name:20s} {engine.name:16s} {samples:5d} samples {shot.seconds:7.2f} s (+ {picture.sync_seconds:.2f}) "
        f"relMSE {shot.errors.pixel:.4f}, 8 px {shot.errors.box8:.5f}, denoised {shot.denoised_errors.pixel:.4f}",
        flush=True,
    )
    return shot


def score(laboratory: Laboratory, scene: Scene, plan: Plan) -> SceneScore:
    """First the targets, which set the budget; then a short render of each engine, which sets its sample counts."""
    reference = laboratory.reference(scene)

    def take(engine: Engine, samples: int, seed: int) -> Shot:
        return shoot(laboratory, scene, reference, engine, samples, seed)

    targets = [take(engine_named(CYCLES), plan.samples, TARGET_SEED + k) for k in range(TARGETS)]
    budget = plan.budget_seconds or min(target.seconds for target in targets)
    found = SceneScore(scene, reference, targets, laboratory.difference_to_cycles(scene, reference))
    for engine in plan.engines:
        found.shots[engine.name] = [take(engine, PILOT_SAMPLES, 1)]
    for seed in range(2, plan.rounds + 2):
        for share in SHARES:
            for engine in plan.engines:
                shots = found.shots[engine.name]
                longest = max(shots, key=lambda shot: shot.samples)  # whose time per sample is known best
                samples = longest.samples_in(share * budget)
                if samples <= PILOT_SAMPLES and share < SHARES[-1]:
                    continue
                shot = take(engine, samples, seed)
                if shot.seconds < FILLED * share * budget:  # longer renders may do other things
                    shot = take(engine, shot.samples_in(share * budget), seed)
                shots.append(shot)
    return found
