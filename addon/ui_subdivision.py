"""The panels of adaptive subdivision: Blender's own of the modifier shows it with Cycles alone."""
# ruff: noqa: N801  (Blender wants CATEGORY_PT_name)

import bpy
from bpy.types import Context, Panel, UILayout

from .ui_base import ENGINE, CisternPanel, split_layout


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
        obj = context.object
        is_last = obj is not None and len(obj.modifiers) > 0 and obj.modifiers[-1].type == "SUBSURF"
        return context.engine == ENGINE and is_last and switch_owner(obj) is not None

    def draw_header(self, context: Context) -> None:
        self.layout.prop(switch_owner(context.object), "use_adaptive_subdivision", text="")

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        obj = context.object
        layout.active = switch_owner(obj).use_adaptive_subdivision
        if switch_owner(obj) == obj.modifiers[-1]:
            draw_edge_lengths(layout, obj.modifiers[-1])
            return
        layout.prop(obj.cycles, "dicing_rate")
        if context.scene.cycles.feature_set != "EXPERIMENTAL":
            layout.prop(context.scene.cycles, "feature_set")


def draw_edge_lengths(layout: UILayout, modifier: bpy.types.SubsurfModifier) -> None:
    layout.prop(modifier, "adaptive_space")
    is_in_pixels = modifier.adaptive_space == "PIXEL"
    layout.prop(modifier, "adaptive_pixel_size" if is_in_pixels else "adaptive_object_edge_length")


def switch_owner(obj: bpy.types.Object) -> bpy.types.bpy_struct | None:
    """What has the switch: from Blender 5.0 on the modifier, before the object by Cycles' add-on."""
    modifier = obj.modifiers[-1]
    if hasattr(modifier, "use_adaptive_subdivision"):
        return modifier
    return getattr(obj, "cycles", None)


CLASSES = (CISTERN_RENDER_PT_subdivision, CISTERN_MODIFIER_PT_subdivision)
