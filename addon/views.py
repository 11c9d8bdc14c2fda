"""Multi-view (stereo) renders: Blender asks for one picture for each view and knows where each eye stands."""

from typing import TYPE_CHECKING

import bpy

if TYPE_CHECKING:
    import cistern_core

    from .engine import CisternEngine


def view_names(engine: bpy.types.RenderEngine, layer_name: str) -> list[str]:
    """Names of the views to render, as Blender lays them out in a result; [""] without multi-view."""
    probe = engine.begin_result(0, 0, 1, 1, layer=layer_name)
    names = [view.name for view in probe.views]
    engine.end_result(probe, cancel=True)
    return names or [""]


def place_view_camera(
    engine: "CisternEngine", depsgraph: bpy.types.Depsgraph, builder: "cistern_core.SceneBuilder"
) -> None:
    """Set the camera of the engine's active view; the scene was synced before, so it has a camera."""
    from .sync import SyncReport
    from .sync.camera import camera_arguments, camera_data, rigid_matrix

    scene = depsgraph.scene_eval
    camera = (engine.camera_override or scene.camera).evaluated_get(depsgraph)
    arguments = camera_arguments(scene, camera, SyncReport(), engine.picture_settings(depsgraph))
    if camera.type != "CAMERA":  # no eyes
        builder.set_camera(**arguments)
        return
    data = camera_data(camera)
    if data.type != "PANO":  # these have no shift
        extra_shift = engine.camera_shift_x(camera) - data.shift_x
        moved = extra_shift * fitted_length(data, arguments)
        arguments["left"] += moved
        arguments["right"] += moved
    arguments["camera_to_world"] = rigid_matrix(engine.camera_model_matrix(camera))
    builder.set_camera(**arguments)


def fitted_length(camera: bpy.types.Camera, window: dict[str, float]) -> float:
    """The side of the camera's window that Blender fits the sensor to: its unit for shifts."""
    width, height = window["right"] - window["left"], window["top"] - window["bottom"]
    is_vertical = camera.sensor_fit == "VERTICAL" or (camera.sensor_fit == "AUTO" and width < height)
    return height if is_vertical else width
