"""A scene for passes of what camera rays meet, and its renders with all layers, by Cistern and by Cycles."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO
from numpy.typing import NDArray

import addon

from .blender_scenes import add_mesh, material, shader
from .engines import prepare
from .statistics import FALSE_ALARM_RATE, Comparison, block_means, compare_replicas

Layers = dict[str, NDArray[np.float32]]

SIZE = (48, 16)


def see_through(name: str, alpha: float, pass_index: int) -> bpy.types.Material:
    """White diffuse of which a share of `alpha` is there."""

    def build(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        clear = shader(tree, "ShaderNodeBsdfTransparent").outputs[0]
        solid = shader(tree, "ShaderNodeBsdfDiffuse").outputs[0]
        mix = tree.nodes.new("ShaderNodeMixShader")
        mix.inputs[0].default_value = alpha
        tree.links.new(clear, mix.inputs[1])
        tree.links.new(solid, mix.inputs[2])
        return mix.outputs[0]

    result = material(name, build)
    result.pass_index = pass_index
    return result


def card(
    scene: bpy.types.Scene,
    name: str,
    left: float,
    right: float,
    height: float,
    surface: bpy.types.Material | None,
    pass_index: int,
) -> bpy.types.Object:
    """A rectangle across the view with two UV maps, of which the second is rendered."""
    points = [(left, -1.0, height), (right, -1.0, height), (right, 1.0, height), (left, 1.0, height)]
    result = add_mesh(scene, name, points, [(0, 1, 2, 3)], surface)
    result.pass_index = pass_index
    for map_name, scale in (("other", 5.0), ("rendered", 1.0)):
        layer = result.data.uv_layers.new(name=map_name)
        for corner, (u, v) in enumerate([(0.25, 0.0), (1.0, 0.0), (1.0, 2.0), (0.25, 2.0)]):
            layer.data[corner].uv = (scale * u, scale * v)
    result.data.uv_layers["rendered"].active_render = True
    return result


def glass() -> bpy.types.Material:
    result = material("glass", lambda tree: shader(tree, "ShaderNodeBsdfGlass", Roughness=0.0, IOR=1.0001).outputs[0])
    result.pass_index = 9
    return result


def build_cards(scene: bpy.types.Scene, camera_type: str = "PERSP") -> None:
    """From left to right, before a solid card: nothing, cards that are 30 % and 70 % there, one behind another, glass;
    then a held out card, a child, a card without a material or UV map, and the sky."""
    base = card(scene, "Base", -6.0, 2.0, 0.0, see_through("Solid", 1.0, 5), 3)
    thin, thick = see_through("Thin", 0.3, 6), see_through("Thick", 0.7, 7)
    card(scene, "Thin", -4.0, -2.0, 1.0, thin, 4).parent = base
    card(scene, "Above", -2.5, -1.5, 1.5, thin, 11).parent = base
    card(scene, "Thick", -1.5, 0.0, 2.0, thick, 8)
    card(scene, "Glass", 0.3, 1.3, 1.0, glass(), 9)
    card(scene, "Hidden", 2.0, 3.0, 0.5, see_through("Held out", 1.0, 8), 10).is_holdout = True
    card(scene, "Alone", 3.0, 4.0, 0.5, thin, 12)
    bare = card(scene, "Bare", 4.0, 5.0, 0.5, None, 2)
    while bare.data.uv_layers:
        bare.data.uv_layers.remove(bare.data.uv_layers[0])
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 9.0)
    camera.data.type, camera.data.ortho_scale, camera.data.lens = camera_type, 12.0, 27.3  # no edge on pixel centres
    scene.collection.objects.link(camera)
    scene.camera = camera
    world = bpy.data.worlds.new("Sky")
    world.use_nodes = True
    scene.world = world
    world.mist_settings.start, world.mist_settings.depth, world.mist_settings.falloff = 5.0, 8.0, "QUADRATIC"


def add_aov(tree: bpy.types.NodeTree, name: str, **inputs: object) -> bpy.types.Node:
    """A node that writes to a pass: values, or sockets to link."""
    node = shader(tree, "ShaderNodeOutputAOV", **inputs)
    node.aov_name = name
    return node


def write_aovs(scene: bpy.types.Scene) -> None:
    """The passes Tint and Level: of each material by a number of its own, in the middle of the cards by UV, through a
    group and twice in Thick; of the sky by direction."""
    for name, kind in (("Tint", "COLOR"), ("Level", "VALUE")):
        aov = scene.view_layers[0].aovs.add()
        aov.name, aov.type = name, kind
    for number, surface in enumerate(bpy.data.materials, 1):
        tree = surface.node_tree
        uv = tree.nodes.new("ShaderNodeTexCoord").outputs["UV"]
        add_aov(tree, "Tint", Color=uv)
        add_aov(tree, "Level", Value=0.1 * number)
        add_aov(tree, "Other", Color=(9.0, 9.0, 9.0, 1.0))
    group = bpy.data.node_groups.new("Writer", "ShaderNodeTree")
    inputs = group.nodes.new("NodeGroupInput")
    group.interface.new_socket("Amount", in_out="INPUT", socket_type="NodeSocketFloat")
    group.links.new(inputs.outputs[0], add_aov(group, "Level").inputs["Value"])
    thick = bpy.data.materials["Thick"].node_tree
    use = thick.nodes.new("ShaderNodeGroup")
    use.node_tree = group
    use.inputs[0].default_value = 0.75
    sky = scene.world.node_tree
    add_aov(sky, "Tint", Color=sky.nodes.new("ShaderNodeTexCoord").outputs["Generated"])
    add_aov(sky, "Level", Value=2.0)


def prepare_layers(scene: bpy.types.Scene, preset: str = "PATH_TRACING") -> None:
    """Equal settings of both engines, all layers into one file."""
    prepare(scene, *SIZE)
    scene.cistern.preset = preset
    scene.cistern.filter_width, scene.cycles.pixel_filter_type = 1.0, "BOX"
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"


def render_layers(scene: bpy.types.Scene, engine: str, samples: int, seed: int = 0) -> tuple[Layers, dict[str, str]]:
    """Channels by name, row 0 at the bottom, and the metadata of the file. Raises when Cistern's render failed."""
    scene.render.engine = engine
    settings = scene.cycles if engine == "CYCLES" else scene.cistern
    settings.samples, settings.seed = samples, seed
    addon.report.last.clear()
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "layers.exr")
        bpy.ops.render.render(write_still=True)
        errors = [line.error for line in addon.report.last if line.error]
        assert not errors, errors
        return read_layers(scene.render.filepath)


def read_layers(path: str) -> tuple[Layers, dict[str, str]]:
    reader = OpenImageIO.ImageInput.open(path)
    channels, metadata, part = {}, {}, 0
    while reader.seek_subimage(part, 0):
        spec = reader.spec()
        pixels = reader.read_image(part, 0, 0, spec.nchannels, OpenImageIO.FLOAT)
        channels |= {name: np.flipud(pixels[..., i]) for i, name in enumerate(spec.channelnames)}
        metadata |= {attribute.name: attribute.value for attribute in spec.extra_attribs}
        part += 1
    reader.close()
    return channels, metadata


def layers_by_threads(scene: bpy.types.Scene) -> list[Layers]:
    """Cistern's channels by name, rendered by one thread and by three."""
    pictures = []
    for threads in (1, 3):
        scene.render.threads_mode, scene.render.threads = "FIXED", threads
        pictures.append(render_layers(scene, "CISTERN", 4)[0])
    return pictures


def layer_replicas(
    scene: bpy.types.Scene, engine: str, names: list[str], count: int = 6, samples: int = 64, columns: int = 12
) -> NDArray:
    """Means over blocks of these channels in renders with different seeds: (count, values)."""
    first_seed = 1 if engine == "CISTERN" else 1001
    found = []
    for seed in range(first_seed, first_seed + count):
        channels, _ = render_layers(scene, engine, samples, seed)
        stacked = np.stack([channels[f"{scene.view_layers[0].name}.{name}"] for name in names], axis=2)
        found.append(block_means(stacked, 2, columns))
    return np.array(found)


def compare_layers(
    scene: bpy.types.Scene, names: list[str], plant: Callable[[bpy.types.Scene], object] | None = None
) -> Comparison:
    """Of Cistern's channels with those of Cycles, by t-tests over blocks with FALSE_ALARM_RATE altogether. `plant`
    changes the scene for Cycles alone."""
    ours = layer_replicas(scene, "CISTERN", names)
    if plant:
        plant(scene)
    return compare_replicas(ours, layer_replicas(scene, "CYCLES", names), FALSE_ALARM_RATE)
