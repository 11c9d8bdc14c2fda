"""What a panel draws, without a window."""

from types import SimpleNamespace

import bpy

from addon import ui


class RecordedOperator:
    """Plays OperatorProperties. A switch that is drawn as a button counts as drawn, and its icon is recorded."""

    def __init__(self, drawn, icon):
        self.__dict__.update(drawn=drawn, icon=icon)

    def __setattr__(self, name, value):
        if name == "switch":
            self.drawn[-1:] = [value, f"icon {self.icon}"]


class RecordingLayout:
    """Plays UILayout: every property drawn must exist; its name is recorded."""

    def __init__(self, drawn):
        self.drawn = drawn

    def prop(self, owner, name, **_options):
        assert name in owner.bl_rna.properties, f"{owner} has no {name}"
        self.drawn.append(name)

    def template_node_view(self, tree, node, node_input):
        assert node_input.name in node.inputs
        self.drawn.append(f"socket {node_input.name}")

    def template_icon_view(self, owner, name, **_options):
        self.prop(owner, name)

    def template_curve_mapping(self, owner, name, **_options):
        assert owner.bl_rna.properties[name].fixed_type.identifier == "CurveMapping"
        self.drawn.append(name)

    def template_ID(self, owner, name, new):  # noqa: N802 (Blender's name)
        self.prop(owner, name)
        self.operator(new)

    def template_light_linking_collection(self, _row, owner, name):
        self.prop(owner, name)

    def operator(self, identifier, **options):
        self.drawn.append(identifier)
        return RecordedOperator(self.drawn, options.get("icon"))

    def operator_menu_enum(self, identifier, name, **_options):
        self.operator(identifier)

    def template_list(self, kind, _list_id, owner, name, active_owner, active_name, **_options):
        assert hasattr(bpy.types, kind)
        self.prop(owner, name)
        self.prop(active_owner, active_name)

    def prop_search(self, owner, name, searched, collection, **_options):
        self.prop(owner, name)
        assert collection in searched.bl_rna.properties

    def menu(self, identifier, **_options):
        assert hasattr(bpy.types, identifier)

    def separator(self):
        pass

    def label(self, text=""):
        self.drawn.append(f"label {text}")

    def row(self, **_options):
        return RecordingLayout(self.drawn)

    column = row


def draw(cls, **context):
    drawn = []
    cls.draw(SimpleNamespace(layout=RecordingLayout(drawn)), editor(300, **context))
    return drawn


def editor(width, ui_scale=1.0, **context):
    """The context of a properties editor of this width in pixels."""
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=ui_scale))
    if "scene" in context:
        context = {"view_layer": context["scene"].view_layers[0], **context}
    return SimpleNamespace(engine=ui.ENGINE, region=SimpleNamespace(width=width), preferences=preferences, **context)
