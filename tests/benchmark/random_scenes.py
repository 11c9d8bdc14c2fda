"""Whether the unbiased techniques agree with path tracing on scenes made by chance.

  python -m tests.benchmark.random_scenes [--first 0] [--count 20]

Blocks of small pictures of each scene are compared over seeds by t-tests with a false-alarm rate of 0.1 % for a scene
and technique. What differs is rendered again, four times as often and with other seeds, and reported where it differs
again: one alarm in a million. Where paths that matter are rare the test itself errs, as means of few are no normal
numbers: then the reported t is just beyond its level. RESTIR_DI_FAST is there to be seen differing.
"""

from __future__ import annotations

import argparse
import atexit
import random
from collections.abc import Callable

from numpy.typing import NDArray

from tests.support.blender_folder import use_own_folder

use_own_folder()

import bpy  # noqa: E402

import addon  # noqa: E402
from tests.support import random_scenes  # noqa: E402
from tests.support.engines import prepare, replicas  # noqa: E402
from tests.support.statistics import Comparison, compare_replicas  # noqa: E402

WIDTH, HEIGHT, BLOCKS = 40, 32, 4
FALSE_ALARM_RATE = 0.001
SAMPLES_OF_REFERENCE, SAMPLES = 24, 12
REPLICAS, AGAIN = 12, 4
SAMPLES_FOR_CAUSTICS = 64  # with fewer a picture this small has no guide towards caustics
SHARED = {"indirect": "CELL_SHARED", "use_share_trial": False}
TOWARDS_CAUSTICS = {"use_caustic_guide": True}
OURS: dict[str, dict[str, object]] = {
    "Final, always shared and guided": {"preset": "FINAL", "use_share_trial": False, "guiding": "ON"},
    "learned lights": {"preset": "CUSTOM", "direct": "LEARNED", "secondary": "LEARNED", **SHARED},
    "path tracing, guided": {"preset": "PATH_TRACING", "guiding": "ON"},
    "path tracing, guided towards caustics": {"preset": "PATH_TRACING", **TOWARDS_CAUSTICS},
    "Final, guided towards caustics": {"preset": "FINAL", "use_share_trial": False, **TOWARDS_CAUSTICS},
}
PRESETS = ("INTERACTIVE", "RIS", "RESTIR_DI", "CELL_CACHE_UNBIASED", "CELL_RESERVOIRS", "RESTIR_GI", "WORLD_PATHS")
PLANTED = "RESTIR_DI_FAST"
TECHNIQUES = OURS | {name: {"preset": name} for name in (*PRESETS, PLANTED)}
ANSWERS = ("direct", "secondary", "indirect", "guiding", "bias", "use_share_trial", "use_caustic_guide")


def choose(scene: bpy.types.Scene, settings: dict[str, object]) -> None:
    for name in ANSWERS:
        scene.cistern.property_unset(name)
    for name, value in settings.items():
        setattr(scene.cistern, name, value)


def compare(scene: bpy.types.Scene, settings: dict[str, object], reference: Callable[[int], NDArray]) -> Comparison:
    """With path tracing; twice where they differ."""
    for factor, seed in ((1, 5000), (AGAIN, 60000)):
        choose(scene, settings)
        samples = SAMPLES_FOR_CAUSTICS if settings.keys() & TOWARDS_CAUSTICS.keys() else SAMPLES
        ours = replicas(scene, "CISTERN", factor * REPLICAS, samples, BLOCKS, seed)
        found = compare_replicas(ours, reference(factor), FALSE_ALARM_RATE)
        if found.agrees:
            break
    return found


def look_at(number: int) -> list[str]:
    """Builds a scene; says what differs in it."""
    scene = random_scenes.build(number)
    prepare(scene, WIDTH, HEIGHT, bounces=random.Random(number).choice((2, 4, 8, 12)))
    references: dict[int, NDArray] = {}

    def reference(factor: int) -> NDArray:
        if factor not in references:
            choose(scene, {"preset": "PATH_TRACING"})
            references[factor] = replicas(
                scene, "CISTERN", factor * REPLICAS, SAMPLES_OF_REFERENCE, BLOCKS, 1000 * factor
            )
        return references[factor]

    found = {name: compare(scene, settings, reference) for name, settings in TECHNIQUES.items()}
    return [f"{name}: {comparison}" for name, comparison in found.items() if not comparison.agrees]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--count", type=int, default=20)
    arguments = parser.parse_args()
    addon.register()
    atexit.register(addon.unregister)
    for number in range(arguments.first, arguments.first + arguments.count):
        print(f"@@ scene {number}: {'; '.join(look_at(number)) or 'all agree'}", flush=True)


if __name__ == "__main__":
    main()
