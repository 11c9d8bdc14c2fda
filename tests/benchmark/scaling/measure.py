"""Time and memory of one scene by all systems, in a process of its own.

    python -m tests.benchmark.scaling.measure JOB.json

Each system renders with few samples and with many, in turn (A few, A many, B few, B many, A few ...). The difference is
the cost of samples alone: building the scene, and what the first samples of learned lights cost more, cancel.
"""

from __future__ import annotations

import json
import resource
import statistics
import subprocess
import sys
import time
from dataclasses import asdict, dataclass

from tests.benchmark.scoreboard.catalogue import ROOT

PROCESS_SECONDS = 1800
MAX_BOUNCES = 4
PATH_TRACER, FINAL = "path tracer", "Final"
# As if sharing had won its trial, whose outcome would change with the size of a scene.
SYSTEMS: dict[str, dict] = {
    PATH_TRACER: {},
    "path tracer, lights by power": {"light_sampling": "POWER"},
    FINAL: {"indirect": "CELL_SHARED", "temporal_reuse": False},
}


@dataclass(frozen=True)
class Job:
    """What to build and how to render it: arguments of `room`, settings that all systems share, and their names."""

    scene: dict[str, int]
    settings: dict[str, int]
    systems: list[str]
    samples: list[int]  # few, many
    repeats: int


@dataclass(frozen=True)
class Cost:
    """Of the difference between many samples and few, for each sample and pixel."""

    microseconds: float  # of CPU time, all threads; median of the repeats
    wall_microseconds: float  # shortest of many less shortest of few: what else the machine does only makes it longer
    memory_bytes: int  # by the core's own count, at the end


def measure(job: Job) -> dict[str, Cost]:
    """Inside the process. Raises RuntimeError when a render fails."""
    import cistern_core as core

    from tests.benchmark.scaling.scenes import room

    scene = room(**job.scene)

    def spend(system: str, samples: int) -> tuple[float, float, int]:
        members = {"light_sampling": "TREE", "max_bounces": MAX_BOUNCES} | job.settings | SYSTEMS[system]
        members["light_sampling"] = core.LightSampling[members["light_sampling"]]
        session = core.Session(core.Settings(**members, samples=samples))
        cpu, wall = cpu_seconds(), time.monotonic()
        session.start(scene)
        progress = session.wait(float(PROCESS_SECONDS))
        spent = cpu_seconds() - cpu, time.monotonic() - wall
        if progress.status is not core.Status.DONE or progress.non_finite_samples:
            raise RuntimeError(f"{system}: {progress.status.name} {progress.error}")
        return *spent, progress.memory_bytes

    runs: dict[str, list[list[tuple[float, float, int]]]] = {system: [] for system in job.systems}
    for _ in range(job.repeats):
        for system, found in runs.items():
            found.append([spend(system, samples) for samples in job.samples])
    unit = 1e-6 * (job.samples[1] - job.samples[0]) * job.settings["width"] * job.settings["height"]
    return {system: cost(found, unit) for system, found in runs.items()}


def cost(runs: list[list[tuple[float, float, int]]], unit: float) -> Cost:
    cpu = statistics.median(many[0] - few[0] for few, many in runs)
    wall = min(many[1] for _, many in runs) - min(few[1] for few, _ in runs)
    return Cost(cpu / unit, wall / unit, runs[-1][1][2])


def cpu_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def run(job: Job) -> dict[str, Cost]:
    """In a new process; ends the command with its words when that fails."""
    command = [sys.executable, "-m", "tests.benchmark.scaling.measure", json.dumps(asdict(job))]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PROCESS_SECONDS, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith("@@")]
    if not lines:
        raise SystemExit(f"{job.scene} failed:\n{done.stdout[-1000:]}{done.stderr[-2000:]}")
    return {system: Cost(**numbers) for system, numbers in json.loads(lines[-1][2:]).items()}


def main() -> None:
    found = measure(Job(**json.loads(sys.argv[1])))
    print("@@" + json.dumps({system: asdict(numbers) for system, numbers in found.items()}), flush=True)


if __name__ == "__main__":
    main()
