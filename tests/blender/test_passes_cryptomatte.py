"""Cryptomatte beside Cycles, in the same process and from the same scene, and in Blender's compositor."""

import json

import bpy
import numpy as np
import pytest

from tests.blender.test_passes import compositor_tree
from tests.support import pass_scenes
from tests.support.statistics import FALSE_ALARM_RATE, block_means, compare_replicas

pytestmark = pytest.mark.usefixtures("registered_addon")

KINDS = ("Object", "Material", "Asset")
NAMES = {
    "Object": ["Base", "Thin", "Above", "Thick", "Glass", "Hidden", "Alone", "Bare"],
    "Material": ["Solid", "Thin", "Thick", "glass", "Held out", "default_surface"],
    "Asset": ["Base", "Thick", "Glass", "Hidden", "Alone", "Bare"],
}


@pytest.fixture
def cards(empty_scene):
    def build(preset="PATH_TRACING"):
        pass_scenes.build_cards(empty_scene)
        pass_scenes.prepare_layers(empty_scene, preset)
        layer = empty_scene.view_layers[0]
        for kind in KINDS:
            setattr(layer, f"use_pass_cryptomatte_{kind.lower()}", True)
        layer.pass_cryptomatte_depth = 4
        return empty_scene

    return build


def id_of(core, name):
    """Of a name, the float that stands for it."""
    bits = core.matte_hash(name)
    exponent = min(max(bits >> 23 & 255, 1), 254)
    return np.uint32(bits & 0x807FFFFF | exponent << 23).view(np.float32)


def slots(channels, kind, levels=2):
    """Ids and coverages (height, width, slots) of a layer."""
    names = [f"ViewLayer.Crypto{kind}{level:02}" for level in range(levels)]
    ids = [channels[f"{name}.{channel}"] for name in names for channel in "rb"]
    weights = [channels[f"{name}.{channel}"] for name in names for channel in "ga"]
    return np.stack(ids, axis=2), np.stack(weights, axis=2)


def ranked(ids, weights):
    """By coverage. Cycles 5.0 leaves Material and Asset in the order in which it found them."""
    order = np.argsort(-weights, axis=2, kind="stable")
    return np.take_along_axis(ids, order, axis=2), np.take_along_axis(weights, order, axis=2)


def coverages(channels, core, kind):
    """(height, width, names): how much of each pixel a name covers."""
    ids, weights = slots(channels, kind)
    return np.stack([(weights * (ids == id_of(core, name))).sum(axis=2) for name in NAMES[kind]], axis=2)


def replicas(scene, core, engine, count=6, samples=64):
    found = []
    for seed in range(1, 1 + count):
        channels, _ = pass_scenes.render_layers(scene, engine, samples, seed + (1000 if engine == "CYCLES" else 0))
        stacked = np.concatenate([coverages(channels, core, kind) for kind in KINDS], axis=2)
        found.append(block_means(stacked, 2, 12))
    return np.array(found)


def compare(scene, core, plant=None):
    """Of t-tests over blocks of the coverage of every name, with FALSE_ALARM_RATE altogether."""
    ours = replicas(scene, core, "CISTERN")
    if plant:
        plant(scene)
    return compare_replicas(ours, replicas(scene, core, "CYCLES"), FALSE_ALARM_RATE)


@pytest.mark.parametrize("preset", ["PATH_TRACING", "FINAL", "RESTIR_DI", "CELL_RESERVOIRS", "RESTIR_GI"])
def test_coverages_are_those_of_cycles(cards, built_core, preset):
    result = compare(cards(preset), built_core)
    assert result.agrees, result


@pytest.mark.parametrize("has_glass", [False, True])
def test_coverages_under_a_transparent_film(cards, built_core, has_glass):
    scene = cards()
    scene.render.film_transparent = True
    scene.cycles.film_transparent_glass = scene.cistern.film_transparent_glass = has_glass
    result = compare(scene, built_core)
    assert result.agrees, result


def rename_object(scene):
    bpy.data.objects["Thick"].name = "Sick"


def leave_parent(scene):
    bpy.data.objects["Thin"].parent = None


def thinner_card(scene):
    tree = bpy.data.materials["Thick"].node_tree
    next(node for node in tree.nodes if node.bl_idname == "ShaderNodeMixShader").inputs[0].default_value = 0.68


@pytest.mark.parametrize("plant", [rename_object, leave_parent, thinner_card])
def test_planted_differences_are_found(cards, built_core, plant):
    result = compare(cards(), built_core, plant)
    assert not result.agrees, result


def test_layers_are_those_of_cycles(cards):
    """Names of channels, metadata; coverages by rank within six standard errors of one of them, 4.2 of their difference
    (of 9216 numbers 1 in 4 renders would have one outside if all were noisy; of the 600 that are, 1 in 60), and ids
    wherever ranks are no matter of chance."""
    scene = cards()
    samples = 256
    theirs, their_metadata = pass_scenes.render_layers(scene, "CYCLES", samples)
    ours, metadata = pass_scenes.render_layers(scene, "CISTERN", samples)
    assert {name for name in ours if "Crypto" in name} == {name for name in theirs if "Crypto" in name}
    certain_slots = 0
    for kind in KINDS:
        ids, weights = ranked(*slots(theirs, kind))
        error = np.sqrt(0.25 / samples)
        gaps = -np.diff(np.pad(weights, ((0, 0), (0, 0), (1, 1)), constant_values=((0, 0), (0, 0), (2, -1))), axis=2)
        certain = (np.minimum(gaps[..., :-1], gaps[..., 1:]) > 6.0 * error) & (weights > 4.0 * error)
        certain_slots += certain.sum()
        our_ids, our_weights = slots(ours, kind)
        np.testing.assert_array_equal(our_ids[certain], ids[certain])
        assert np.abs(our_weights - weights).max() < 6.0 * error
        assert (np.diff(our_weights, axis=2) <= 0.0).all(), "ranked"
    assert certain_slots > 900
    for key, value in metadata.items():
        if not key.startswith("cryptomatte/"):
            continue
        if not key.endswith("/manifest"):
            assert value == their_metadata[key]
        else:  # Cycles lists lamps and shaders of its own as well
            manifest, their_manifest = json.loads(value), json.loads(their_metadata[key])
            assert manifest.items() <= their_manifest.items()
            kind = metadata[key.replace("manifest", "name")].removeprefix("ViewLayer.Crypto")
            assert set(NAMES[kind]) <= set(manifest)
    assert sum(key.endswith("/manifest") for key in metadata) == len(KINDS)


@pytest.mark.parametrize(("depth", "levels"), [(2, 1), (6, 3), (7, 4), (16, 8)])
def test_levels_are_those_of_cycles(cards, depth, levels):
    scene = cards()
    scene.view_layers[0].pass_cryptomatte_depth = depth
    scene.view_layers[0].use_pass_cryptomatte_asset = False
    names = []
    for engine in ("CISTERN", "CYCLES"):
        channels, _ = pass_scenes.render_layers(scene, engine, 1)
        names.append({name for name in channels if "Crypto" in name})
    assert names[0] == names[1] and len(names[0]) == 2 * levels * 4


def test_all_shares_add_up_where_slots_are_few(cards):
    """What finds no slot of its own goes to the last."""
    scene = cards()
    scene.view_layers[0].pass_cryptomatte_depth = 2
    channels, _ = pass_scenes.render_layers(scene, "CISTERN", 64)
    _, weights = slots(channels, "Object", levels=1)
    solid = weights.sum(axis=2)[4:12, 5:14]  # behind the thin cards: everything stops at the base
    np.testing.assert_allclose(solid.mean(), 1.0, atol=0.02)


def test_names_of_all_kinds_reach_the_manifest(cards):
    scene = cards()
    bpy.data.objects["Base"].name = 'Ä "quoted" \\ name'
    _, metadata = pass_scenes.render_layers(scene, "CISTERN", 1)
    manifests = [json.loads(value) for key, value in metadata.items() if key.endswith("/manifest")]
    assert sum('Ä "quoted" \\ name' in manifest for manifest in manifests) == 2


def test_mattes_are_the_same_with_any_number_of_threads(cards):
    one, three = pass_scenes.layers_by_threads(cards("FINAL"))
    for name in (name for name in one if "Crypto" in name):
        np.testing.assert_array_equal(one[name], three[name])


def compositor_matte(scene, engine, layer, names, folder):
    """What the Cryptomatte node makes of a render."""
    tree, output = compositor_tree(scene)
    node = tree.nodes.new("CompositorNodeCryptomatteV2")
    node.source, node.scene, node.layer_name, node.matte_id = "RENDER", scene, layer, names
    tree.links.new(node.outputs["Matte"], output.inputs[0])
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.use_compositing = True
    scene.render.engine = engine
    (scene.cycles if engine == "CYCLES" else scene.cistern).samples = 256
    scene.render.filepath = str(folder / f"{engine}.exr")
    bpy.ops.render.render(write_still=True)
    assert node.layer_name == layer and node.matte_id == names
    return pass_scenes.read_layers(scene.render.filepath)[0]["R"]


@pytest.mark.parametrize(
    ("layer", "names"),
    [
        ("ViewLayer.CryptoObject", "Thick,Above"),
        ("ViewLayer.CryptoMaterial", "Thin"),
        ("ViewLayer.CryptoAsset", "Base"),
    ],
)
def test_matte_of_the_compositor(cards, tmp_path, layer, names):
    scene = cards()
    ours = compositor_matte(scene, "CISTERN", layer, names, tmp_path)
    theirs = compositor_matte(scene, "CYCLES", layer, names, tmp_path)
    np.testing.assert_allclose(ours, theirs, atol=6.0 * np.sqrt(0.25 / 256))
    np.testing.assert_allclose(ours.mean(), theirs.mean(), atol=0.01)
    assert theirs.std() > 0.1
