"""Puts a picture on the screen. The only file that needs a graphics context; `view_draw` calls it, and nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import bpy

    from .viewport_render import Picture


class Screen:
    """Holds the texture of the picture drawn last, so that a redraw without news uploads nothing."""

    def __init__(self) -> None:
        self._texture = None
        self._number = -1

    def draw(
        self, engine: bpy.types.RenderEngine, scene: bpy.types.Scene, picture: Picture, size: tuple[int, int]
    ) -> None:
        """Draw into the region of the given size in pixels, through the scene's view transform."""
        import gpu
        from gpu_extras.presets import draw_texture_2d

        if picture.number != self._number:
            self._upload(picture)
        left, bottom, right, top = picture.place
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(scene)
        try:
            place = (left * size[0], bottom * size[1])
            draw_texture_2d(self._texture, place, (right - left) * size[0], (top - bottom) * size[1])
        finally:
            engine.unbind_display_space_shader()
            gpu.state.blend_set("NONE")

    def _upload(self, picture: Picture) -> None:
        import gpu

        height, width, channels = picture.pixels.shape
        pixels = gpu.types.Buffer("FLOAT", width * height * channels, picture.pixels.ravel())
        self._texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=pixels)
        self._number = picture.number
