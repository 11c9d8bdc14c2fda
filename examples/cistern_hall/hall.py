"""The layout: where everything stands, the lamps, the daylight and the camera."""

from collections.abc import Iterator

import bpy
import numpy as np
from mathutils import Matrix, Vector

from . import furnishings, masonry
from .masonry import BAY, SPAN, SPRING
from .materials import make_materials, make_world
from .shapes import TAU, Array, to_mesh

COLUMNS_X, COLUMNS_Y = 8, 12  # of columns; there is one bay more each way
WELLS = ((0, 4), (-3, 3), (2, 7))  # bays open to the sky: (across, along) from the nave and the entrance
WELL_TOP = 10.2
WALKWAY = 0.34  # height of its boards above the water
WALKWAY_START, WALKWAY_END = 1.5 * BAY, 4 * BAY - 1.85
DAIS = (0.0, 4 * BAY)

LOW = (-4.5 * BAY, -0.5 * BAY)
HIGH = (4.5 * BAY, (COLUMNS_Y + 0.5) * BAY)


def bays() -> Iterator[tuple[int, int]]:
    for along in range(COLUMNS_Y + 1):
        for across in range(-4, 5):
            yield across, along


class Stage:
    """Places objects in the scene; things that recur share a mesh or a collection."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self.scene = scene
        self.random = np.random.default_rng(5)

    def place(
        self, name: str, what: bpy.types.ID, at: tuple[float, float, float], turn: float = 0.0
    ) -> bpy.types.Object:
        """A mesh or light as an object, a collection as an instance of it; turned about Z (radians)."""
        is_collection = isinstance(what, bpy.types.Collection)
        thing = bpy.data.objects.new(name, None if is_collection else what)
        if is_collection:
            thing.instance_type = "COLLECTION"
            thing.instance_collection = what
        thing.location = at
        thing.rotation_euler = (0.0, 0.0, turn)
        self.scene.collection.objects.link(thing)
        return thing

    def collection(self, name: str, *meshes: bpy.types.Mesh) -> bpy.types.Collection:
        """Holds the meshes, each at the origin, for instances; the collection itself is not in the scene."""
        collection = bpy.data.collections.new(name)
        for mesh in meshes:
            collection.objects.link(bpy.data.objects.new(f"{name} part", mesh))
        return collection


def lamp(name: str, kind: str, colour: tuple[float, float, float], power_w: float, radius: float) -> bpy.types.Light:
    light = bpy.data.lights.new(name, kind)
    light.color = colour
    light.energy = power_w
    light.shadow_soft_size = radius
    return light


def build_structure(stage: Stage, materials: dict[str, bpy.types.Material]) -> None:
    stone = [materials["marble"], materials["limestone"]]
    columns = [
        stage.collection("Plain column", to_mesh("Plain column", masonry.column(False), stone)),
        stage.collection("Fluted column", to_mesh("Fluted column", masonry.column(True), [stone[1], stone[1]])),
    ]
    vault = to_mesh("Vault", masonry.vault(), [materials["bricks"]])
    rib = to_mesh("Arch", masonry.arch(), [materials["limestone"]], np.radians(30.0))
    well = to_mesh("Light well", masonry.light_well(WELL_TOP), [materials["bricks"]])
    for across, along in bays():
        x, y = across * BAY, along * BAY
        is_open = (across, along) in WELLS
        stage.place("Light well" if is_open else "Vault", well if is_open else vault, (x, y, 0.0))
        if across < 4:
            stage.place("Arch", rib, (x + SPAN, y, 0.0))
        if along < COLUMNS_Y:
            stage.place("Arch", rib, (x, y + SPAN, 0.0), 0.25 * TAU)
        if across < 4 and along < COLUMNS_Y:
            kind = columns[int(stage.random.random() < 0.4)]
            stage.place("Column", kind, (x + SPAN, y + SPAN, 0.0), 0.25 * TAU * stage.random.integers(4))
    stage.place("Walls", to_mesh("Walls", masonry.walls(LOW, HIGH), [materials["bricks"]]), (0.0, 0.0, 0.0))


def candle_places(random: np.random.Generator, count: int) -> Array:
    """Points (x, y) on the water, clear of columns, walkway and dais."""
    places: list[tuple[float, float]] = []
    while len(places) < count:
        x = random.normal(0.0, 5.5)
        y = random.uniform(-0.5, COLUMNS_Y * BAY)
        column_distance = np.hypot((x / BAY) % 1.0 - 0.5, (y / BAY) % 1.0 - 0.5) * BAY
        clear = column_distance > 1.1 and np.hypot(x - DAIS[0], y - DAIS[1]) > 2.1 and abs(x) < HIGH[0] - 0.5
        if clear and (abs(x) > 1.3 or not WALKWAY_START - 0.4 < y < WALKWAY_END + 0.5):
            places.append((x, y))
    return np.array(places)


def build_water(stage: Stage, materials: dict[str, bpy.types.Material]) -> None:
    places = candle_places(stage.random, 220)
    mesh = to_mesh("Water", masonry.water(LOW, HIGH, places[::3], 420, 560), [materials["water"]])
    stage.place("Water", mesh, (0.0, 0.0, 0.0))
    parts = [materials["wax"], materials["flame"], materials["bronze"]]
    candle = stage.collection("Candle", to_mesh("Candle", furnishings.candle(), parts))
    for x, y in places:
        stage.place("Candle", candle, (x, y, 0.0), TAU * stage.random.random())


def build_walkway(stage: Stage, materials: dict[str, bpy.types.Material]) -> None:
    boards = [to_mesh("Board", masonry.plank(length), [materials["wood"]]) for length in (1.78, 1.84, 1.90)]
    for y in np.arange(WALKWAY_START, WALKWAY_END, 0.275):
        turn = stage.random.normal(0.0, 0.008) + 0.5 * TAU * stage.random.integers(2)
        stage.place("Board", boards[stage.random.integers(3)], (stage.random.normal(0.0, 0.02), y, WALKWAY), turn)
    post = to_mesh("Post", furnishings.post(), [materials["bronze"], materials["lamp"]])
    rope = to_mesh("Rope", furnishings.rope(0.5 * BAY, 0.16), [materials["wax"]])
    for k, y in enumerate(np.arange(WALKWAY_START + 0.1, WALKWAY_END, 0.5 * BAY)):
        for side in (-1.0, 1.0):
            stage.place("Post", post, (0.86 * side, y, WALKWAY))
            glow = lamp("Post lamp", "POINT", (1.0, 0.60, 0.28), 9.0, 0.05)
            stage.place("Post lamp", glow, (0.86 * side, y, WALKWAY + 0.66))
            if k > 0:
                stage.place("Rope", rope, (0.86 * side, y - 0.25 * BAY, WALKWAY + 0.70))
    jar = to_mesh("Jar", furnishings.jar(), [materials["glaze"]])
    for x, y, size in (
        (-0.58, 7.7, 0.72),
        (-0.52, 8.25, 0.55),
        (0.58, 9.8, 0.75),
        (-0.58, 13.4, 0.7),
        (0.58, 15.0, 0.7),
    ):
        thing = stage.place("Jar", jar, (x, y, WALKWAY + 0.03), TAU * stage.random.random())
        thing.scale = (size, size, size)


def build_dais(stage: Stage, materials: dict[str, bpy.types.Material]) -> None:
    x, y = DAIS
    stage.place("Dais", to_mesh("Dais", masonry.dais(), [materials["polished"]]), (x, y, 0.0))
    tripod = to_mesh("Tripod", furnishings.brazier(), [materials["gold"], materials["glass"]])
    stage.place("Tripod", tripod, (x, y, 0.54))
    head = furnishings.watcher("Watcher", materials["polished"])
    for k, (across, along, roll) in enumerate(((-1, 2, 0.5 * np.pi), (1, 3, np.pi), (-1, 4, 0.0))):
        thing = stage.place(f"Watcher {k}", head, (across * 0.98 * SPAN * 0.62, along * BAY, 0.42))
        thing.rotation_euler = (0.12, roll, 0.35 * across)
        thing.scale = (0.55, 0.55, 0.55)
        thing.modifiers.new("Smooth", "SUBSURF").render_levels = 3


def build_lamps(stage: Stage, materials: dict[str, bpy.types.Material]) -> None:
    height = 3.55
    body = furnishings.hanging_lamp(SPRING + SPAN - height - 0.36)
    hanging = stage.collection("Hanging lamp", to_mesh("Hanging lamp", body, [materials["bronze"], materials["lamp"]]))
    for across, along in bays():
        if (across, along) not in WELLS and (across != 0 or along % 2 == 1):
            stage.place("Hanging lamp", hanging, (across * BAY, along * BAY, height), TAU * stage.random.random())
    for across, along in bays():
        if across < 4 and along < COLUMNS_Y:
            glow = lamp("Uplight", "SPOT", (1.0, 0.50, 0.20), stage.random.uniform(120.0, 320.0), 0.06)
            glow.spot_size, glow.spot_blend = np.radians(70.0), 0.8
            side = stage.random.choice((-1.0, 1.0))
            at = (across * BAY + SPAN + 0.62 * side, along * BAY + SPAN - 0.62, 0.12)
            thing = stage.place("Uplight", glow, at)
            thing.rotation_euler = (np.pi - 0.10, 0.10 * side, 0.0)


def build_daylight(stage: Stage) -> None:
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.color, sun.energy, sun.angle = (1.0, 0.95, 0.88), 9.0, np.radians(0.6)
    # Falls through the middle well onto the dais from behind, so that its edges shine towards the camera.
    direction = Vector((0.16, -0.22, -1.0))
    thing = stage.place("Sun", sun, (0.0, 0.0, 14.0))
    thing.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
    stage.scene.world = make_world(1.3, 0.7)


def build_camera(stage: Stage) -> None:
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_start = 26.0, 0.05
    camera = stage.place("Camera", data, (0.0, 0.0, 0.0))
    eye, target = Vector((0.55, -1.3, 1.75)), Vector((-0.35, 4.0 * BAY, 2.5))
    camera.matrix_world = Matrix.Translation(eye) @ (target - eye).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    data.dof.use_dof = True
    data.dof.focus_distance = (Vector((*DAIS, 1.3)) - eye).length
    data.dof.aperture_fstop = 4.0
    stage.scene.camera = camera


def build(scene: bpy.types.Scene) -> None:
    materials = make_materials()
    stage = Stage(scene)
    build_structure(stage, materials)
    build_water(stage, materials)
    build_walkway(stage, materials)
    build_dais(stage, materials)
    build_lamps(stage, materials)
    build_daylight(stage)
    build_camera(stage)
    scene.render.resolution_x, scene.render.resolution_y = 960, 540
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"
    scene.view_settings.exposure = 0.4
