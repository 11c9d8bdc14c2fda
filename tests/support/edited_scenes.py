"""Pairs of scenes, before and after an edit, that share all that the edit leaves alone: as an interactive session would
make them. For square pictures of 20 pixels."""

from __future__ import annotations

from collections.abc import Callable

import cistern_core as core
import numpy as np

from tests.support.core_scenes import SceneDescription, emission, principled
from tests.support.direct_light_scenes import NOT_TO_CAMERA

ALL_SETS = 2**64 - 1
GRAY, RED = principled((0.7, 0.7, 0.7)), principled((0.8, 0.3, 0.2))
EYE, AIM = (0.0, -2.7, 1.1), (0.0, 0.0, 0.8)


class EditableScene(SceneDescription):
    """Keeps its things, and may make one snapshot after another. Each thing's key is its number plus one."""

    linked: int | None = None
    """The thing that is of light set 1 and of shadow set 1."""

    def move(self, index: int, offset: tuple[float, float, float], turn: float = 0.0) -> None:
        """Turned about the z axis through the origin (radians), then displaced; replaces an earlier move."""
        mesh, materials, _ = self.instances[index]
        matrix = np.eye(4)
        matrix[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
        matrix[:3, 3] = offset
        self.instances[index] = (mesh, materials, matrix)

    def snapshot(self) -> core.Scene:
        mesh, materials, matrices = zip(*self.instances, strict=True)
        count = len(mesh)
        name = self.builder.add_object_name("objects")
        link_sets, links = np.zeros((count, 2), np.uint8), np.full((count, 2), ALL_SETS, np.uint64)
        if self.linked is not None:
            link_sets[self.linked] = 1
        self.builder.clear_instances()
        self.builder.add_instances(
            np.array(mesh, np.int32), np.array(materials, np.int32), np.full(count, name, np.int32),
            np.array(matrices, np.float32), np.full(count, 31, np.uint8), keys=np.arange(1, count + 1, dtype=np.uint64),
            link_sets=link_sets, links=links,
        )  # fmt: skip
        return self.builder.snapshot()

    def add_panel(
        self, x: float, radiance: tuple[float, float, float], replace: int | None = None, sets: int = ALL_SETS
    ) -> int:
        """A lamp under the ceiling that shines down."""
        return self.builder.add_area_light(
            "panel", (x, 0.0, 1.9), (0.5, 0.0, 0.0), (0.0, -0.8, 0.0), (0.0, 0.0, -1.0), radiance,
            visibility=NOT_TO_CAMERA, replace=replace, lit_sets=sets, blocker_sets=sets,
        )  # fmt: skip


FLOOR, BACK, LEFT, RIGHT, BALL, TILE = range(6)
WARM, COOL = (5.0, 4.0, 3.0), (2.0, 3.0, 5.0)


def studio() -> EditableScene:
    """An open room with a ball, a panel at either side (lights 0 and 1) and a glowing tile that faces the room."""
    scene = EditableScene()
    scene.add_quad((-1, -3, 0), (2, 0, 0), (0, 4, 0), GRAY, name="floor")
    scene.add_quad((-1, 1, 0), (2, 0, 0), (0, 0, 2), GRAY, name="back")
    scene.add_quad((-1, -3, 0), (0, 4, 0), (0, 0, 2), RED, name="left")
    scene.add_quad((1, -3, 0), (0, 0, 2), (0, 4, 0), GRAY, name="right")
    scene.add_sphere(0.35, principled((0.8, 0.8, 0.8), specular=0.5, roughness=0.5), (-0.3, -0.3, 0.35), rings=8)
    scene.add_quad((0.55, 0.2, 0.2), (0.3, -0.15, 0), (0, 0, 0.4), emission((3.0, 2.0, 4.0)), name="tile")
    scene.add_panel(-0.6, WARM)
    scene.add_panel(0.6, COOL)
    scene.set_camera(EYE, AIM, half_width=0.55)
    return scene


def nothing(scene: EditableScene) -> None:
    pass


def camera(scene: EditableScene) -> None:
    scene.set_camera((0.35, -2.6, 1.3), (0.05, 0.0, 0.75), half_width=0.55)


def brighter_lamp(scene: EditableScene) -> None:
    scene.add_panel(-0.6, tuple(4.0 * c for c in WARM), replace=0)


def moved_lamp(scene: EditableScene) -> None:
    scene.add_panel(0.1, WARM, replace=0)


def removed_lamp(scene: EditableScene) -> None:
    scene.builder.remove_light(0)


def new_lamp(scene: EditableScene) -> None:
    scene.builder.add_point_light("bulb", (0.6, -0.6, 0.8), 0.1, (0.4, 0.5, 0.2))


def linked_lamp(scene: EditableScene) -> None:
    """One lamp no longer lights the ball, nor does the ball stand in its light; the other lights nothing else."""
    scene.linked = BALL
    scene.add_panel(-0.6, WARM, replace=0, sets=ALL_SETS - 2)
    scene.builder.add_area_light(
        "panel", (0.6, 0.0, 1.9), (0.5, 0.0, 0.0), (0.0, -0.8, 0.0), (0.0, 0.0, -1.0), COOL,
        visibility=NOT_TO_CAMERA, replace=1, lit_sets=2,
    )  # fmt: skip


def moved_ball(scene: EditableScene) -> None:
    scene.move(BALL, (0.5, 0.1, 0.2))


def moved_tile(scene: EditableScene) -> None:
    scene.move(TILE, (-0.9, -0.2, 0.1), turn=0.6)


def new_ball(scene: EditableScene) -> None:
    points = np.array([(-0.4, -0.4, 0.0), (0.4, -0.4, 0.0), (0.4, 0.4, 0.0), (-0.4, 0.4, 0.0), (0, 0, 0.8)], np.float32)
    corners = np.array([0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4], np.int32)
    mesh, materials, _ = scene.instances[BALL]
    scene.builder.add_mesh("pyramid", points, corners, replace=mesh)
    scene.instances[BALL] = (mesh, materials, np.eye(4))


def set_material(scene: EditableScene, index: int, program: core.MaterialProgram) -> None:
    mesh, _, matrix = scene.instances[index]
    name = f"material of {index}"
    material = scene.builder.add_material_set([scene.builder.add_material(program)], name)
    scene.instances[index] = (mesh, material, matrix)


def painted_wall(scene: EditableScene) -> None:
    set_material(scene, BACK, principled((0.2, 0.8, 0.3)))


def metal_ball(scene: EditableScene) -> None:
    """A smooth one, which takes no part in reuse of paths."""
    set_material(scene, BALL, principled((0.9, 0.8, 0.6), metallic=1.0, roughness=0.0))


def thin_wall(scene: EditableScene) -> None:
    """Half of the light goes through."""
    set_material(scene, BACK, principled((0.7, 0.7, 0.7), alpha=0.5))


def glowing_wall(scene: EditableScene) -> None:
    set_material(scene, LEFT, emission((0.4, 0.2, 0.6)))


def dark_tile(scene: EditableScene) -> None:
    set_material(scene, TILE, GRAY)


def bent_floor(scene: EditableScene) -> None:
    """As many points and polygons as before, elsewhere."""
    points = np.array([(-1, -3, 0.35), (1, -3, 0), (1, 1, 0.3), (-1, 1, 0)], np.float32)
    corners, ends = np.arange(4, dtype=np.int32), np.array([0, 4], np.int32)
    scene.builder.add_mesh("floor", points, corners, ends, replace=scene.instances[FLOOR][0])


def sky(scene: EditableScene) -> None:
    scene.set_environment((0.3, 0.4, 0.6))


def everything(scene: EditableScene) -> None:
    for edit in (camera, moved_lamp, new_lamp, moved_ball, moved_tile, painted_wall):
        edit(scene)


EDITS: dict[str, Callable[[EditableScene], None]] = {
    edit.__name__: edit
    for edit in (nothing, camera, brighter_lamp, moved_lamp, removed_lamp, new_lamp, linked_lamp, moved_ball,
                 moved_tile, painted_wall, metal_ball, thin_wall, glowing_wall, dark_tile, new_ball, bent_floor,
                 sky, everything)
}  # fmt: skip


def edited(name: str) -> tuple[core.Scene, core.Scene]:
    """The studio before and after an edit."""
    scene = studio()
    before = scene.snapshot()
    EDITS[name](scene)
    return before, scene.snapshot()
