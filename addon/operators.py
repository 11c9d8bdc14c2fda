"""What the panels' buttons do."""

import bpy
from bpy.props import EnumProperty, StringProperty

from . import cycles_settings, techniques


class CISTERN_OT_choose_preset(bpy.types.Operator):  # noqa: N801  (Blender wants CATEGORY_OT_name)
    """Use the techniques of this preset"""

    bl_idname = "cistern.choose_preset"
    bl_label = "Choose Preset"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}  # noqa: RUF012  (Blender's own form)

    preset: EnumProperty(name="Preset", description="The preset to use", items=techniques.PRESET_ITEMS)

    def execute(self, context: bpy.types.Context) -> set[str]:
        techniques.choose_preset(context.scene.cistern, self.preset)
        return {"FINISHED"}


class CISTERN_OT_change_switch(bpy.types.Operator):  # noqa: N801
    """Change what the preset has decided here"""

    bl_idname = "cistern.change_switch"
    bl_label = "Change Switch"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}  # noqa: RUF012

    switch: StringProperty(name="Switch", description="Which of the techniques' switches")

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = context.scene.cistern
        setattr(settings, self.switch, not techniques.settings_in_force(settings)[self.switch])
        return {"FINISHED"}


class CISTERN_OT_take_cycles_settings(bpy.types.Operator):  # noqa: N801
    """Give samples, bounces, clamping, filter, seed, denoising and passes the values that this scene has for Cycles"""

    bl_idname = "cistern.take_cycles_settings"
    bl_label = "Take Settings from Cycles"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if cycles_settings.is_there(context.scene):
            return True
        cls.poll_message_set("Cycles, whose settings these are, is not enabled")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        left = cycles_settings.take_over(context.scene)
        for layer in context.scene.view_layers:
            layer.update_render_passes()
        self.report({"INFO"}, "Settings are those of Cycles" + (f", but {', '.join(left)}" if left else ""))
        return {"FINISHED"}


CLASSES = (CISTERN_OT_choose_preset, CISTERN_OT_change_switch, CISTERN_OT_take_cycles_settings)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
