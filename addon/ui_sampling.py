"""The panels about sampling: presets, the three questions, the papers' parameters, cells and views."""
# ruff: noqa: N801  (Blender wants CATEGORY_PT_name)

import textwrap

from bpy.types import Context, Panel, UILayout

from . import denoise, techniques, view_modes
from .properties import CisternSceneSettings
from .settings import techniques_in_force
from .ui_base import ENGINE, CisternPanel, split_layout

# The techniques in the order they are drawn: property, title where the preset has decided, answers.
QUESTIONS = (
    ("direct", "Direct Light", techniques.DIRECT_ITEMS),
    ("secondary", "Secondary Light", techniques.SECONDARY_ITEMS),
    ("indirect", "Indirect Light", techniques.INDIRECT_ITEMS),
    ("guiding", "Guiding", techniques.GUIDING_ITEMS),
    ("bias", "Bias", techniques.BIAS_ITEMS),
    ("light_sampler", "Light Sampler", techniques.LIGHT_SAMPLER_ITEMS),
)
# Are followed by a sentence on the answer.
SENTENCES = frozenset({"direct", "secondary", "indirect", "guiding", "bias"})
# Of a sentence in a properties editor, in pixels at a resolution scale of 1.
CHARACTER_WIDTH, MARGINS_WIDTH = 6.0, 30.0
FEWEST_CHARACTERS = 20  # of a line


def item_texts(items: tuple[tuple[str, str, str], ...], identifier: str) -> tuple[str, str]:
    """Name and description of one of a menu's items."""
    unknown = ("Unknown", "Chosen in another version of Cistern: choose anew")
    return next(((name, description) for key, name, description in items if key == identifier), unknown)


def line_characters(context: Context) -> int:
    """How many characters of a sentence there is room for beside each other."""
    width = context.region.width / context.preferences.system.ui_scale
    return max(int((width - MARGINS_WIDTH) / CHARACTER_WIDTH), FEWEST_CHARACTERS)


def draw_sentence(layout: UILayout, sentence: str, context: Context) -> None:
    """In grey, over as many lines as it takes: Blender does not break lines itself."""
    column = layout.column(align=True)
    column.active = False
    for line in textwrap.wrap(sentence, line_characters(context)):
        column.label(text=line)


def value_text(value: techniques.Value) -> str:
    if isinstance(value, str):
        return value.capitalize()
    return ("on" if value else "off") if isinstance(value, bool) else f"{value:g}"


def draw_switch_of_preset(layout: UILayout, settings: CisternSceneSettings, name: str, *, is_on: bool) -> None:
    """One that was not set, whose own value may be another than what is in force by the preset."""
    icon = "CHECKBOX_HLT" if is_on else "CHECKBOX_DEHLT"
    text = settings.bl_rna.properties[name].name
    layout.operator("cistern.change_switch", text=text, icon=icon, emboss=False).switch = name


class CISTERN_RENDER_PT_sampling(CisternPanel, Panel):
    bl_label = "Sampling"
    bl_context = "render"

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        settings = context.scene.cistern
        name, sentence = item_texts(techniques.PRESET_ITEMS, settings.preset)
        text = f"{name}, changed" if techniques.is_changed(settings) else name
        layout.operator_menu_enum("cistern.choose_preset", "preset", text=text, icon="PRESET")
        draw_sentence(layout, sentence, context)
        layout.prop(settings, "samples")
        layout.prop(settings, "noise_threshold")
        row = layout.row()
        row.active = settings.noise_threshold > 0.0
        row.prop(settings, "use_adaptive_sampling")
        layout.prop(settings, "time_limit")
        layout.prop(settings, "use_denoising")
        if settings.use_denoising:
            draw_sentence(layout, denoise.state_sentence(), context)
        layout.operator("cistern.take_cycles_settings", icon="IMPORT")


class CISTERN_RENDER_PT_viewport(CisternPanel, Panel):
    bl_label = "Viewport"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_sampling"

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        settings = context.scene.cistern
        layout.prop(settings, "viewport_preset", text="Preset")
        layout.prop(settings, "viewport_view", text="View")
        layout.prop(settings, "viewport_samples", text="Samples")
        layout.prop(settings, "viewport_noise_threshold", text="Noise Threshold")
        layout.prop(settings, "viewport_time_limit", text="Time Limit")
        layout.prop(settings, "use_viewport_denoising", text="Denoise")
        if settings.use_viewport_denoising:
            draw_sentence(layout, denoise.viewport_sentence(), context)
        layout.prop(context.scene.render, "preview_pixel_size", text="Pixel Size")
        layout.prop(settings, "viewport_pause")


class CISTERN_RENDER_PT_techniques(CisternPanel, Panel):
    bl_label = "Techniques"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_sampling"

    def draw(self, context: Context) -> None:
        """Menus under the preset Custom, else the preset's answers."""
        layout = split_layout(self)
        settings = context.scene.cistern
        in_force = techniques.settings_in_force(settings)
        is_custom = settings.preset == "CUSTOM"
        for name, title, items in QUESTIONS:
            answer, sentence = item_texts(items, in_force[name])
            if is_custom:
                layout.prop(settings, name)
            else:
                layout.label(text=f"{title}: {answer}")
            if name in SENTENCES:
                draw_sentence(layout, sentence, context)
        row = layout.row()
        row.active = techniques.may_find_openings(in_force)
        row.prop(settings, "find_openings")
        row = layout.row()
        row.active = techniques.may_seek_through_panes(in_force)
        row.prop(settings, "light_through_panes")
        if not is_custom:
            layout.operator("cistern.choose_preset", text="Choose These Myself").preset = "CUSTOM"


class CISTERN_RENDER_PT_techniques_advanced(CisternPanel, Panel):
    bl_label = "Advanced"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_techniques"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        if context.engine != ENGINE:
            return False
        return bool(techniques.used_parameters(techniques.settings_in_force(context.scene.cistern)))

    def draw(self, context: Context) -> None:
        """The parameters of the chosen systems; beside those that count for something else, what that is."""
        layout = split_layout(self)
        settings = context.scene.cistern
        in_force = techniques_in_force(context.scene, context.view_layer)
        for parameter in techniques.used_parameters(in_force):
            row = layout.row(align=True)
            shown = techniques.effective_value(parameter, in_force)
            if parameter.is_switch and not settings.is_property_set(parameter.name):
                draw_switch_of_preset(row, settings, parameter.name, is_on=shown)
                continue
            row.prop(settings, parameter.name)
            if shown != getattr(settings, parameter.name):
                row.label(text=f"= {value_text(shown)}")


class CISTERN_RENDER_PT_cells(CisternPanel, Panel):
    bl_label = "Cells"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_techniques"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        settings = context.scene.cistern
        layout.active = techniques.works_with_cells(techniques.settings_in_force(settings))
        if not layout.active:
            draw_sentence(layout, "These techniques use no cells, or such as have their own size", context)
        for parameter in techniques.CELL_PARAMETERS:
            layout.prop(settings, parameter.name)


class CISTERN_RENDER_PT_seed(CisternPanel, Panel):
    bl_label = "Noise Pattern"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        settings = context.scene.cistern
        row = split_layout(self).row(align=True)
        row.prop(settings, "seed")
        row.prop(settings, "use_animated_seed", text="", icon="TIME")


class CISTERN_RENDER_PT_view(CisternPanel, Panel):
    bl_label = "View"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        settings = context.scene.cistern
        layout.prop(settings, "view")
        draw_sentence(layout, item_texts(view_modes.VIEW_ITEMS, settings.view)[1], context)


CLASSES = (
    CISTERN_RENDER_PT_sampling,
    CISTERN_RENDER_PT_viewport,
    CISTERN_RENDER_PT_techniques,
    CISTERN_RENDER_PT_techniques_advanced,
    CISTERN_RENDER_PT_cells,
    CISTERN_RENDER_PT_seed,
    CISTERN_RENDER_PT_view,
)
