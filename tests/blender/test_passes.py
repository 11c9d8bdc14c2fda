"""Passes by name: in the file, in the compositor, and only where they were asked for."""

import bpy
import numpy as np
import pytest

from addon import passes
from tests.blender.engine_fakes import CONSTANTS, fresh_scene, install, read_channels, render

pytestmark = pytest.mark.usefixtures("registered_addon")


@pytest.fixture
def core(monkeypatch):
    return install(monkeypatch)


# Not there, or others, once light is asked for by kinds of scattering; or read by denoising alone.
WITHOUT_KINDS = {"Emission", "Environment", "Emission Noise"}


def enable_kinds(view_layer):
    for kind in ("diffuse", "glossy", "transmission"):
        for part in ("direct", "indirect", "color"):
            setattr(view_layer, f"use_pass_{kind}_{part}", True)


def enable_all(view_layer):
    enable_kinds(view_layer)
    for name in (
        "z",
        "mist",
        "normal",
        "position",
        "vector",
        "uv",
        "object_index",
        "material_index",
        "emit",
        "environment",
        "ambient_occlusion",
    ):
        setattr(view_layer, f"use_pass_{name}", True)
    for prop in view_layer.cistern.bl_rna.properties:
        if prop.identifier.startswith("use_pass_"):
            setattr(view_layer.cistern, prop.identifier, True)


def blender_names():
    return {render_pass.core_name: render_pass.name for render_pass in passes.PASSES + passes.KIND_PASSES}


def test_names_are_those_of_this_blender():
    names = blender_names()
    long_names = bpy.app.version >= (5, 0, 0)
    assert names["Emission"] == ("Emission" if long_names else "Emit")
    assert names["Environment"] == ("Environment" if long_names else "Env")
    assert names["Diffuse Direct"] == ("Diffuse Direct" if long_names else "DiffDir")
    assert names["Glossy Indirect"] == ("Glossy Indirect" if long_names else "GlossInd")
    assert names["Transmission Color"] == ("Transmission Color" if long_names else "TransCol")
    assert names["Volume Direct"] == ("Volume Direct" if long_names else "VolumeDir")


@pytest.mark.parametrize("switch", ["use_pass_diffuse_direct", "use_pass_transmission_color", "use_pass_volume_direct"])
def test_emission_beside_kinds_is_what_nothing_scattered(core, tmp_path, switch):
    scene = fresh_scene()
    layer = scene.view_layers[0]
    layer.use_pass_emit = layer.use_pass_environment = True
    render(scene, tmp_path)
    assert {"Emission", "Environment"} <= set(core.settings[-1].passes)
    setattr(layer.cistern if "volume" in switch else layer, switch, True)
    channels, _ = render(scene, tmp_path)
    asked = set(core.settings[-1].passes)
    assert {"Unscattered Emission", "Unscattered Environment"} <= asked and not asked & WITHOUT_KINDS
    np.testing.assert_array_equal(channels[f"ViewLayer.{blender_names()['Emission']}.G"], np.float32(2.5))


def test_direct_and_indirect_are_there_unless_switched_off(core, tmp_path):
    scene = fresh_scene()
    channels, _ = render(scene, tmp_path)
    assert {name.split(".")[1] for name in channels} == {"Combined", "Direct", "Indirect"}
    scene.view_layers[0].cistern.use_pass_indirect = False
    channels, _ = render(scene, tmp_path)
    assert {name.split(".")[1] for name in channels} == {"Combined", "Direct"}
    assert core.settings[-1].passes == ["Direct"]


def test_all_passes_arrive_in_the_file_with_their_values(core, tmp_path):
    scene = fresh_scene()
    enable_all(scene.view_layers[0])
    channels, _ = render(scene, tmp_path)
    enabled = passes.enabled_passes(scene.view_layers[0])
    by_core_name = {render_pass.core_name: render_pass for render_pass in enabled}
    assert {name.split(".")[1] for name in channels} == set(blender_names().values())
    for core_name in CONSTANTS.keys() - WITHOUT_KINDS:
        render_pass, values = by_core_name[core_name], CONSTANTS[core_name]
        ids = render_pass.channel_ids
        if len(ids) == 1:
            ids = next(name.split(".")[2] for name in channels if name.split(".")[1] == render_pass.name)
        for channel, value in zip(ids, values, strict=True):
            np.testing.assert_array_equal(channels[f"ViewLayer.{render_pass.name}.{channel}"], np.float32(value))


def compositor_tree(scene):
    """An empty compositor tree and the node whose first input is the picture."""
    if hasattr(scene, "compositing_node_group"):
        tree = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        scene.compositing_node_group = tree
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        return tree, tree.nodes.new("NodeGroupOutput")
    scene.use_nodes = True
    scene.node_tree.nodes.clear()
    return scene.node_tree, scene.node_tree.nodes.new("CompositorNodeComposite")


def composite(core_name, folder):
    """Channels of the picture that the compositor makes of one pass alone."""
    scene = fresh_scene()
    enable_all(scene.view_layers[0])
    tree, output = compositor_tree(scene)
    source = tree.nodes.new("CompositorNodeRLayers")
    source.scene = scene
    tree.links.new(source.outputs[blender_names()[core_name]], output.inputs[0])
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.filepath = str(folder / "composite.exr")
    bpy.ops.render.render(write_still=True)
    return read_channels(folder / "composite.exr")


@pytest.mark.parametrize("core_name", ["Direct", "Denoising Albedo", "Cells", "Glossy Direct", "Volume Indirect"])
def test_pass_goes_through_the_compositor(core, tmp_path, core_name):
    channels = composite(core_name, tmp_path)
    for channel, value in zip("RGB", CONSTANTS[core_name], strict=True):
        np.testing.assert_allclose(channels[channel], value, rtol=1e-6)


@pytest.mark.parametrize(
    "core_name",
    [
        "Cell Occupancy",
        "Reservoir Confidence",
        "Reservoir Weight",
        "Reuse Count",
        "Light Choice Entropy",
        "Sample Count",
    ],
)
def test_numbers_of_reuse_go_through_the_compositor(core, tmp_path, core_name):
    channels = composite(core_name, tmp_path)
    np.testing.assert_allclose(channels["R"], CONSTANTS[core_name][0], rtol=1e-6)


def test_wrong_number_of_channels_is_refused():
    with pytest.raises(ValueError, match="Combined"):
        passes.flat_pixels(passes.PASSES[0], np.zeros((2, 2, 3), np.float32))
