"""Edits of displaced meshes in viewports: each shows, and the core then has what an export from nothing gives."""

from collections.abc import Callable, Iterator

import bpy
import numpy as np
import pytest
from bpy.app.handlers import persistent

from addon.sync import SyncReport
from addon.sync.camera import camera_arguments
from addon.sync.changes import EVERYTHING, read_changes
from addon.sync.live import LiveSync
from tests.support import blender_scenes as build

core = pytest.importorskip("cistern_core")

SIZE = 32


class Displaced:
    """A grid that an image and noise move, exported after every edit."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self.image = build.gradient_image()
        self.material = build.material("moved", self._shade)
        self.material.displacement_method = "DISPLACEMENT"
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=24, y_subdivisions=24, calc_uvs=True)
        self.grid = bpy.context.object
        self.grid.data.materials.append(self.material)
        build.add_camera(scene, (0.0, -3.0, 2.0), (0.9, 0.0, 0.0))
        self.scene = scene
        self.live = LiveSync(core)

    def _shade(self, tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        self.tree = tree
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = self.image
        self.noise = build.shader(tree, "ShaderNodeTexNoise", Vector=tree.nodes.new("ShaderNodeNewGeometry").outputs[0])
        height = build.shader(tree, "ShaderNodeMath").inputs
        tree.links.new(texture.outputs["Color"], height[0])
        tree.links.new(self.noise.outputs[0], height[1])
        self.displacement = build.shader(tree, "ShaderNodeDisplacement", Scale=0.3)
        tree.links.new(height[0].node.outputs[0], self.displacement.inputs["Height"])
        output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
        self.link = tree.links.new(self.displacement.outputs[0], output.inputs["Displacement"])
        return build.shader(tree, "ShaderNodeBsdfDiffuse").outputs[0]

    def picture(self, sync: LiveSync) -> np.ndarray:
        """Position and Normal, of what a viewport gets."""
        camera = self.scene.camera.evaluated_get(bpy.context.evaluated_depsgraph_get())
        sync.builder.set_camera(**camera_arguments(self.scene, camera, SyncReport()))
        passes = ["Position", "Normal"]
        session = core.Session(core.Settings(width=SIZE, height=SIZE, samples=1, passes=passes))
        session.start(sync.builder.snapshot(), None)
        while session.wait(0.1).status is core.Status.RUNNING:
            pass
        return np.stack([session.read(name) for name in passes])

    def fresh(self) -> np.ndarray:
        sync = LiveSync(core)
        try:
            sync.sync(bpy.context.evaluated_depsgraph_get(), EVERYTHING)
            return self.picture(sync)
        finally:
            sync.close()


@pytest.fixture
def displaced(empty_scene) -> Iterator[Displaced]:
    found = Displaced(empty_scene)
    found.live.sync(bpy.context.evaluated_depsgraph_get(), EVERYTHING)

    @persistent
    def follow(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        found.live.sync(depsgraph, read_changes(depsgraph))

    bpy.app.handlers.depsgraph_update_post.append(follow)
    yield found
    bpy.app.handlers.depsgraph_update_post.remove(follow)
    found.live.close()


def change_strength(displaced: Displaced) -> None:
    displaced.displacement.inputs["Scale"].default_value = 0.6


def change_noise(displaced: Displaced) -> None:
    displaced.noise.inputs["Scale"].default_value = 2.0


def repaint(displaced: Displaced) -> None:
    displaced.image.pixels.foreach_set(np.full(len(displaced.image.pixels), 0.9, np.float32))
    displaced.image.update()
    displaced.material.update_tag()


def bump_alone(displaced: Displaced) -> None:
    displaced.material.displacement_method = "BUMP"


def unlink(displaced: Displaced) -> None:
    displaced.tree.links.remove(displaced.link)


def move(displaced: Displaced) -> None:
    """The noise is of places in the world."""
    displaced.grid.location.x = 0.3


def raise_a_vertex(displaced: Displaced) -> None:
    displaced.grid.data.vertices[300].co.z = 0.4
    displaced.grid.data.update()


EDITS = (change_strength, change_noise, repaint, bump_alone, unlink, move, raise_a_vertex)


@pytest.mark.parametrize("edit", EDITS)
def test_edits_show(displaced: Displaced, edit: Callable[[Displaced], None]) -> None:
    before = displaced.picture(displaced.live)
    edit(displaced)
    bpy.context.view_layer.update()
    after = displaced.picture(displaced.live)
    assert not np.array_equal(after, before)
    np.testing.assert_array_equal(after, displaced.fresh())


def test_an_edit_of_nothing_that_moves_keeps_the_mesh(displaced: Displaced) -> None:
    before = displaced.picture(displaced.live)
    bsdf = next(node for node in displaced.tree.nodes if node.type == "BSDF_DIFFUSE")
    bsdf.inputs["Color"].default_value = (0.1, 0.2, 0.3, 1.0)
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(displaced.picture(displaced.live), before)
