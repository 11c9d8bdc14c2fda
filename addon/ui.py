"""Panels of the render and of view layers, and Blender's own panels opened for our engine."""
# ruff: noqa: N801  (Blender wants CATEGORY_PT_name)

import bpy
from bl_ui import properties_view_layer
from bpy.types import Context, Panel

from . import ui_bake, ui_data, ui_sampling, ui_shading, ui_subdivision, ui_viewport
from .ui_base import ENGINE, CisternPanel, draw_existing, split_layout

# Blender's general panels that would show settings of other engines, or of features that this engine does not have;
# ours below take the place of those for lights, visibility and simplification, which would be the topmost.
EXCLUDED_PANELS = frozenset(
    {
        "DATA_PT_light",
        "DATA_PT_lightprobe",
        "DATA_PT_lightprobe_display",
        "DATA_PT_lightprobe_parallax",
        "DATA_PT_lightprobe_visibility",
        "DATA_PT_spot",
        "NODE_DATA_PT_light",
        "NODE_DATA_PT_spot",
        "OBJECT_PT_visibility",
        "RENDER_PT_simplify",
        "RENDER_PT_simplify_greasepencil",
        "RENDER_PT_simplify_render",
        "RENDER_PT_simplify_viewport",
    }
)
CURVE_PRESETS = (
    ("SMOOTH", "SMOOTHCURVE"),
    ("ROUND", "SPHERECURVE"),
    ("ROOT", "ROOTCURVE"),
    ("SHARP", "SHARPCURVE"),
    ("LINE", "LINCURVE"),
    ("MAX", "NOCURVE"),
)  # shapes of shutter curves, and their icons

# Panels that Blender keeps for its own engines although nothing in them belongs to one.
INCLUDED_PANELS = frozenset(
    {
        "DATA_PT_camera_dof",
        "DATA_PT_camera_dof_aperture",
        "EEVEE_MATERIAL_PT_context_material",
        "MATERIAL_PT_preview",
        "DATA_PT_preview",
        "VIEWLAYER_PT_override",
    }
)


class CISTERN_RENDER_PT_light_paths(CisternPanel, Panel):
    bl_label = "Light Paths"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        settings = context.scene.cistern
        column = layout.column(align=True)
        column.prop(settings, "max_bounces")
        for kind in ("diffuse", "glossy", "transmission", "volume", "transparent"):
            column.prop(settings, f"max_{kind}_bounces")
        layout.prop(settings, "min_bounces")


class CISTERN_RENDER_PT_clamping(CisternPanel, Panel):
    bl_label = "Clamping"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_light_paths"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        column = split_layout(self).column(align=True)
        column.prop(context.scene.cistern, "clamp_direct")
        column.prop(context.scene.cistern, "clamp_indirect")


class CISTERN_RENDER_PT_caustics(CisternPanel, Panel):
    bl_label = "Caustics"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_light_paths"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        settings = context.scene.cistern
        layout.prop(settings, "filter_glossy")
        column = layout.column(align=True)
        column.prop(settings, "caustics_reflective")
        column.prop(settings, "caustics_refractive")


class CISTERN_RENDER_PT_film(CisternPanel, Panel):
    bl_label = "Film"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        settings = context.scene.cistern
        layout.prop(settings, "film_exposure")
        layout.prop(settings, "pixel_filter")
        row = layout.row()
        row.active = settings.pixel_filter != "BOX"
        row.prop(settings, "filter_width")
        layout.prop(context.scene.render, "film_transparent", text="Transparent")
        row = layout.row()
        row.active = context.scene.render.film_transparent
        row.prop(settings, "film_transparent_glass")


class CISTERN_RENDER_PT_motion_blur(CisternPanel, Panel):
    bl_label = "Motion Blur"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        render = context.scene.render
        layout.active = render.use_motion_blur
        layout.prop(render, "motion_blur_position", text="Position")
        layout.prop(render, "motion_blur_shutter")


class CISTERN_RENDER_PT_shutter_curve(CisternPanel, Panel):
    bl_label = "Shutter Curve"
    bl_context = "render"
    bl_parent_id = "CISTERN_RENDER_PT_motion_blur"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = self.layout
        render = context.scene.render
        layout.active = render.use_motion_blur
        layout.template_curve_mapping(render, "motion_blur_shutter_curve")
        row = layout.row(align=True)
        for shape, icon in CURVE_PRESETS:
            row.operator("render.shutter_curve_preset", icon=icon, text="").shape = shape


class CISTERN_RENDER_PT_performance(CisternPanel, Panel):
    bl_label = "Performance"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        render = context.scene.render
        layout.prop(render, "threads_mode")
        row = layout.row()
        row.enabled = render.threads_mode == "FIXED"
        row.prop(render, "threads")
        layout.prop(render, "use_persistent_data", text="Persistent Data")


class CISTERN_RENDER_PT_simplify(CisternPanel, Panel):
    bl_label = "Simplify"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.scene.render, "use_simplify", text="")

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        render = context.scene.render
        layout.active = render.use_simplify
        for name, text in (("subdivision", "Max Subdivision"), ("child_particles", "Child Particles")):
            column = layout.column(align=True)
            column.prop(render, f"simplify_{name}", text=text)
            column.prop(render, f"simplify_{name}_render", text="Render")


class CISTERN_VIEWLAYER_PT_filter(CisternPanel, Panel):
    bl_label = "Filter"
    bl_context = "view_layer"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        layer = context.view_layer
        column = layout.column(heading="Include")
        column.prop(layer, "use_sky", text="Environment")
        column.prop(layer, "use_solid", text="Surfaces")
        column.prop(layer, "use_strand", text="Curves")
        column.prop(layer, "use_volumes", text="Volumes")
        draw_existing(column, layer, "use_grease_pencil", text="Grease Pencil")
        column = layout.column(heading="Use")
        column.active = context.scene.render.use_motion_blur
        draw_existing(column, layer, "use_motion_blur")
        if hasattr(layer, "cycles"):
            column = layout.column()
            column.active = context.scene.cistern.use_denoising
            column.prop(layer.cycles, "use_denoising")


class CISTERN_VIEWLAYER_PT_passes(CisternPanel, Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        view_layer = context.view_layer
        column = layout.column(heading="Data")
        for name in ("z", "mist", "position", "normal", "vector", "uv"):
            column.prop(view_layer, f"use_pass_{name}")
        draw_existing(column, view_layer, "use_pass_grease_pencil", text="Grease Pencil")
        column.prop(view_layer.cistern, "use_pass_denoising_albedo")
        column.prop(view_layer.cistern, "use_pass_denoising_normal")
        column.prop(view_layer.cistern, "use_pass_noisy")
        column.prop(view_layer.cistern, "use_pass_sample_count")
        column = layout.column(heading="Indexes")
        column.prop(view_layer, "use_pass_object_index")
        column.prop(view_layer, "use_pass_material_index")
        column = layout.column(heading="Reuse")
        for name in ("cells", "cell_occupancy", "cell_level", "normal_bin"):
            column.prop(view_layer.cistern, f"use_pass_{name}")
        for name in ("reservoir_confidence", "reservoir_weight", "reuse_count"):
            column.prop(view_layer.cistern, f"use_pass_{name}")
        column = layout.column(heading="Learned")
        for name in ("light_choice_entropy", "light_choice_samples", "guided"):
            column.prop(view_layer.cistern, f"use_pass_{name}")


class CISTERN_VIEWLAYER_PT_passes_light(CisternPanel, Panel):
    bl_label = "Light"
    bl_context = "view_layer"
    bl_parent_id = "CISTERN_VIEWLAYER_PT_passes"

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        view_layer = context.view_layer
        column = layout.column(heading="All", align=True)
        column.prop(view_layer.cistern, "use_pass_direct")
        column.prop(view_layer.cistern, "use_pass_indirect")
        for kind in ("Diffuse", "Glossy", "Transmission"):
            column = layout.column(heading=kind, align=True)
            for part in ("Direct", "Indirect", "Color"):
                column.prop(view_layer, f"use_pass_{kind.lower()}_{part.lower()}", text=part)
        column = layout.column(heading="Volume", align=True)
        column.prop(view_layer.cistern, "use_pass_volume_direct", text="Direct")
        column.prop(view_layer.cistern, "use_pass_volume_indirect", text="Indirect")
        column = layout.column(heading="Other", align=True)
        column.prop(view_layer, "use_pass_emit", text="Emission")
        column.prop(view_layer, "use_pass_environment")
        column.prop(view_layer, "use_pass_ambient_occlusion", text="Ambient Occlusion")
        column.prop(view_layer.cistern, "use_pass_shadow_catcher")


def blenders_panel(name: str) -> type:
    """One that Blender draws for all engines alike; before 4.5 under a shorter name."""
    return getattr(properties_view_layer, f"{name}Helper", None) or getattr(properties_view_layer, name)


class CISTERN_VIEWLAYER_PT_passes_aov(CisternPanel, blenders_panel("ViewLayerAOVPanel"), Panel):
    bl_label = "Shader AOV"
    bl_context = "view_layer"
    bl_parent_id = "CISTERN_VIEWLAYER_PT_passes"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012


class CISTERN_VIEWLAYER_PT_passes_cryptomatte(CisternPanel, blenders_panel("ViewLayerCryptomattePanel"), Panel):
    bl_label = "Cryptomatte"
    bl_context = "view_layer"
    bl_parent_id = "CISTERN_VIEWLAYER_PT_passes"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012


class CISTERN_VIEWLAYER_PT_passes_lightgroups(CisternPanel, blenders_panel("ViewLayerLightgroupsPanel"), Panel):
    bl_label = "Light Groups"
    bl_context = "view_layer"
    bl_parent_id = "CISTERN_VIEWLAYER_PT_passes"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012


def shared_panels() -> list[type[Panel]]:
    """Blender's panels that also make sense for our engine."""
    found = []
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if not isinstance(engines, set):  # as some add-ons have it
            continue
        is_general = "BLENDER_RENDER" in engines and panel.__name__ not in EXCLUDED_PANELS
        if is_general or panel.__name__ in INCLUDED_PANELS:
            found.append(panel)
    return found


CLASSES = (
    *ui_sampling.CLASSES,
    CISTERN_RENDER_PT_light_paths,
    CISTERN_RENDER_PT_clamping,
    CISTERN_RENDER_PT_caustics,
    CISTERN_RENDER_PT_film,
    CISTERN_RENDER_PT_motion_blur,
    CISTERN_RENDER_PT_shutter_curve,
    CISTERN_RENDER_PT_simplify,
    *ui_subdivision.CLASSES,
    CISTERN_RENDER_PT_performance,
    *ui_bake.CLASSES,
    CISTERN_VIEWLAYER_PT_passes,
    CISTERN_VIEWLAYER_PT_passes_light,
    CISTERN_VIEWLAYER_PT_passes_cryptomatte,
    CISTERN_VIEWLAYER_PT_passes_aov,
    CISTERN_VIEWLAYER_PT_passes_lightgroups,
    CISTERN_VIEWLAYER_PT_filter,
    *ui_shading.CLASSES,
    *ui_data.CLASSES,
    *ui_viewport.CLASSES,
)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for panel in shared_panels():
        panel.COMPAT_ENGINES.add(ENGINE)
    ui_viewport.register()


def unregister() -> None:
    ui_viewport.unregister()
    for panel in shared_panels():
        panel.COMPAT_ENGINES.discard(ENGINE)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
