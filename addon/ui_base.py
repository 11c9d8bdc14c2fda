"""What our panels in the properties editor share."""

import bpy
from bpy.types import Context, Panel, UILayout
from bpy_extras.node_utils import find_node_input

from .sync.versions import uses_nodes

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


def draw_node_socket(layout: UILayout, owner: bpy.types.ID, socket: str, color: str = "") -> None:
    """The node tree behind one socket of the output node, foldable as elsewhere in Blender. Without nodes the switch
    that brings them, and the property that stands in for them."""
    if not uses_nodes(owner):
        layout.prop(owner, "use_nodes", icon="NODETREE")
        if color:
            layout.prop(owner, color)
        return
    node = owner.node_tree.get_output_node("CYCLES")
    if node is None:
        layout.label(text="No output node")
        return
    node_input = find_node_input(node, socket)
    if node_input is None:
        layout.label(text="Incompatible output node")
    else:
        layout.template_node_view(owner.node_tree, node, node_input)


def draw_light_group(layout: UILayout, owner: bpy.types.ID, view_layer: bpy.types.ViewLayer) -> None:
    """Any name may be given; a button adds it to the view layer, which is what makes it a group."""
    row = layout.row(align=True)
    row.column(align=True).prop_search(
        owner, "lightgroup", view_layer, "lightgroups", text="Light Group", results_are_suggestions=True
    )
    button = row.column(align=True)
    button.enabled = bool(owner.lightgroup) and owner.lightgroup not in view_layer.lightgroups
    button.operator("scene.view_layer_add_lightgroup", icon="ADD", text="").name = owner.lightgroup


def draw_existing(layout: UILayout, owner: bpy.types.bpy_struct, *names: str, **options: object) -> None:
    """Draw those of the properties that this Blender's version of the data-block has."""
    for name in names:
        if name in owner.bl_rna.properties:
            layout.prop(owner, name, **options)
