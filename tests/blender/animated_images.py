"""Image sequences and movies of one colour a frame, and nodes that show them."""

from pathlib import Path

import bpy
import numpy as np

from addon.sync import versions

COLORS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 0.0))


def write_sequence(folder: Path, count: int = len(COLORS)) -> bpy.types.Image:
    """Files frame_0001.png and so on, and an image of them."""
    oiio = versions.image_reader()
    for number in range(1, count + 1):
        output = oiio.ImageOutput.create("png")
        assert output.open(str(folder / f"frame_{number:04}.png"), oiio.ImageSpec(4, 4, 3, oiio.UINT8))
        output.write_image(np.full((4, 4, 3), 255 * np.array(COLORS[number - 1]), np.uint8))
        output.close()
    image = bpy.data.images.load(str(folder / "frame_0001.png"))
    image.source = "SEQUENCE"
    return image


def write_movie(folder: Path) -> Path:
    """A movie of as many frames as there are colours, in a scene that is spoiled for other uses."""
    scene = bpy.context.scene
    scene.world = scene.world or bpy.data.worlds.new("Colour")
    scene.world.use_nodes = True
    color = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND").inputs["Color"]
    for number, rgb in enumerate(COLORS, 1):
        color.default_value = (*rgb, 1.0)
        color.keyframe_insert("default_value", frame=number)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera, scene.frame_start, scene.frame_end = camera, 1, len(COLORS)
    scene.render.engine, scene.cycles.samples, scene.view_settings.view_transform = "CYCLES", 1, "Standard"
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = 32
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # from Blender 5.0 on
        settings.media_type = "VIDEO"
    settings.file_format = "FFMPEG"
    scene.render.ffmpeg.format, scene.render.ffmpeg.codec = "MPEG4", "H264"
    scene.render.ffmpeg.constant_rate_factor, scene.render.ffmpeg.gopsize = "LOSSLESS", 1
    scene.render.filepath = str(folder / "movie_")
    bpy.ops.render.render(animation=True)
    return next(folder.glob("movie_*"))


def image_node(
    tree: bpy.types.NodeTree, image: bpy.types.Image, kind: str = "ShaderNodeTexImage"
) -> bpy.types.ShaderNode:
    """A texture node that follows the scene's frame."""
    node = tree.nodes.new(kind)
    node.image, user = image, node.image_user
    user.frame_duration, user.frame_start, user.use_auto_refresh = len(COLORS), 1, True
    return node
