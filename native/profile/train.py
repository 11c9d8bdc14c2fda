"""Makes core.profdata anew: `python native/profile/train.py`, with a Python that has bpy and pytest.

Compiles the core so that it counts how often each piece of its code runs, has it render scenes and go through some of
the tests, and merges the counts. Takes ten to twenty minutes on two cores, and Clang 19 with its tools and run-time
library (`apt-get install clang-19 llvm-19 libclang-rt-19-dev`). The scenes of the README's table of speed are not among
those it renders, so that what is gained there is what a user's own scenes gain.
"""

from __future__ import annotations

import argparse
import atexit
import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parents[1]
BUILD = ROOT / "build" / "profile"
COUNTS = BUILD / "counts"
PROCESS_SECONDS = 3600

# Modules of examples/ with a function `build(scene)`.
EXAMPLES = ("bright_interior", "city_grid", "door_ajar", "far_lamp", "glossy_hall", "market", "outdoor")
# Samples per pixel of each example, at this many pixels.
PICTURE = (160, 90)
PRESETS = {"PATH_TRACING": 24, "FINAL": 16, "INTERACTIVE": 4}
PAPERS = {"RESTIR_DI": 2, "CELL_CACHE": 2, "CELL_RESERVOIRS": 2, "RESTIR_GI": 2, "WORLD_PATHS": 2}
EVERYDAY_SAMPLES = 48
# What scenes do not reach: history, guides, volumes, hair, textures, displacement.
TESTS = {
    "tests/render/test_": "draft_history guiding history images learned_lights ray_nodes touching_media volumes",
    "tests/blender/test_against_cycles_": "displacement generated hair hair_shaders materials ray_nodes sky subsurface "
    "textures thin_film volume_objects volumes",
}


def render_example(name: str) -> None:
    from tests.support.engines import prepare, render

    sys.path.insert(0, str(ROOT / "examples"))
    scene = importlib.import_module("scene_tools").empty_scene()
    importlib.import_module(name).build(scene)
    prepare(scene, *PICTURE, bounces=12)
    for preset, samples in (PRESETS | (PAPERS if name == "market" else {})).items():
        scene.cistern.preset = preset
        render(scene, "CISTERN", samples, seed=1)


def render_everyday() -> None:
    import bpy

    from tests.benchmark.everyday.scenes import SCENES
    from tests.support.engines import prepare, render

    for build in SCENES.values():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        build()
        prepare(bpy.context.scene, *PICTURE, bounces=12)
        render(bpy.context.scene, "CISTERN", EVERYDAY_SAMPLES, seed=1)


def render_in_process(name: str) -> None:
    """Inside a process of its own: an example, or `everyday`."""
    sys.path.insert(0, str(ROOT))
    from tests.support.blender_folder import use_own_folder

    use_own_folder()
    import addon

    addon.register()
    atexit.register(addon.unregister)
    if name == "everyday":
        render_everyday()
    else:
        render_example(name)


def run(*command: str, **environment: str) -> None:
    print(" ".join(command), flush=True)
    subprocess.run(command, check=True, cwd=ROOT, timeout=PROCESS_SECONDS, env=os.environ | environment)


def compile_counting() -> None:
    pybind11 = subprocess.run(
        [sys.executable, "-m", "pybind11", "--cmakedir"], check=True, capture_output=True, text=True
    ).stdout.strip()
    defines = (
        "CMAKE_CXX_COMPILER=clang++-19",
        "CMAKE_BUILD_TYPE=Release",
        "CISTERN_PROFILE=TRAIN",
        "CISTERN_BUILD_TESTS=OFF",
        "CISTERN_BUILD_BINDING=ON",
        f"Python_EXECUTABLE={sys.executable}",
        f"pybind11_DIR={pybind11}",
    )
    run("cmake", "-G", "Ninja", "-S", str(ROOT), "-B", str(BUILD), *(f"-D{define}" for define in defines))
    run("cmake", "--build", str(BUILD))


def train() -> None:
    compile_counting()
    shutil.rmtree(COUNTS, ignore_errors=True)
    COUNTS.mkdir(parents=True)
    counting = {"PYTHONPATH": str(BUILD), "LLVM_PROFILE_FILE": str(COUNTS / "%p.profraw")}
    for name in ("everyday", *EXAMPLES):
        run(sys.executable, __file__, "--render", name, **counting)
    tests = [f"{beginning}{name}.py" for beginning, names in TESTS.items() for name in names.split()]
    run(sys.executable, "-m", "pytest", "-q", *tests, **counting)
    counts = sorted(str(file) for file in COUNTS.glob("*.profraw"))
    # Functions that never ran are left out, so that they are compiled as ever, and not for size.
    run("llvm-profdata-19", "merge", "--sparse", "-o", str(FOLDER / "core.profdata"), *counts)


def main() -> None:
    parser = argparse.ArgumentParser(description="Count which code of the core runs often, for the compiler.")
    parser.add_argument("--render", metavar="NAME", help=argparse.SUPPRESS)
    name = parser.parse_args().render
    if name:
        render_in_process(name)
    else:
        train()


if __name__ == "__main__":
    main()
