"""The properties editor, tab by tab, with all our panels open: one that cannot be drawn says so in the log."""

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver
from driver import say, screenshot

from addon import ui

TABS = (
    ("RENDER", "Cube"),
    ("VIEW_LAYER", "Cube"),
    ("WORLD", "Cube"),
    ("OBJECT", "Cube"),
    ("MODIFIER", "Cube"),
    ("MATERIAL", "Cube"),
    ("DATA", "Light"),
    ("DATA", "Panel"),
    ("DATA", "Camera"),
)


def scenario() -> Iterator[float]:
    bpy.context.scene.render.engine = "CISTERN"
    bpy.data.objects["Camera"].data.type = "PANO"
    driver.subdivide(bpy.data.objects["Cube"])
    open_all_panels()
    panel = bpy.data.objects.new("Panel", bpy.data.lights.new("Panel", "AREA"))
    bpy.context.scene.collection.objects.link(panel)
    area = driver.view3d()
    area.type = "PROPERTIES"
    for tab, name in TABS:
        bpy.context.view_layer.objects.active = bpy.data.objects[name]
        yield 0.5
        area.spaces.active.context = tab
        yield 0.5
        screenshot(f"{tab.lower()}_{name.lower()}")
        say("DONE", tab, name)
    yield from beside_nodes(area)


def beside_nodes(area: bpy.types.Area) -> Iterator[float]:
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    area.ui_type = "ShaderNodeTree"
    area.spaces.active.show_region_ui = True
    yield 0.5
    next(region for region in area.regions if region.type == "UI").active_panel_category = "Options"
    area.tag_redraw()
    yield 0.5
    screenshot("nodes")


def open_all_panels() -> None:
    ui.unregister()
    for cls in ui.CLASSES:
        cls.bl_options = set(getattr(cls, "bl_options", ())) - {"DEFAULT_CLOSED"}
    ui.register()


driver.start(scenario)
