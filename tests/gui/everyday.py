"""What people do in a viewport: orbit, light, move, edit, undo, delete, look at cells, resize, render, load another
file."""

import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
from mathutils import Quaternion

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driver
from driver import in_view3d, pictures, push_undo, say, screenshot, wait_for_picture, wait_until


def scenario() -> Iterator[float]:
    yield from first_picture()
    yield from orbit()
    yield from projections()
    yield from local_views()
    yield from lighting()
    yield from panorama()
    yield from shadow_catcher()
    yield from edits()
    yield from undo_and_redo()
    yield from subdivision()
    yield from delete()
    yield from edit_mesh()
    yield from cell_views()
    yield from denoising()
    yield from border()
    yield from pause()
    yield from resize()
    yield from final_render_meanwhile()
    yield from load_another_file()


def first_picture() -> Iterator[float]:
    scene = bpy.context.scene
    scene.render.engine = "CISTERN"
    scene.render.preview_pixel_size = "2"  # software display: four times fewer pixels
    floor()
    push_undo("begin")
    driver.shade("RENDERED")
    yield from wait_for_picture(0, "first picture")
    yield from wait_until(lambda: driver.finest()[0] > 200, "first sharp picture")
    yield 0.5
    screenshot("first")


def floor() -> None:
    with in_view3d():
        bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    cube = bpy.data.objects["Cube"]
    material = cube.active_material
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.1, 0.05, 1.0)


def newest() -> np.ndarray:
    [render] = [render for render in driver.renders() if render.picture is not None]
    return render.picture.pixels


def redness() -> float:
    """Share of pixels that are clearly red."""
    pixels = newest()
    return float(np.mean(pixels[..., 0] > 3.0 * pixels[..., 2]))


def colour() -> float:
    """Share of pixels that are clearly not grey."""
    rgb = newest()[..., :3]
    return float(np.mean(np.ptp(rgb, axis=-1) > 0.5 * rgb.max(axis=-1)))


def orbit() -> Iterator[float]:
    region = driver.space().region_3d
    seen = pictures()
    for _ in range(20):
        region.view_rotation = Quaternion((0.0, 0.0, 1.0), math.radians(4.0)) @ region.view_rotation
        yield 0.05
    driver.expect(pictures() > seen + 2, f"orbit: {pictures() - seen} pictures in 20 steps")
    yield from settle("orbit")


def settle(name: str) -> Iterator[float]:
    """Wait for a picture of what is shown now, look that nothing went wrong, and take a screenshot."""
    yield 0.2
    yield from wait_for_picture(pictures(), name)
    yield 1.0
    driver.expect_no_error(name)
    screenshot(name)
    say("DONE", name)


def projections() -> Iterator[float]:
    region = driver.space().region_3d
    region.view_perspective = "ORTHO"
    yield from settle("orthographic")
    region.view_perspective = "CAMERA"
    yield from settle("camera")
    camera = bpy.context.scene.camera.data
    camera.shift_x, camera.dof.use_dof, camera.dof.focus_distance, camera.dof.aperture_fstop = 0.1, True, 11.0, 0.2
    yield from settle("camera_shift_dof")
    camera.passepartout_alpha = 1.0
    yield from settle("camera_passepartout")
    camera.shift_x, camera.dof.use_dof, camera.passepartout_alpha = 0.0, False, 0.5
    driver.press("KP_0")
    yield 1.0
    driver.space().region_3d.view_perspective = "PERSP"
    yield from settle("perspective_again")


def local_views() -> Iterator[float]:
    """The cube alone, by its view or its collection; then both hidden by their kinds."""
    before = redness()
    driver.expect(before > 0.01, "the cube is seen")
    plane, cube = bpy.data.objects["Plane"], bpy.data.objects["Cube"]
    for obj, is_chosen in ((plane, False), (cube, True)):
        obj.select_set(is_chosen)
    bpy.context.scene.render.film_transparent = True
    with in_view3d():
        bpy.ops.view3d.localview(frame_selected=False)
    yield from settle("local_view")
    driver.expect(redness() > 0.5 * before, f"the cube is in its local view: {redness():.3f}, before {before:.3f}")
    driver.expect(bool(np.mean(newest()[..., 3] > 0.01) < 0.5), "the plane is not")
    bpy.context.scene.render.film_transparent = False
    with in_view3d():
        bpy.ops.view3d.localview(frame_selected=False)
    yield from settle("after_local_view")
    driver.space().use_local_collections = True
    yield from settle("local_collections")
    driver.expect(redness() > 0.5 * before, f"collections are shown in their view: {redness():.3f}")
    driver.space().use_local_collections = False
    driver.space().show_object_viewport_mesh = False
    yield from settle("without_meshes")
    driver.expect(redness() < 0.1 * before, "meshes are hidden")
    driver.space().show_object_viewport_mesh = True
    yield from settle("with_meshes_again")


def lighting() -> Iterator[float]:
    """Without the scene's lamp, by a picture of the sky in place of its world, and as before."""

    def brightness() -> float:
        return float(newest()[..., :3].mean())

    shading, before = driver.space().shading, brightness()
    shading.use_scene_lights_render = False
    yield from settle("without_lamps")
    driver.expect(brightness() < 0.7 * before, f"without lamps it is darker: {brightness():.3f}, before {before:.3f}")
    shading.use_scene_world_render = False
    yield from settle("studio_light")
    lit = newest().copy()
    driver.expect(bool(lit[..., :3].mean() > 0.1 * before), f"a studio light shines: {lit[..., :3].mean():.3f}")
    shading.studiolight_rotate_z = 2.0
    yield from settle("studio_light_turned")
    driver.expect(bool(np.abs(newest() - lit).mean() > 0.01 * lit.mean()), "it shines from elsewhere")
    shading.use_scene_lights_render = shading.use_scene_world_render = True
    yield from settle("lighting_of_the_scene")
    driver.expect(abs(brightness() / before - 1.0) < 0.1, f"as before: {brightness():.3f}, before {before:.3f}")


def panorama() -> Iterator[float]:
    region = driver.space().region_3d
    region.view_perspective = "CAMERA"
    camera = bpy.context.scene.camera.data
    camera.type, camera.panorama_type = "PANO", "EQUIRECTANGULAR"
    yield from settle("camera_panorama")
    left, bottom, right, top = shown().place
    driver.expect((right - left) * (top - bottom) < 0.9, "the panorama is in the camera's frame alone")
    camera.type, region.view_perspective = "PERSP", "PERSP"
    yield from settle("perspective_after_panorama")


def shadow_catcher() -> Iterator[float]:
    scene, plane = bpy.context.scene, bpy.data.objects["Plane"]
    plane.is_shadow_catcher, scene.render.film_transparent = True, True
    yield from settle("shadow_catcher")
    alpha = newest()[..., 3]
    driver.expect(np.mean(alpha < 0.01) > 0.2 and np.mean(alpha > 0.9) > 0.01, "all but cube and shadow lets through")
    scene.render.film_transparent = False
    yield from settle("shadow_catcher_before_world")
    driver.expect(bool(np.all(newest()[..., 3] > 0.99)), "the world is behind")
    plane.is_shadow_catcher = False
    yield from settle("without_shadow_catcher")


def edits() -> Iterator[float]:
    cube = bpy.data.objects["Cube"]
    for step in range(10):
        cube.location.x = 0.1 * step
        yield 0.05
    push_undo("move")
    yield from settle("moved")
    bpy.data.lights["Light"].energy = 3000.0
    push_undo("light")
    yield from settle("light")
    driver.expect(redness() > 0.01, "the cube is red")
    color = cube.active_material.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    color.default_value = (0.05, 0.1, 0.8, 1.0)
    push_undo("material")
    yield from settle("material")
    driver.expect(redness() < 0.001, "the cube is blue")


def undo_and_redo() -> Iterator[float]:
    driver.press("ctrl+z")
    yield 1.0
    yield from settle("undone")
    driver.expect(redness() > 0.01, "the cube is red again")
    driver.press("ctrl+shift+z")
    yield 1.0
    yield from settle("redone")
    driver.expect(redness() < 0.001, "the cube is blue again")


def subdivision() -> Iterator[float]:
    cube = bpy.data.objects["Cube"]
    share = colour()
    driver.subdivide(cube)
    yield from settle("adaptive_subdivision")
    driver.expect(0.1 * share < colour() < 0.7 * share, f"the cube is a ball: {colour() / share} of its pixels")
    cube.modifiers.clear()
    yield from settle("without_subdivision")
    driver.expect(colour() > 0.9 * share, "the cube is a cube again")


def delete() -> Iterator[float]:
    before = newest()
    with in_view3d():
        bpy.ops.object.select_all("EXEC_DEFAULT", True, action="DESELECT")
        bpy.data.objects["Cube"].select_set(True)
        bpy.ops.object.delete("EXEC_DEFAULT", True)
    yield from settle("deleted")
    driver.expect("Cube" not in bpy.data.objects, "the cube is gone")
    driver.expect(newest().shape != before.shape or not np.allclose(newest(), before, atol=0.1), "the picture changed")
    driver.press("ctrl+z")
    yield from wait_until(lambda: "Cube" in bpy.data.objects, "undo of the deletion")
    yield from settle("undeleted")


def edit_mesh() -> Iterator[float]:
    with in_view3d():
        bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
        bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode="EDIT")
        bpy.ops.mesh.select_all("EXEC_DEFAULT", True, action="SELECT")
        bpy.ops.mesh.subdivide("EXEC_DEFAULT", True, number_cuts=3, fractal=2.0)
    yield from settle("edit_mode")
    with in_view3d():
        bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode="OBJECT")
    yield from settle("edited")


def cell_views() -> Iterator[float]:
    settings = bpy.context.scene.cistern
    region = driver.space().region_3d
    for view in (
        "CELLS",
        "CELL_OCCUPANCY",
        "CELL_LEVEL",
        "NORMAL_BIN",
        "RESERVOIR_CONFIDENCE",
        "RESERVOIR_WEIGHT",
        "REUSE_COUNT",
        "DIRECT",
        "INDIRECT",
    ):
        settings.viewport_view = view
        driver.redraw()
        for _ in range(3):
            region.view_rotation = Quaternion((0.0, 0.0, 1.0), math.radians(5.0)) @ region.view_rotation
            yield 0.05
        yield from settle(f"view_{view.lower()}")
    settings.viewport_view = "COMBINED"
    yield from settle("view_combined")


def shown() -> object:
    [picture] = [render.picture for render in driver.renders() if render.picture is not None]
    return picture


def denoising() -> Iterator[float]:
    """Of what stands still, of a turning view, and none any more. A Blender without the library says so."""
    settings = bpy.context.scene.cistern
    region = driver.space().region_3d
    region.view_perspective = "PERSP"
    settings.use_viewport_denoising = True
    driver.redraw()
    [render] = driver.renders()
    yield from wait_until(lambda: shown().denoised is not None or render.warnings, "a denoised picture")
    yield from settle("denoised")
    if not render.warnings:
        for _ in range(20):
            region.view_rotation = Quaternion((0.0, 0.0, 1.0), math.radians(4.0)) @ region.view_rotation
            yield 0.05
        screenshot("turning_denoised")
        yield from wait_until(lambda: shown().denoised is not None and shown().denoised[1] >= 4, "it again")
    settings.use_viewport_denoising = False
    driver.redraw()
    yield from settle("not_denoised")
    driver.expect(shown().denoised is None and not render.warnings, "denoising is off")


def border() -> Iterator[float]:
    space = driver.space()
    space.render_border_min_x, space.render_border_max_x = 0.25, 0.75
    space.render_border_min_y, space.render_border_max_y = 0.25, 0.75
    space.use_render_border = True
    driver.redraw()
    yield from settle("border")
    driver.expect(driver.finest()[0] < 0.6 * driver.view3d().width, "the border bounds the picture")
    space.use_render_border = False
    driver.redraw()
    yield from settle("without_border")


def pause() -> Iterator[float]:
    settings = bpy.context.scene.cistern
    settings.viewport_pause = True
    driver.redraw()
    yield 1.0
    seen = pictures()
    yield 1.5
    driver.expect(pictures() == seen, "paused, yet there are new pictures")
    settings.viewport_pause = False
    driver.redraw()
    yield from settle("unpaused")


def resize() -> Iterator[float]:
    for size in ("900 600", "1280 800"):
        subprocess.Popen(f"xdotool search --onlyvisible --class blender windowsize {size}", shell=True)
        yield 1.5
        yield from settle(f"resized_{size.split()[0]}")


def final_render_meanwhile() -> Iterator[float]:
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.cistern.samples = 320, 180, 16
    addon_reports = driver.addon.report.last
    before = len(addon_reports)
    with in_view3d():
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield 0.2
    for _ in range(5):
        bpy.data.objects["Cube"].location.y += 0.1
        yield 0.1
    yield from wait_until(lambda: not bpy.app.is_job_running("RENDER"), "final render", 120.0)
    yield 1.0  # until which Blender may not let a file be saved
    driver.expect(len(addon_reports) == before + 1 and addon_reports[-1].error is None, f"reports {addon_reports}")
    driver.expect_no_error("final render")
    screenshot("final_render")


def load_another_file() -> Iterator[float]:
    path = driver.OUT / "other.blend"
    with in_view3d():
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.data.objects["Cube"].location.z += 1.0
    yield 0.3
    before = driver.renders()
    with bpy.context.temp_override(window=driver.window()):
        bpy.ops.wm.open_mainfile(filepath=str(path))
    yield 0.5
    yield from wait_until(lambda: not any(render.is_alive for render in before), "end of the old file's thread")
    driver.shade("RENDERED")  # Blender loads files with solid shading
    yield from wait_until(lambda: bool(driver.renders()) and pictures() > 0, "a picture of the loaded file")
    yield from settle("loaded")


driver.start(scenario)
