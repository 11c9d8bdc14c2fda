"""What the header of a 3D viewport shows while our engine renders in it: the pause button, and the menu of views."""

import bpy
from bpy.types import Context, Header

from .ui_base import ENGINE


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
