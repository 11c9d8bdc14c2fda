"""The panels of materials and worlds, where Blender users look for them."""
# ruff: noqa: N801  (Blender wants CATEGORY_PT_name)

from bpy.types import Context, Panel

from .sync.versions import uses_nodes
from .ui_base import (
    ENGINE,
    CisternPanel,
    draw_existing,
    draw_light_group,
    draw_node_socket,
    split_layout,
)


class MaterialPanel(CisternPanel):
    bl_context = "material"

    @classmethod
    def poll(cls, context: Context) -> bool:
        material = context.material
        return context.engine == ENGINE and material is not None and not material.grease_pencil


class CISTERN_MATERIAL_PT_surface(MaterialPanel, Panel):
    bl_label = "Surface"

    def draw(self, context: Context) -> None:
        draw_node_socket(split_layout(self), context.material, "Surface", color="diffuse_color")


class MaterialSocketPanel(MaterialPanel):
    """Of a socket that nothing stands in for without nodes."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and uses_nodes(context.material)


class CISTERN_MATERIAL_PT_volume(MaterialSocketPanel, Panel):
    bl_label = "Volume"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        draw_node_socket(split_layout(self), context.material, "Volume")


class CISTERN_MATERIAL_PT_displacement(MaterialSocketPanel, Panel):
    bl_label = "Displacement"

    def draw(self, context: Context) -> None:
        draw_node_socket(split_layout(self), context.material, "Displacement")


class MaterialSettings:
    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        material = context.material
        layout.prop(material, "pass_index")
        column = layout.column()
        column.prop(material, "displacement_method", text="Displacement")
        column.prop(material, "use_transparent_shadow")
        if hasattr(material, "cycles"):  # files have it from that add-on
            draw_existing(column, material.cycles, "use_bump_map_correction")


class CISTERN_MATERIAL_PT_settings(MaterialSettings, MaterialPanel, Panel):
    pass


class CISTERN_NODE_MATERIAL_PT_settings(MaterialSettings, Panel):
    """The same beside the nodes."""

    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Options"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return MaterialPanel.poll.__func__(cls, context)


class WorldPanel(CisternPanel):
    bl_context = "world"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine == ENGINE and context.world is not None


class CISTERN_WORLD_PT_surface(WorldPanel, Panel):
    bl_label = "Surface"

    def draw(self, context: Context) -> None:
        draw_node_socket(split_layout(self), context.world, "Surface", color="color")


class CISTERN_WORLD_PT_volume(WorldPanel, Panel):
    bl_label = "Volume"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and uses_nodes(context.world)

    def draw(self, context: Context) -> None:
        draw_node_socket(split_layout(self), context.world, "Volume")


class CISTERN_WORLD_PT_mist(WorldPanel, Panel):
    bl_label = "Mist Pass"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        column = layout.column(align=True)
        column.prop(context.world.mist_settings, "start")
        column.prop(context.world.mist_settings, "depth")
        layout.prop(context.world.mist_settings, "falloff")


class CISTERN_WORLD_PT_ambient_occlusion(WorldPanel, Panel):
    """Of the pass, of baking it, and of nodes that have no distance of their own."""

    bl_label = "Ambient Occlusion"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        split_layout(self).prop(context.world.light_settings, "distance")


class CISTERN_WORLD_PT_ray_visibility(WorldPanel, Panel):
    """The settings of Cycles' add-on, which files have them from."""

    bl_label = "Ray Visibility"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and hasattr(context.world, "cycles_visibility")

    def draw(self, context: Context) -> None:
        column = split_layout(self).column()
        for kind in ("camera", "diffuse", "glossy", "transmission", "scatter"):
            column.prop(context.world.cycles_visibility, kind)


class CISTERN_WORLD_PT_settings(WorldPanel, Panel):
    """The same of how light samples look for the world."""

    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and hasattr(context.world, "cycles")

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        settings = context.world.cycles
        layout.prop(settings, "sampling_method", text="Sampling")
        row = layout.row()
        row.active = settings.sampling_method == "MANUAL"
        row.prop(settings, "sample_map_resolution")


class CISTERN_WORLD_PT_light_group(WorldPanel, Panel):
    bl_label = "Light Group"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        draw_light_group(split_layout(self), context.world, context.view_layer)


CLASSES = (
    CISTERN_MATERIAL_PT_surface,
    CISTERN_MATERIAL_PT_volume,
    CISTERN_MATERIAL_PT_displacement,
    CISTERN_MATERIAL_PT_settings,
    CISTERN_NODE_MATERIAL_PT_settings,
    CISTERN_WORLD_PT_surface,
    CISTERN_WORLD_PT_volume,
    CISTERN_WORLD_PT_mist,
    CISTERN_WORLD_PT_ambient_occlusion,
    CISTERN_WORLD_PT_ray_visibility,
    CISTERN_WORLD_PT_settings,
    CISTERN_WORLD_PT_light_group,
)
