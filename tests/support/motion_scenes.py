"""A test sphere that moves while a shutter is open."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from . import blender_scenes as build

Motion = Callable[[bpy.types.Scene, bpy.types.Object], object]


def animate(owner: bpy.types.bpy_struct, path: str, *values: float, index: int = -1) -> None:
    """Of frames 0, 1 and 2, of which the middle one is rendered; eased in between."""
    for frame, value in enumerate(values):
        if index < 0:
            setattr(owner, path, value)
        else:
            getattr(owner, path)[index] = value
        owner.keyframe_insert(path, index=index, frame=frame)


def resting(_scene: bpy.types.Scene, _ball: bpy.types.Object) -> None:
    pass


def put_in_motion(
    scene: bpy.types.Scene, motion: Motion, position: str = "CENTER", shutter: float = 1.0
) -> bpy.types.Scene:
    """The scene, at frame 1, with motion blur."""
    ball = build.stage(scene, build.principled("ball", Base_Color=(0.8, 0.3, 0.2, 1), Roughness=0.6))
    motion(scene, ball)
    render = scene.render
    render.use_motion_blur, render.motion_blur_position, render.motion_blur_shutter = True, position, shutter
    scene.frame_set(1)
    return scene
