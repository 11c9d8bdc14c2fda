"""The panels of lamps, cameras and objects, where Blender users look for them."""
# ruff: noqa: N801  (Blender wants CATEGORY_PT_name)

import bpy
from bpy.types import Context, Panel, UILayout

from .ui_base import ENGINE, CisternPanel, draw_existing, draw_light_group, draw_node_socket, split_layout

GEOMETRY_TYPES = frozenset({"MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD"})
VISIBLE_TYPES = GEOMETRY_TYPES | {"VOLUME"}
HAS_SHADING_PANEL = bpy.app.version >= (4, 3, 0)  # of objects, for all engines
EMITTER_TYPES = frozenset({"LIGHT", "VOLUME", "EMPTY"})  # and what instances emitters
# Settings of panoramic cameras and their names, those that belong together in one box.
FISHEYE_FOV = {"fisheye_fov": "Field of View"}
PANORAMA_SETTINGS = {
    "FISHEYE_EQUIDISTANT": [FISHEYE_FOV],
    "FISHEYE_EQUISOLID": [{"fisheye_lens": "Lens"}, FISHEYE_FOV],
    "FISHEYE_LENS_POLYNOMIAL": [FISHEYE_FOV, {f"fisheye_polynomial_k{power}": f"K{power}" for power in range(5)}],
    "EQUIRECTANGULAR": [
        {"latitude_min": "Latitude Min", "latitude_max": "Max"},
        {"longitude_min": "Longitude Min", "longitude_max": "Max"},
    ],
    "CENTRAL_CYLINDRICAL": [
        {"central_cylindrical_range_v_min": "Height Min", "central_cylindrical_range_v_max": "Max"},
        {"central_cylindrical_range_u_min": "Longitude Min", "central_cylindrical_range_u_max": "Max"},
        {"central_cylindrical_radius": "Cylinder Radius"},
    ],
}
BLURRED_TYPES = VISIBLE_TYPES | {"EMPTY", "CAMERA"}


class CISTERN_CAMERA_PT_panorama(CisternPanel, Panel):
    """Blender's own panel of the lens shows these with Cycles alone."""

    bl_label = "Panorama"
    bl_context = "data"
    bl_parent_id = "DATA_PT_lens"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine == ENGINE and context.camera is not None and context.camera.type == "PANO"

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        camera = context.camera
        layout.prop(camera, "panorama_type")
        for names in PANORAMA_SETTINGS.get(camera.panorama_type, ()):
            column = layout.column(align=True)
            for name, text in names.items():
                column.prop(camera, name, text=text)


class LightPanel(CisternPanel):
    bl_context = "data"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine == ENGINE and context.light is not None


class CISTERN_LIGHT_PT_light(LightPanel, Panel):
    bl_label = "Light"

    def draw(self, context: Context) -> None:
        light = context.light
        self.layout.row().prop(light, "type", expand=True)
        layout = split_layout(self)
        column = layout.column()
        draw_temperature(column, light)
        draw_existing(column, light, "color", "energy", "exposure", "normalize")
        draw_light_shape(layout.column(), light)
        layout.prop(shadow_owner(light), shadow_property(light), text="Cast Shadow")


class CISTERN_LIGHT_PT_beam_shape(LightPanel, Panel):
    bl_label = "Beam Shape"
    bl_parent_id = "CISTERN_LIGHT_PT_light"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and context.light.type in {"SPOT", "AREA"}

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        light = context.light
        if light.type == "AREA":
            layout.prop(light, "spread")
            return
        layout.prop(light, "spot_size", text="Angle")
        layout.prop(light, "spot_blend", text="Blend", slider=True)
        layout.prop(light, "show_cone")


class CISTERN_LIGHT_PT_settings(LightPanel, Panel):
    """Those of Cycles' add-on, which files have them from."""

    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and hasattr(context.light, "cycles")

    def draw(self, context: Context) -> None:
        layout, light = split_layout(self), context.light
        is_area = light.type == "AREA"
        emission = layout.column()
        emission.active = not (is_area and light.cycles.is_portal)
        emission.prop(light.cycles, "max_bounces")
        emission.prop(light.cycles, "use_multiple_importance_sampling", text="Multiple Importance")
        if is_area:
            layout.prop(light.cycles, "is_portal", text="Portal")


class CISTERN_LIGHT_PT_nodes(LightPanel, Panel):
    bl_label = "Nodes"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Context) -> None:
        light = context.light
        self.layout.prop(light, "use_nodes", icon="NODETREE")
        if light.use_nodes:
            draw_node_socket(split_layout(self), light, "Surface")


def is_visible(obj: bpy.types.Object) -> bool:
    """Whether rays may see it, or what it instances."""
    is_instancer = obj.instance_type == "COLLECTION" and obj.instance_collection is not None
    return obj.type in VISIBLE_TYPES or is_instancer


class CISTERN_OBJECT_PT_visibility(CisternPanel, Panel):
    bl_label = "Visibility"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine == ENGINE and context.object is not None

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        obj = context.object
        layout.prop(obj, "hide_select", text="Selectable", toggle=False, invert_checkbox=True)
        draw_existing(layout, obj, "hide_surface_pick", text="Surface Picking", toggle=False, invert_checkbox=True)
        column = layout.column(heading="Show In")
        column.prop(obj, "hide_viewport", text="Viewports", toggle=False, invert_checkbox=True)
        column.prop(obj, "hide_render", text="Renders", toggle=False, invert_checkbox=True)
        if is_visible(obj):
            column = layout.column(heading="Mask")
            column.prop(obj, "is_holdout")
            column.prop(obj, "is_shadow_catcher")


class CISTERN_OBJECT_PT_ray_visibility(CisternPanel, Panel):
    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_parent_id = "CISTERN_OBJECT_PT_visibility"

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        return context.engine == ENGINE and obj is not None and (obj.type == "LIGHT" or is_visible(obj))

    def draw(self, context: Context) -> None:
        column = split_layout(self).column()
        obj = context.object
        for kind in ("camera", "diffuse", "glossy", "transmission"):
            column.prop(obj, f"visible_{kind}", text=kind.capitalize())
        column.prop(obj, "visible_volume_scatter", text="Volume Scatter")
        if obj.type != "LIGHT":
            column.prop(obj, "visible_shadow", text="Shadow")


class CISTERN_OBJECT_PT_motion_blur(CisternPanel, Panel):
    """The settings of Cycles' add-on, which files have them from."""

    bl_label = "Motion Blur"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        return context.engine == ENGINE and getattr(obj, "type", None) in BLURRED_TYPES and hasattr(obj, "cycles")

    def draw_header(self, context: Context) -> None:
        self.layout.active = context.scene.render.use_motion_blur
        self.layout.prop(context.object.cycles, "use_motion_blur", text="")

    def draw(self, context: Context) -> None:
        layout = split_layout(self)
        obj = context.object
        layout.active = context.scene.render.use_motion_blur and obj.cycles.use_motion_blur
        layout.prop(obj.cycles, "motion_steps", text="Steps")
        if obj.type != "CAMERA":
            layout.prop(obj.cycles, "use_deform_motion", text="Deformation")


class CISTERN_OBJECT_PT_light_group(CisternPanel, Panel):
    bl_label = "Light Group"
    bl_context = "object"
    if HAS_SHADING_PANEL:
        bl_parent_id = "OBJECT_PT_shading"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        return context.engine == ENGINE and obj is not None and obj.type in GEOMETRY_TYPES | EMITTER_TYPES

    def draw(self, context: Context) -> None:
        draw_light_group(split_layout(self), context.object, context.view_layer)


class LinkingPanel(CisternPanel):
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        return context.engine == ENGINE and obj is not None and obj.type in GEOMETRY_TYPES | {"LIGHT"}


class CISTERN_OBJECT_PT_light_linking(LinkingPanel, Panel):
    bl_label = "Light Linking"

    def draw(self, context: Context) -> None:
        draw_linking(split_layout(self), context.object, "receiver")


class CISTERN_OBJECT_PT_shadow_linking(LinkingPanel, Panel):
    bl_label = "Shadow Linking"

    def draw(self, context: Context) -> None:
        draw_linking(split_layout(self), context.object, "blocker")


# From 4.3 on Blender has these for all engines.
LINKING_PANELS = (CISTERN_OBJECT_PT_light_linking, CISTERN_OBJECT_PT_shadow_linking)
HAS_LINKING_PANELS = bpy.app.version >= (4, 3, 0)


def draw_linking(layout: UILayout, obj: bpy.types.Object, role: str) -> None:
    """The collection of what an object lights ("receiver"), or of what casts shadows from its light ("blocker")."""
    name = f"{role}_collection"
    layout.template_ID(obj.light_linking, name, new=f"object.light_linking_{role}_collection_new")
    if getattr(obj.light_linking, name) is None:
        return
    row = layout.row()
    row.column().template_light_linking_collection(row, obj.light_linking, name)
    buttons = row.column(align=True)
    buttons.operator(f"object.light_linking_{role}s_link", icon="ADD", text="").link_state = "INCLUDE"
    buttons.operator("object.light_linking_unlink_from_collection", icon="REMOVE", text="")
    buttons.operator(f"object.light_linking_{role}s_select", icon="RESTRICT_SELECT_OFF", text="")


def draw_temperature(layout: UILayout, light: bpy.types.Light) -> None:
    """From Blender 4.5 on; grey where it is not used."""
    draw_existing(layout, light, "use_temperature")
    row = layout.row()
    row.active = getattr(light, "use_temperature", False)
    draw_existing(row, light, "temperature")


def draw_light_shape(layout: UILayout, light: bpy.types.Light) -> None:
    if light.type == "SUN":
        layout.prop(light, "angle")
    elif light.type == "AREA":
        layout.prop(light, "shape")
        if light.shape in {"RECTANGLE", "ELLIPSE"}:
            layout.prop(light, "size", text="Size X")
            layout.prop(light, "size_y", text="Y")
        else:
            layout.prop(light, "size")
    else:
        layout.prop(light, "shadow_soft_size", text="Radius")
        layout.prop(light, "use_soft_falloff")


def shadow_owner(light: bpy.types.Light) -> bpy.types.bpy_struct:
    """Where the shadow switch lives: with Cycles' settings while that has one (4.2), else on the light itself."""
    cycles = getattr(light, "cycles", None)
    return cycles if hasattr(cycles, "cast_shadow") else light


def shadow_property(light: bpy.types.Light) -> str:
    return "use_shadow" if shadow_owner(light) is light else "cast_shadow"


CLASSES = (
    CISTERN_CAMERA_PT_panorama,
    CISTERN_LIGHT_PT_light,
    CISTERN_LIGHT_PT_beam_shape,
    CISTERN_LIGHT_PT_settings,
    CISTERN_LIGHT_PT_nodes,
    CISTERN_OBJECT_PT_visibility,
    CISTERN_OBJECT_PT_ray_visibility,
    CISTERN_OBJECT_PT_motion_blur,
    CISTERN_OBJECT_PT_light_group,
    *(() if HAS_LINKING_PANELS else LINKING_PANELS),
)
