"""What the header of a 3D viewport shows while our engine renders in it: the pause button, the menu of views, and what
lights the scene in that viewport."""
# ruff: noqa: N801  (Blender wants CATEGORY_PT_name)

import bpy
from bpy.types import Context, Header, Panel

from .ui_base import ENGINE


class CISTERN_VIEW3D_PT_shading_lighting(Panel):
    """Blender's own has these with EEVEE alone."""

    bl_label = "Lighting"
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_parent_id = "VIEW3D_PT_shading"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine == ENGINE and context.space_data.shading.type == "RENDERED"

    def draw(self, context: Context) -> None:
        shading = context.space_data.shading
        column = self.layout.column()
        column.prop(shading, "use_scene_lights_render")
        column.prop(shading, "use_scene_world_render")
        if shading.use_scene_world_render:
            return
        row = self.layout.row()
        pictures = row.column()
        pictures.scale_y = 0.6
        pictures.template_icon_view(shading, "studio_light", scale_popup=3.0)
        row.operator("screen.userpref_show", emboss=False, text="", icon="PREFERENCES").section = "LIGHTS"
        column = self.layout.column()
        column.prop(shading, "studiolight_rotate_z", text="Rotation")
        column.prop(shading, "studiolight_intensity")
        column.prop(shading, "studiolight_background_alpha")


CLASSES = (CISTERN_VIEW3D_PT_shading_lighting,)


def draw_header(header: Header, context: Context) -> None:
    if context.engine != ENGINE or context.space_data.shading.type != "RENDERED":
        return
    settings = context.scene.cistern
    row = header.layout.row(align=True)
    # In a narrow window the end of the header is cut off: the name of a view may be, the button may not.
    row.prop(settings, "viewport_pause", text="", icon="PLAY" if settings.viewport_pause else "PAUSE")
    row.prop(settings, "viewport_view", text="")


def register() -> None:
    bpy.types.VIEW3D_HT_header.append(draw_header)


def unregister() -> None:
    bpy.types.VIEW3D_HT_header.remove(draw_header)
