"""Light profiles of luminaires against Cycles; method as in test_against_cycles_lights."""

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
import pytest

import addon
from tests.support import blender_scenes as build
from tests.support.engines import compare_with_cycles, prepare, render

pytestmark = pytest.mark.usefixtures("registered_addon")

mended_in_5_0 = pytest.mark.skipif(
    bpy.app.version < (5, 0, 0), reason="Cycles before 5.0 takes 0 for what lies beyond the first and last angle"
)


def profile(kind: int, around: Sequence[float], down: Sequence[float], seed: int = 1, tilt: str = "NONE") -> str:
    """A file of lively numbers."""
    rng = np.random.default_rng(seed)
    candela = rng.uniform(100.0, 1500.0, (len(around), len(down)))
    if kind == 1:  # straight down and straight up are one direction each
        candela[:, [0, -1]] = candela[:1, [0, -1]]
        if around[-1] == 360.0:
            candela[-1] = candela[0]
    tilts = "1\n2\n0 90\n1 1\n" if tilt == "INCLUDE" else ""
    numbers = [f"1 -1 0.5 {len(down)} {len(around)} {kind} 2 0.1 0.1 0", "1.1 1 60"]
    rows = [down, around, *candela]
    lines = [*numbers, *(" ".join(f"{x:.3f}" for x in row) for row in rows)]
    return f"IESNA:LM-63-2002\n[TEST] TILT of words\nTILT={tilt}\n{tilts}" + "\n".join(lines) + "\n"


DOWN = np.arange(0.0, 91.0, 15.0)
PROFILES = {
    "all around the same": profile(1, [0.0], np.arange(0.0, 181.0, 20.0)),
    "quarter": profile(1, np.arange(0.0, 91.0, 22.5), DOWN),
    "half": profile(1, np.arange(0.0, 181.0, 30.0), DOWN, tilt="INCLUDE"),
    "whole": profile(1, np.arange(0.0, 361.0, 45.0), DOWN),
    "whole but for the last": profile(1, np.arange(0.0, 360.0, 45.0), DOWN),
    "from 90 to 270": profile(1, np.arange(90.0, 271.0, 30.0), DOWN),
    "upwards": profile(1, [0.0], np.arange(90.0, 181.0, 15.0)),
    "flood light": profile(2, np.arange(-90.0, 91.0, 30.0), np.arange(-90.0, 91.0, 30.0)),
    "half a flood light": profile(2, np.arange(0.0, 91.0, 30.0), np.arange(0.0, 91.0, 30.0)),
}


def add_luminaire(scene: bpy.types.Scene, text: str, kind: str = "POINT", **members: object) -> bpy.types.Object:
    """Above the floor, turned; its node reads a text of this file."""
    build.add_floor(scene)
    build.add_camera(scene)
    lamp = build.add_light(scene, kind, (0.3, -0.2, 1.2), (0.2, 0.3, 0.5), energy=20.0, **members)
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    node = tree.nodes.new("ShaderNodeTexIES")
    node.ies = bpy.data.texts.new("luminaire")
    node.ies.write(text)
    node.inputs["Strength"].default_value = 0.3
    tree.links.new(node.outputs[0], emission.inputs["Strength"])
    return lamp


def node_of(lamp: bpy.types.Object) -> bpy.types.Node:
    return next(n for n in lamp.data.node_tree.nodes if n.type == "TEX_IES")


@mended_in_5_0
@pytest.mark.parametrize("case", PROFILES)
def test_profiles(empty_scene: bpy.types.Scene, case: str) -> None:
    add_luminaire(empty_scene, PROFILES[case], shadow_soft_size=0.0)
    if case == "upwards":
        empty_scene.objects["point"].rotation_euler = (3.0, 0.1, 0.0)
    result = compare_with_cycles(empty_scene, floor=0.002)
    assert result.agrees, result


LAMPS = {"POINT": {"shadow_soft_size": 0.3}, "SPOT": {"shadow_soft_size": 0.1}, "AREA": {"size": 0.6}, "SUN": {}}


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=[mended_in_5_0] if kind in {"POINT", "AREA"} else []) for kind in LAMPS]
)
def test_other_lamps(empty_scene: bpy.types.Scene, kind: str) -> None:
    lamp = add_luminaire(empty_scene, PROFILES["whole"], kind, **LAMPS[kind])
    if kind == "SUN":
        lamp.data.energy = 1.0
    result = compare_with_cycles(empty_scene, floor=0.002)
    assert result.agrees, result


@mended_in_5_0
@pytest.mark.parametrize("kind", ["POINT", "AREA"])
def test_unevenly_scaled_lamps(empty_scene: bpy.types.Scene, kind: str) -> None:
    lamp = add_luminaire(empty_scene, PROFILES["whole"], kind, **LAMPS[kind])
    lamp.scale = (1.5, 0.7, 1.2)
    result = compare_with_cycles(empty_scene, floor=0.002)
    assert result.agrees, result


def test_another_scale_is_seen(empty_scene: bpy.types.Scene) -> None:
    lamp = add_luminaire(empty_scene, PROFILES["whole"], shadow_soft_size=0.0)
    lamp.scale = (1.5, 0.7, 1.2)

    def plant(_scene: bpy.types.Scene) -> None:
        lamp.scale = (1.5, 0.9, 1.2)

    assert not compare_with_cycles(empty_scene, samples=48, floor=0.002, plant=plant).agrees


def test_files(empty_scene: bpy.types.Scene, tmp_path: Path) -> None:
    lamp = add_luminaire(empty_scene, PROFILES["half"], shadow_soft_size=0.0)
    prepare(empty_scene, 24, 24)
    from_text = render(empty_scene, "CISTERN", 4, 1)
    (tmp_path / "luminaire.ies").write_text(PROFILES["half"].replace("\n", "\r\n"))
    node_of(lamp).mode = "EXTERNAL"
    node_of(lamp).filepath = str(tmp_path / "luminaire.ies")
    np.testing.assert_array_equal(render(empty_scene, "CISTERN", 4, 1), from_text)


def test_a_turned_profile_is_seen(empty_scene: bpy.types.Scene) -> None:
    lamp = add_luminaire(empty_scene, PROFILES["whole"], shadow_soft_size=0.0)

    def plant(_scene: bpy.types.Scene) -> None:
        lamp.rotation_euler.rotate_axis("Z", 0.1)

    assert not compare_with_cycles(empty_scene, samples=48, floor=0.002, plant=plant).agrees


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no line TILT="),
        (profile(1, [0.0], DOWN)[:-30], "ends too early"),
        (profile(4, [0.0], DOWN), "photometric type is 4"),
        (profile(1, [0.0], [90.0, 45.0, 0.0]), "do not increase"),
        (profile(1, [10.0], DOWN), "do not begin at 0 or 90"),
        (profile(1, [0.0, 100.0], DOWN), "ends at 100 degrees"),
        (profile(1, [0.0], DOWN).replace("0.100", "wide", 1).replace("0.1 0.1", "wide 0.1"), "'wide' is not a number"),
    ],
)
def test_broken_profiles_are_named_and_glare(empty_scene: bpy.types.Scene, text: str, reason: str) -> None:
    add_luminaire(empty_scene, text, shadow_soft_size=0.0)
    prepare(empty_scene, 16, 16)
    assert render(empty_scene, "CISTERN", 4, 1)[..., :3].max() > 1.0
    (warning,) = addon.report.last[-1].warnings
    assert "Light 'point'" in warning and reason in warning


def test_files_beside_a_library(empty_scene: bpy.types.Scene, tmp_path: Path) -> None:
    """Paths that begin with // count from the file that the lamp is linked from."""
    lamp = add_luminaire(empty_scene, PROFILES["half"], shadow_soft_size=0.0)
    node_of(lamp).mode, node_of(lamp).filepath = "EXTERNAL", "//luminaire.ies"
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "luminaire.ies").write_text(PROFILES["half"])
    library = str(tmp_path / "library" / "lamps.blend")
    bpy.data.libraries.write(library, {lamp})
    bpy.data.objects.remove(lamp)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"), check_existing=False)
    with bpy.data.libraries.load(library, link=True) as (there, here):
        here.objects = there.objects
    bpy.context.scene.collection.objects.link(here.objects[0])
    prepare(bpy.context.scene, 16, 16)
    render(bpy.context.scene, "CISTERN", 4, 1)
    assert not addon.report.last[-1].warnings


def test_files_beside_the_library_of_a_group(empty_scene: bpy.types.Scene, tmp_path: Path) -> None:
    """Of a lamp that is not linked, by a node of a group that is."""
    group = bpy.data.node_groups.new("Luminaire", "ShaderNodeTree")
    group.interface.new_socket("Fac", in_out="OUTPUT", socket_type="NodeSocketFloat")
    node = group.nodes.new("ShaderNodeTexIES")
    node.mode, node.filepath = "EXTERNAL", "//luminaire.ies"
    group.links.new(node.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "luminaire.ies").write_text(PROFILES["half"])
    library = str(tmp_path / "library" / "groups.blend")
    bpy.data.libraries.write(library, {group})
    bpy.data.node_groups.remove(group)
    lamp = add_luminaire(empty_scene, PROFILES["half"], shadow_soft_size=0.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"), check_existing=False)
    with bpy.data.libraries.load(library, link=True) as (there, here):
        here.node_groups = there.node_groups
    tree = lamp.data.node_tree
    use = tree.nodes.new("ShaderNodeGroup")
    use.node_tree = here.node_groups[0]
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    tree.links.new(use.outputs[0], emission.inputs["Strength"])
    prepare(bpy.context.scene, 16, 16)
    render(bpy.context.scene, "CISTERN", 4, 1)
    assert not addon.report.last[-1].warnings
