"""What our panels in the properties editor share."""

from bpy.types import Context, Panel, UILayout

ENGINE = "CISTERN"


class CisternPanel:
    """What all our panels in the properties editor share."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine == ENGINE


def split_layout(panel: Panel) -> UILayout:
    """The panel's layout with names on the left."""
    panel.layout.use_property_split = True
    panel.layout.use_property_decorate = False
    return panel.layout
