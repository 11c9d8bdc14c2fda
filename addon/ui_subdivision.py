"""The panels of adaptive subdivision: Blender's own of the modifier shows it with Cycles alone."""
# ruff: noqa: N801  (Blender wants CATEGORY_PT_name)

import bpy
from bpy.types import Context, Panel

from .sync.versions import adaptive_switch
from .ui_base import CisternPanel, split_layout


class CISTERN_RENDER_PT_subdivision(CisternPanel, Panel):
    """Settings of Cycles' add-on, which files have them from."""

    bl_label = "Subdivision"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and hasattr(context.scene, "cycles")

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        settings = context.scene.cycles
        column = layout.column(align=True)
        column.prop(settings, "dicing_rate", text="Dicing Rate Render")
        column.prop(settings, "preview_dicing_rate", text="Viewport")
        layout.prop(settings, "offscreen_dicing_scale", text="Offscreen Scale")
        layout.prop(settings, "max_subdivisions")
        layout.prop(settings, "dicing_camera")


class CISTERN_MODIFIER_PT_subdivision(CisternPanel, Panel):
    """Of the last modifier, which alone can."""

    bl_label = "Adaptive Subdivision"
    bl_context = "modifier"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and context.object is not None and adaptive_switch(context.object) is not None

    def draw_header(self, context: Context) -> None:
        self.layout.prop(adaptive_switch(context.object), "use_adaptive_subdivision", text="")

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        switch = adaptive_switch(context.object)
        layout.active = switch.use_adaptive_subdivision
        if isinstance(switch, bpy.types.Modifier):
            layout.prop(switch, "adaptive_space")
            is_in_pixels = switch.adaptive_space == "PIXEL"
            layout.prop(switch, "adaptive_pixel_size" if is_in_pixels else "adaptive_object_edge_length")
            return
        layout.prop(switch, "dicing_rate")
        if context.scene.cycles.feature_set != "EXPERIMENTAL":
            layout.prop(context.scene.cycles, "feature_set")


CLASSES = (CISTERN_RENDER_PT_subdivision, CISTERN_MODIFIER_PT_subdivision)
