"""What the panels' buttons do."""

import bpy
from bpy.props import EnumProperty

from . import techniques


class CISTERN_OT_choose_preset(bpy.types.Operator):  # noqa: N801  (Blender wants CATEGORY_OT_name)
    """Use the techniques of this preset"""

    bl_idname = "cistern.choose_preset"
    bl_label = "Choose Preset"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}  # noqa: RUF012  (Blender's own form)

    preset: EnumProperty(name="Preset", description="The preset to use", items=techniques.PRESET_ITEMS)

    def execute(self, context: bpy.types.Context) -> set[str]:
        techniques.choose_preset(context.scene.cistern, self.preset)
        return {"FINISHED"}


def register() -> None:
    bpy.utils.register_class(CISTERN_OT_choose_preset)


def unregister() -> None:
    bpy.utils.unregister_class(CISTERN_OT_choose_preset)
