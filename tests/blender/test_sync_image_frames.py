"""Which frame of a movie or sequence is exported: that of the node's image user, as in Cycles."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from animated_images import COLORS, image_node, write_movie, write_sequence
from cycles_pixel import cycles_pixel
from fake_core import SceneBuilder
from small_objects import link

from addon.sync import SyncReport, images
from addon.sync.images import ImageCache


@pytest.fixture(scope="module")
def movie(tmp_path_factory) -> Path:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return write_movie(tmp_path_factory.mktemp("movie"))


@pytest.fixture
def cache():
    cache = ImageCache()
    yield cache
    cache.close()


def exported(cache: ImageCache, node: bpy.types.ShaderNode, frame: int | None) -> np.ndarray:
    """The colour of the only image that the builder gets, 0 to 1."""
    builder, report = SceneBuilder(), SyncReport()
    cache.begin(frame)
    cache.prefetch(node.image, node.image_user)
    assert cache.handle(node.image, node.image_user, builder, report) == 0
    assert not report.warnings
    return builder.of("add_image")[0]["pixels"][2, 2, :3] / 255.0


def shown_on_a_plane(image: bpy.types.Image) -> bpy.types.ShaderNode:
    """The node of the only material in sight, which glows."""
    bpy.ops.mesh.primitive_plane_add(size=20)
    material = bpy.data.materials.new("Screen")
    material.use_nodes = True
    bpy.context.object.data.materials.append(material)
    tree = material.node_tree
    node = image_node(tree, image)
    emission = tree.nodes.new("ShaderNodeEmission")
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(node.outputs["Color"], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return node


def evaluated(node: bpy.types.ShaderNode) -> bpy.types.ShaderNode:
    material = bpy.data.materials["Screen"].evaluated_get(bpy.context.evaluated_depsgraph_get())
    return material.node_tree.nodes[node.name]


def test_a_movie_shows_its_frame_whatever_was_decoded_before(empty_scene, cache, movie) -> None:
    node = shown_on_a_plane(bpy.data.images.load(str(movie)))
    for frame in (3, 1, 4, 2, 9, 2):
        assert exported(cache, node, frame) == pytest.approx(COLORS[min(frame, 4) - 1], abs=0.02)
        assert not node.image.is_dirty


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"use_auto_refresh": False},
        {"use_auto_refresh": False, "frame_current": 3},
        {"use_cyclic": True, "frame_duration": 3},
        {"use_cyclic": True, "frame_duration": 2, "frame_offset": 1, "frame_start": 2},
    ],
    ids=str,
)
@pytest.mark.parametrize("kind", ["sequence", "movie"])
def test_frames_are_those_of_cycles(empty_scene, cache, movie, tmp_path, kind, settings) -> None:
    image = bpy.data.images.load(str(movie)) if kind == "movie" else write_sequence(tmp_path)
    node = shown_on_a_plane(image)
    for name, value in settings.items():
        setattr(node.image_user, name, value)
    camera = link("Camera", bpy.data.cameras.new("Camera"), location=(0, 0, 5))
    for frame in (2, 5, 1):
        empty_scene.frame_set(frame)
        found = exported(cache, evaluated(node), frame)
        assert found == pytest.approx(cycles_pixel(camera, tmp_path)[:3], abs=0.02), frame


def test_painted_frames_of_a_sequence_are_those_of_the_files(empty_scene, cache, tmp_path) -> None:
    node = shown_on_a_plane(write_sequence(tmp_path))
    node.image.scale(4, 4, frame=1)
    node.image.pixels[0] = 0.5
    assert node.image.is_dirty
    assert exported(cache, node, 3) == pytest.approx(COLORS[2])


def test_a_sequence_that_only_blender_reads(empty_scene, cache, tmp_path, monkeypatch) -> None:
    node = shown_on_a_plane(write_sequence(tmp_path))
    monkeypatch.setattr(images, "read_file", lambda path, packed: None)
    for frame in (3, 1, 4):
        assert exported(cache, node, frame) == pytest.approx(COLORS[frame - 1])
    (tmp_path / "frame_0002.png").unlink()
    cache.begin(2)
    report = SyncReport()
    assert cache.handle(node.image, node.image_user, SceneBuilder(), report) == -1
    assert "frame_0002.png" in report.warnings[0]


def test_a_missing_movie_is_named(empty_scene, cache, tmp_path) -> None:
    image = bpy.data.images.new("Film", 1, 1)
    image.source, image.filepath = "MOVIE", str(tmp_path / "gone.mp4")
    report = SyncReport()
    node = shown_on_a_plane(image)
    cache.begin(1)
    assert cache.handle(node.image, node.image_user, SceneBuilder(), report) == -1
    assert "'Film'" in report.warnings[0] and "gone.mp4" in report.warnings[0]
