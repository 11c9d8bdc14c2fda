"""The add-on's box in the preferences: one line that says whether it can render here, and if not, why."""

import textwrap

import bpy

from . import core

LINE_LENGTH = 90  # letters of a row in a preferences window of the usual width


class CisternPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    def draw(self, _context: bpy.types.Context) -> None:
        is_ready, sentence = core.status()
        column = self.layout.column(align=True)
        for number, row in enumerate(textwrap.wrap(sentence, LINE_LENGTH)):
            icon = "BLANK1" if number else "CHECKMARK" if is_ready else "ERROR"
            column.label(text=row, icon=icon)


def register() -> None:
    bpy.utils.register_class(CisternPreferences)


def unregister() -> None:
    bpy.utils.unregister_class(CisternPreferences)
