"""Techniques, presets and the papers' parameters on their way to the core."""

import ast
import re

import bpy
import pytest

from addon import techniques
from addon.settings import technique_arguments, techniques_in_force, viewport_settings
from tests.blender.engine_fakes import fresh_scene, install, render
from tests.blender.fake_core import STUB

pytestmark = pytest.mark.usefixtures("registered_addon")


@pytest.fixture
def core(monkeypatch):
    return install(monkeypatch)


def rendered_settings(core, scene, folder):
    render(scene, folder)
    return vars(core.settings[-1])


def path_traced_scene():
    scene = fresh_scene()
    scene.cistern.preset = "PATH_TRACING"
    return scene


def test_path_tracing_asks_for_no_reuse(core, tmp_path):
    settings = rendered_settings(core, path_traced_scene(), tmp_path)
    assert (settings["direct"], settings["secondary"], settings["indirect"]) == ("NEE", "NEE", "PATH")
    given = {parameter.core_name for parameter in techniques.PARAMETERS} & set(settings)
    assert given == {"light_samples", "caustic_guide"}
    assert (settings["light_samples"], settings["caustic_guide"]) == (0, False)  # the first: one


def test_bounces_are_guided_to_caustics_in_final_renders_by_final(core, tmp_path):
    assert rendered_settings(core, fresh_scene(), tmp_path)["caustic_guide"]
    assert not viewport_settings(core, fresh_scene())["caustic_guide"]


@pytest.mark.parametrize("direct", ["RIS", "RESTIR", "RESTIR_CACHE"])
def test_parameters_of_the_system_reach_the_core(core, tmp_path, direct):
    scene = path_traced_scene()
    scene.cistern.direct, scene.cistern.bias, scene.cistern.use_temporal_reuse = direct, "FAST", True
    scene.cistern.light_candidates, scene.cistern.spatial_radius = 17, 2.5
    settings = rendered_settings(core, scene, tmp_path)
    assert (settings["direct"], settings["bias"], settings["light_candidates"]) == (direct, "FAST", 17)
    given = {parameter.core_name for parameter in techniques.PARAMETERS} & set(settings)
    assert given == {parameter.core_name for parameter in techniques.PARAMETERS if direct in parameter.defaults}
    if direct != "RIS":
        assert (settings["spatial_radius"], settings["temporal_reuse"], settings["confidence_cap"]) == (2.5, True, 0)


@pytest.mark.parametrize(
    ("question", "answer", "switches"),
    [
        ("secondary", "RIS", set()),
        ("secondary", "CELL_RESERVOIRS", {"temporal_reuse"}),
        ("indirect", "SCREEN_REUSE", {"temporal_reuse", "path_spatial_reuse"}),
        ("indirect", "WORLD_REUSE", {"temporal_reuse", "path_spatial_reuse"}),
        (
            "indirect",
            "CELL_SHARED",
            {
                "temporal_reuse",
                "first_frame_history",
                "share_visible",
                "share_deep",
                "share_for_denoiser",
                "share_trial",
            },
        ),
    ],
)
def test_answers_about_later_points_reach_the_core_with_their_switches_alone(
    core, tmp_path, question, answer, switches
):
    scene = path_traced_scene()
    setattr(scene.cistern, question, answer)
    scene.cistern.bias, scene.cistern.use_path_spatial_reuse, scene.cistern.light_candidates = "FAST", False, 17
    settings = rendered_settings(core, scene, tmp_path)
    assert (settings[question], settings["bias"]) == (answer, "FAST")
    numbers = {"path_target", "path_source", "path_multi_bounce", "path_validation"}
    given = {parameter.core_name for parameter in techniques.PARAMETERS} & set(settings)
    assert given - numbers - {"light_samples", "caustic_guide"} == switches
    of_answer = {"SCREEN_REUSE": numbers, "WORLD_REUSE": {"path_target"}}
    assert given & numbers == of_answer.get(answer, set())
    assert not any(settings[name] for name in switches - {"share_trial"})  # the preset keeps no history
    assert ("cell_pixels" in settings) == (answer in {"CELL_RESERVOIRS", "WORLD_REUSE"})


def test_answers_are_those_of_the_core():
    """The comments of the contract list them."""
    for question, items in (
        ("direct", techniques.DIRECT_ITEMS),
        ("secondary", techniques.SECONDARY_ITEMS),
        ("indirect", techniques.INDIRECT_ITEMS),
        ("guiding", techniques.GUIDING_ITEMS),
        ("bias", techniques.BIAS_ITEMS),
    ):
        listed = re.search(rf"^    {question}: str  # (.+)$", STUB.read_text(), re.MULTILINE)
        assert listed and re.findall(r"\w+", listed[1]) == [identifier for identifier, _, _ in items]


@pytest.mark.parametrize("guiding", ["OFF", "ON", "AUTO"])
def test_guiding_reaches_the_core_where_it_is_wanted(core, tmp_path, guiding):
    scene = path_traced_scene()
    scene.cistern.guiding = guiding
    assert rendered_settings(core, scene, tmp_path).get("guiding", "OFF") == guiding


def test_icons_reuse_nothing(core):
    scene = fresh_scene()
    scene.cistern.guiding = "ON"
    scene.cistern.direct, scene.cistern.secondary, scene.cistern.indirect = "RESTIR", "CELL_RESERVOIRS", "WORLD_REUSE"
    arguments = technique_arguments(techniques_in_force(scene, scene.view_layers[0], is_preview=True), core)
    assert set(arguments) == {"direct", "secondary", "indirect", "light_sampling", "light_samples", "caustic_guide"}
    assert not arguments["caustic_guide"]
    assert (arguments["direct"], arguments["secondary"], arguments["indirect"]) == ("NEE", "NEE", "PATH")


@pytest.mark.parametrize("shown", ["use_pass_cells", "use_pass_cell_occupancy", "view"])
def test_cells_reach_the_core_whatever_the_system(core, tmp_path, shown):
    scene = fresh_scene()
    assert "cell_pixels" not in rendered_settings(core, scene, tmp_path)
    if shown == "view":
        scene.cistern.view = "CELLS"
    else:
        setattr(scene.view_layers[0].cistern, shown, True)
    scene.cistern.cell_pixels, scene.cistern.min_cell_size, scene.cistern.use_normal_cells = 40.0, 0.25, False
    settings = rendered_settings(core, scene, tmp_path)
    assert (settings["cell_pixels"], settings["min_cell_size"], settings["normal_cells"]) == (40.0, 0.25, False)


def test_all_names_are_in_the_contract_of_the_core(core, tmp_path):
    classes = (node for node in ast.parse(STUB.read_text()).body if isinstance(node, ast.ClassDef))
    members = next(node for node in classes if node.name == "Settings").body
    contract = {node.target.id for node in members if isinstance(node, ast.AnnAssign)}
    scene = fresh_scene()
    scene.cistern.direct, scene.cistern.secondary, scene.cistern.indirect = (
        "RESTIR_CACHE",
        "CELL_RESERVOIRS",
        "WORLD_REUSE",
    )
    assert set(rendered_settings(core, scene, tmp_path)) <= contract


def test_final_does_without_history_and_the_papers_presets_do_not(core, tmp_path):
    scene = fresh_scene()
    scene.cistern.direct = "RESTIR"
    assert rendered_settings(core, scene, tmp_path)["temporal_reuse"] is False
    bpy.ops.cistern.choose_preset(preset="RESTIR_DI")
    assert rendered_settings(core, scene, tmp_path)["temporal_reuse"] is True


@pytest.mark.parametrize(
    ("preset", "direct", "bias", "sampler"),
    [
        ("FINAL", "NEE", "UNBIASED", "TREE"),
        ("INTERACTIVE", "NEE", "UNBIASED", "TREE"),
        ("PATH_TRACING", "NEE", "UNBIASED", "TREE"),
        ("RIS", "RIS", "UNBIASED", "POWER"),
        ("RESTIR_DI", "RESTIR", "UNBIASED", "POWER"),
        ("RESTIR_DI_FAST", "RESTIR", "FAST", "POWER"),
        ("CELL_CACHE", "RESTIR_CACHE", "FAST", "UNIFORM"),
        ("CELL_CACHE_UNBIASED", "RESTIR_CACHE", "UNBIASED", "POWER"),
    ],
)
def test_presets_by_paper(core, tmp_path, preset, direct, bias, sampler):
    scene = fresh_scene()
    bpy.ops.cistern.choose_preset(preset=preset)
    settings = rendered_settings(core, scene, tmp_path)
    assert (settings["direct"], settings.get("bias", "UNBIASED"), settings["light_sampling"].name) == (
        direct,
        bias,
        sampler,
    )


@pytest.mark.parametrize(
    ("preset", "secondary", "indirect"),
    [
        ("CELL_RESERVOIRS", "CELL_RESERVOIRS", "PATH"),
        ("RESTIR_GI", "NEE", "SCREEN_REUSE"),
        ("WORLD_PATHS", "NEE", "WORLD_REUSE"),
    ],
)
def test_presets_by_papers_on_indirect_light(core, tmp_path, preset, secondary, indirect):
    scene = fresh_scene()
    bpy.ops.cistern.choose_preset(preset=preset)
    settings = rendered_settings(core, scene, tmp_path)
    assert (settings["direct"], settings["secondary"], settings["indirect"]) == ("NEE", secondary, indirect)
    assert (settings.get("bias", "UNBIASED"), settings["light_sampling"].name) == ("UNBIASED", "TREE")
    assert settings.get("temporal_reuse", True) and settings.get("path_spatial_reuse", True)


def test_own_presets(core, tmp_path):
    fresh_scene()
    for preset, answers, has_history in (
        ("FINAL", ("NEE", "NEE", "CELL_SHARED"), False),
        ("INTERACTIVE", ("NEE", "NEE", "CELL_SHARED"), True),
    ):
        bpy.ops.cistern.choose_preset(preset=preset)
        settings = rendered_settings(core, bpy.context.scene, tmp_path)
        assert (settings["direct"], settings["secondary"], settings["indirect"]) == answers
        assert settings["temporal_reuse"] is settings["first_frame_history"] is has_history
        assert settings["bias"] == "UNBIASED"


def test_the_printed_preset_of_ouyang(core, tmp_path):
    scene = fresh_scene()
    bpy.ops.cistern.choose_preset(preset="RESTIR_GI_FAST")
    settings = rendered_settings(core, scene, tmp_path)
    assert (settings["indirect"], settings["bias"], settings["path_source"]) == ("SCREEN_REUSE", "FAST", "UNIFORM")
    assert (settings["path_validation"], settings["path_target"]) == (6, "REFLECTED")
    assert settings["path_multi_bounce"] == pytest.approx(0.25)


def test_custom_starts_from_the_preset_and_a_preset_forgets_it():
    settings = fresh_scene().cistern
    bpy.ops.cistern.choose_preset(preset="CELL_CACHE")
    before = techniques.settings_in_force(settings)
    bpy.ops.cistern.choose_preset(preset="CUSTOM")
    assert techniques.settings_in_force(settings) == before
    settings.light_candidates = 3
    bpy.ops.cistern.choose_preset(preset="FINAL")
    assert techniques.settings_in_force(settings)["light_candidates"] == 0


def test_values_outside_the_range_are_held_at_its_ends():
    settings = fresh_scene().cistern
    for name in [parameter.name for parameter in (*techniques.PARAMETERS, *techniques.CELL_PARAMETERS)]:
        prop = settings.bl_rna.properties[name]
        if prop.type not in {"INT", "FLOAT"}:
            continue
        setattr(settings, name, -1)
        assert getattr(settings, name) == 0
        setattr(settings, name, 2**24)
        assert getattr(settings, name) == prop.hard_max


@pytest.mark.parametrize("name", ["direct", "secondary", "indirect", "bias", "view", "preset"])
def test_unknown_answers_are_refused(name):
    with pytest.raises(TypeError, match="MAGIC"):
        setattr(fresh_scene().cistern, name, "MAGIC")
