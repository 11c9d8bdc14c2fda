"""The panels of baking. What they set is Blender's, but for the type, of which each engine has its own."""
# ruff: noqa: N801  (Blender wants CATEGORY_PT_name)

import bpy
from bpy.types import BakeSettings, Context, Panel, RenderSettings

from .ui_base import CisternPanel, draw_existing, split_layout

LIGHT_TYPES = frozenset({"DIFFUSE", "GLOSSY", "TRANSMISSION"})
HAS_OWN_MULTIRES = "use_multires" in BakeSettings.bl_rna.properties  # from Blender 5.0 on


def multires(context: Context) -> BakeSettings | RenderSettings:
    """What has the settings of baking from multiresolution, which is Blender's own and knows no engine."""
    render = context.scene.render
    return render.bake if HAS_OWN_MULTIRES else render


def multires_name(name: str) -> str:
    """Of one of these settings."""
    if HAS_OWN_MULTIRES:
        return name
    return name.replace("use_", "use_bake_") if name.startswith("use_") else f"bake_{name}"


def bakes_multires(context: Context) -> bool:
    return getattr(multires(context), multires_name("use_multires"))


class CISTERN_RENDER_PT_bake(CisternPanel, Panel):
    bl_label = "Bake"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        settings, bake = context.scene.cistern, context.scene.render.bake
        if bakes_multires(context):
            layout.operator("object.bake_image", icon="RENDER_STILL")
            layout.prop(multires(context), multires_name("use_multires"))
            layout.prop(multires(context), multires_name("type"))
            return
        bake_now = layout.operator("object.bake", icon="RENDER_STILL")
        if settings.bake_type:  # else chosen in another version of Cistern
            bake_now.type = settings.bake_type
        layout.prop(multires(context), multires_name("use_multires"))
        layout.prop(settings, "bake_type")
        layout.prop(bake, "view_from")


class CISTERN_RENDER_PT_bake_influence(CisternPanel, Panel):
    bl_label = "Influence"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_bake"

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context) or bakes_multires(context):
            return False
        return context.scene.cistern.bake_type in LIGHT_TYPES | {"COMBINED", "NORMAL"}

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        bake, bake_type = context.scene.render.bake, context.scene.cistern.bake_type
        if bake_type == "NORMAL":
            layout.prop(bake, "normal_space", text="Space")
            column = layout.column(align=True)
            for axis, title in (("r", "Swizzle R"), ("g", "G"), ("b", "B")):
                column.prop(bake, f"normal_{axis}", text=title)
            return
        column = layout.column(heading="Light", align=True)
        column.prop(bake, "use_pass_direct")
        column.prop(bake, "use_pass_indirect")
        if bake_type in LIGHT_TYPES:
            column.prop(bake, "use_pass_color")
            return
        column = layout.column(heading="Contributions", align=True)
        column.active = bake.use_pass_direct or bake.use_pass_indirect
        for kind in ("diffuse", "glossy", "transmission"):
            column.prop(bake, f"use_pass_{kind}")
        layout.column().prop(bake, "use_pass_emit")


class CISTERN_RENDER_PT_bake_selected(CisternPanel, Panel):
    bl_label = "Selected to Active"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and not bakes_multires(context)

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.scene.render.bake, "use_selected_to_active", text="")

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        bake = context.scene.render.bake
        layout.active = bake.use_selected_to_active
        layout.prop(bake, "use_cage")
        if bake.use_cage:
            layout.prop(bake, "cage_object")
        column = layout.column()
        column.prop(bake, "cage_extrusion", text="Extrusion")
        column.prop(bake, "max_ray_distance")


class CISTERN_RENDER_PT_bake_output(CisternPanel, Panel):
    bl_label = "Output"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_bake"

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        if bakes_multires(context):
            draw_multires(layout, multires(context))
            return
        bake = context.scene.render.bake
        layout.prop(bake, "target")
        if bake.target == "IMAGE_TEXTURES":
            layout.prop(bake, "use_clear", text="Clear Image")
            if not has_own_margin(context):
                layout.prop(bake, "margin_type", text="Margin Type")
            layout.prop(bake, "margin", text="Margin Size")


def draw_multires(layout: bpy.types.UILayout, settings: BakeSettings | RenderSettings) -> None:
    layout.prop(settings, multires_name("use_clear"), text="Clear Image")
    kind = getattr(settings, multires_name("type"))
    if "DISPLACEMENT" in kind:
        layout.prop(settings, multires_name("use_lores_mesh"))
    if kind == "VECTOR_DISPLACEMENT":
        draw_existing(layout, settings, "displacement_space", text="Space")
    draw_existing(layout, settings, multires_name("margin_type"), text="Margin Type")
    draw_existing(layout, settings, multires_name("margin"), text="Margin Size")


def has_own_margin(context: Context) -> bool:
    """Whether Blender extends such pictures in one way, whatever is chosen."""
    kind = context.scene.cistern.bake_type
    return kind == "UV" or (kind == "NORMAL" and context.scene.render.bake.normal_space == "TANGENT")


CLASSES = (
    CISTERN_RENDER_PT_bake,
    CISTERN_RENDER_PT_bake_influence,
    CISTERN_RENDER_PT_bake_selected,
    CISTERN_RENDER_PT_bake_output,
)
