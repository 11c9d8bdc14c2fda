"""Native core of the Cistern render engine.

Arrays are C-contiguous NumPy arrays of exactly the stated dtype (another dtype is a TypeError, never a hidden copy).
Handles are small integers that stay valid until removed. Bad input raises `Error`, whose text names the data-block,
the value and what is allowed, and leaves the builder as it was. Lengths are metres, angles radians, colours
scene-linear. Matrices are row-major, object to world.
"""

from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str
EMBREE_VERSION: str
EMBREE_LIBRARY: str  # path of the shared library that answers, among those of the process
TBB_LIBRARY: str

class Error(RuntimeError): ...

class LightSampling(Enum):
    UNIFORM = 0
    POWER = 1
    TREE = 2

class PixelFilter(Enum):
    BOX = 0
    GAUSSIAN = 1
    BLACKMAN_HARRIS = 2

class Status(Enum):
    RUNNING = 0
    DONE = 1
    CANCELLED = 2
    FAILED = 3

class MaterialProgram:
    """A node tree flattened to instructions; see native/scene/material_program.h for the operations.

    An operand is an opaque int returned by `constant` or `emit`."""

    pass_index: float  # what Material Index shows
    is_boundary: bool  # there is no surface: crossing it is no transparent bounce
    corrects_bumps: bool  # else specular normals are not bent back, nor the terminators of bumps softened
    has_transparent_shadow: bool  # else light samples find no light past it, unless there is a volume inside

    def __init__(self, name: str) -> None: ...
    def constant(self, x: float, y: float = 0.0, z: float = 0.0) -> int: ...
    def emit(
        self, op: str, inputs: Sequence[int] = (), parameters: Sequence[int] = (), output: int | None = None
    ) -> int:
        """Append an instruction, return the operand of its output: a new register, or `output`, which may be one that
        nothing reads from here on. Raises Error for an unknown op, wrong counts, or more than 256 registers."""
    def closure(self, op: str, inputs: Sequence[int], parameters: Sequence[int] = ()) -> None:
        """Append a closure; its first input is the weight (float)."""
    def attribute(self, name: str) -> int:
        """Index of an attribute name, for ATTRIBUTE, INSTANCE_VALUE (parameter 0) and NORMAL_MAP ("" = first UV map)."""
    def table(self, values: NDArray[np.float32], alpha: NDArray[np.float32] | None = None) -> int:
        """Index of a (257, 3) lookup table over [0, 1], with alpha (257,) for ramps."""
    def image(self, handle: int) -> int:
        """Index of an image handle, for IMAGE's parameter 0."""
    def tiles(self, images: Sequence[int]) -> int:
        """Index of a table of tiles, for TILED_IMAGE's parameter 0: what `image` returned for tiles 1001, 1002, ...; -1
        where there is none."""

def matte_hash(name: str) -> int:
    """MurmurHash3 of a name, by which Cryptomatte knows it."""

def describe_ops() -> dict[str, tuple[str, str, int, bool]]:
    """Op name -> (input letters, output letter or '', parameter count, is closure). Letters: f float, c colour, v vector."""

class SceneBuilder:
    """Snapshots share what did not change between them. Equal material sets and names of objects have one handle; what
    is replaced by an equal mesh, image (the same memory) or material stays the object it was.

    A key is a number other than 0 that stands for the same instance or light in all snapshots, so that what was found
    for it can be used again; things without one (0) are known by their handles."""

    def __init__(self, earlier: "Scene | None" = None) -> None:
        """Empty, or going on from a snapshot, whose handles are valid here."""
    def take_mesh(self, scene: "Scene", handle: int) -> int:
        """Share a mesh of another scene; returns its handle here."""
    def add_mesh(
        self,
        name: str,
        positions: NDArray[np.float32],  # (points, 3)
        corner_vertices: NDArray[np.int32],  # (corners,)
        polygon_offsets: NDArray[np.int32] | None = None,  # (polygons + 1,)
        triangle_corners: NDArray[np.int32] | None = None,  # (triangles, 3), needed when a polygon has > 4 corners
        triangle_polygons: NDArray[np.int32] | None = None,  # (triangles,)
        material_indices: NDArray[np.int32] | None = None,  # (polygons,)
        normals: NDArray[np.float32] | None = None,  # (points or corners, 3)
        normals_domain: str = "FACE",  # FACE (flat), POINT, CORNER
        sharp_faces: NDArray[np.uint8] | None = None,  # (polygons,)
        attributes: Sequence[tuple[str, str, NDArray[np.float32]]] = (),  # (name, domain, (n, 1..4)); UV maps first
        subdivision: dict[str, Any] | None = None,  # SubdivisionInput of native/scene/scene_builder.h: see set_dicing
        texture_space: NDArray[np.float32]
        | None = None,  # (2, 3): Generated inside maps it to [0, 1]; None: the bounds
        replace: int | None = None,
    ) -> int: ...
    def add_strands(
        self,
        name: str,
        positions: NDArray[np.float32],  # (keys, 3), strand after strand
        radii: NDArray[np.float32],  # (keys,)
        strand_offsets: NDArray[np.int32],  # (strands + 1,) first key of each, and how many there are
        material_indices: NDArray[np.int32] | None = None,  # (strands,)
        shape: str = "SPLINES",  # between keys; or "LINES"; "BALLS": one about each key, and nothing between
        attributes: Sequence[tuple[str, str, NDArray[np.float32]]] = (),  # (name, POINT or FACE: of strands, (n, 1..4))
        replace: int | None = None,
    ) -> int:
        """Strands as a mesh, whose handle this is: round curves through their keys. Those with fewer than two keys are
        left out, and those that are not finite, whose segments `mesh_statistics` counts as dropped triangles."""
    def add_splats(
        self,
        name: str,
        positions: NDArray[np.float32],  # (splats, 3)
        scales: NDArray[np.float32],  # (splats, 3) standard deviations along their axes
        rotations: NDArray[np.float32],  # (splats, 4) quaternions w, x, y, z
        radiance: NDArray[np.float32],  # (splats, 4) coefficients of the constant harmonic, of sRGB - 0.5; opacity
        harmonics: NDArray[np.uint8] | None = None,  # (splats, 15, 3) of bands 1 to 3, [-1, 1] in 8 bits
        to_working_space: Sequence[float] | None = None,  # 3 x 3 from linear Rec. 709, row by row
        attributes: Sequence[
            tuple[str, str, NDArray[np.float32]]
        ] = (),  # (name, POINT or FACE, which are the same, (splats, 1..4))
        replace: int | None = None,
    ) -> int:
        """Gaussian splats as a mesh, whose handle this is; materials read what they send as the attribute "radiance".
        Those of opacity 0.01 and below are left out, and those without a shape, which `mesh_statistics` counts as
        dropped triangles: scales or rotations that are 0, or what is not finite."""
    def add_volume(
        self,
        name: str,
        object_to_box: NDArray[np.float32],  # (4, 4); the box is [0, size] of it, its unit about a voxel
        size: tuple[int, int, int],
        # name, voxels (x, y, z) or (x, y, z, 1..4) of float16 or float32, object_to_voxel (4, 4), background
        grids: Sequence[tuple[str, NDArray[np.floating], NDArray[np.float32], float]],
        scales_with_object: bool = False,  # an object twice as large is half as dense
        drift_opening: float = 0.0,  # when a shutter opens, in exposures since the voxels were as they are
        texture_space: NDArray[np.float32] | None = None,  # (2, 3), as for add_mesh
        replace: int | None = None,
    ) -> int:
        """The box of a volume object as a mesh, whose handle this is, and the grids that materials read inside by name.
        Voxels are points at whole numbers; they are shared, not copied: arrays must not change afterwards. A grid of
        vectors called "INFO:drift" tells how far things go in a whole exposure, in object space."""
    def add_image(
        self,
        name: str,
        pixels: NDArray,  # (height, width, channels) uint8, uint16, float16 or float32; row 0 at the bottom; kept, not copied
        transfer: str = "LINEAR",  # LINEAR, SRGB
        to_working_space: Sequence[float] | None = None,  # 9 numbers, row-major
        alpha: str = "STRAIGHT",  # STRAIGHT, PREMULTIPLIED, INDEPENDENT, IGNORED
        replace: int | None = None,
    ) -> int: ...
    def add_material(self, program: MaterialProgram, replace: int | None = None) -> int: ...
    def add_material_set(self, materials: Sequence[int], owner_name: str) -> int: ...
    def add_object_name(self, name: str, pass_index: float = 0.0, asset: str | None = None) -> int:
        """`asset` is the name of its topmost parent; None: its own."""
    def add_instances(
        self,
        mesh: NDArray[np.int32],  # (n,)
        material_set: NDArray[np.int32],  # (n,)
        object: NDArray[np.int32],  # (n,) handles of add_object_name
        object_to_world: NDArray[np.float32],  # (n, 4, 4) or (n, 3, 4)
        visibility: NDArray[np.uint8],  # (n,) bits: 1 camera 2 diffuse 4 glossy 8 transmission 16 shadow
        holdout: NDArray[np.uint8] | None = None,
        random: NDArray[np.float32] | None = None,
        keys: NDArray[np.uint64] | None = None,
        values: NDArray[np.int32] | None = None,  # (n,) rows of set_instance_values; -1: its materials read 0
        link_sets: NDArray[np.uint8] | None = None,  # (n, 2) below 64: its set as a receiver of light and as a blocker
        links: NDArray[np.uint64] | None = None,  # (n, 2) bits: sets it lights, and those that block its light
        shadow_catcher: NDArray[np.uint8] | None = None,
        light_group: NDArray[np.int16] | None = None,  # (n,) of the emitter; -1: none
    ) -> int:
        """Handle of the first; the others follow. Flat (singular) instances are left out and counted."""
    def set_motion_step(
        self, step: int, object_to_world: NDArray[np.float32], positions: Mapping[int, NDArray[np.float32]] = ...
    ) -> None:
        """Of the frame before (0) or after (1): the camera that is set now, matrices (n, 4, 4) of all instances, and
        points (n, 3) of meshes that have another shape then."""
    def set_instance_values(self, names: Sequence[str], rows: NDArray[np.float32]) -> None:
        """What INSTANCE_VALUE reads of all instances: (n, names, 4), finite."""
    @property
    def singular_instances(self) -> int: ...
    def add_point_light(
        self,
        name: str,
        position: Sequence[float],
        radius: float,
        intensity: Sequence[float],
        soft: bool = True,
        **common,
    ) -> int:
        """`intensity` W/sr; `common` for all lights: visibility=63, casts_shadow=True, use_mis=True, max_bounces=1024,
        material=-1, object_to_world (4, 4) of the lamp for what its material reads, key=0, lit_sets and blocker_sets
        as `links` of instances (all bits set), light_group=-1, replace=None."""
    def add_spot_light(
        self,
        name: str,
        object_to_world: NDArray[np.float32],
        radius: float,
        intensity: Sequence[float],
        spot_size: float,
        blend: float,
        soft: bool = True,
        **common,
    ) -> int: ...
    def add_sun_light(
        self, name: str, direction: Sequence[float], angle: float, irradiance: Sequence[float], **common
    ) -> int:
        """`direction` points from the scene towards the sun."""
    def add_area_light(
        self,
        name: str,
        center: Sequence[float],
        edge_u: Sequence[float],
        edge_v: Sequence[float],
        normal: Sequence[float],
        radiance: Sequence[float],
        ellipse: bool = False,
        spread: float = 3.14159265,
        portal: bool = False,
        **common,
    ) -> int:
        """Edges are full lengths; emits along `normal` only. `radiance` on axis before the spread factor. A portal emits
        nothing, but shows where the environment comes in."""
    def set_environment(
        self,
        material: int,
        visibility: int = 63,
        importance_width: int = 0,
        importance_sampling: bool = True,
        light_group: int = -1,
    ) -> None: ...
    def set_camera(
        self,
        name: str,
        type: str,  # PERSPECTIVE, ORTHOGRAPHIC, PANORAMIC
        camera_to_world: NDArray[np.float32],  # (4, 4), without scale
        left: float,
        right: float,
        bottom: float,
        top: float,  # window of the full frame, see native/scene/camera.h
        clip_start: float,
        clip_end: float,
        aperture_radius: float = 0.0,
        focus_distance: float = 1.0,
        blades: int = 0,
        blade_rotation: float = 0.0,
        aperture_ratio: float = 1.0,
        panorama: dict[str, Any] = ...,  # members of native/scene/camera.h, for PANORAMIC
    ) -> None: ...
    def set_dicing(
        self,
        owner: str,  # that errors name
        width: int,
        height: int,  # of the picture that meshes are subdivided for, as the camera that is set now sees them
        rate: float = 1.0,  # multiplies the longest edges
        offscreen_scale: float = 4.0,  # the same of what is not in view
        most_levels: int = 12,  # edges are halved so often at most
        stays_diced: bool = False,  # what was diced stays as it is wherever instances and the camera go
    ) -> None: ...
    def set_sheet(
        self,
        name: str,
        width: int,
        height: int,
        instance: int,
        polygons: NDArray[np.int32],  # (width * height,), of the mesh as it was added; -1: the pixel shows nothing
        points: NDArray[np.float32],  # (width * height, 3), object space: middles of pixels, rows from the bottom up
        steps_x: NDArray[np.float32],  # (width * height, 3): to the middle of the next pixel
        steps_y: NDArray[np.float32],
        sees_from_eye: bool = False,
    ) -> None:
        """The camera looks at the surface of an instance, laid out flat, instead: see native/scene/surface_sheet.h"""

    def blend_normals_in_world(self) -> None:
        """Of what is there now; see native/scene/scene_builder.h"""

    def remove_mesh(self, handle: int) -> None: ...
    def remove_instance(self, handle: int) -> None: ...
    def remove_light(self, handle: int) -> None: ...
    def clear_instances(self) -> None: ...
    def clear_lights(self) -> None: ...
    def mesh_statistics(self, handle: int) -> dict[str, int]:
        """triangles, dropped_triangles, memory_bytes"""
    def snapshot(self, middle: "Scene | None" = None, is_stopped: Callable[[], bool] | None = None) -> "Scene | None":
        """With meshes as they are subdivided for the view of set_dicing, and as the displacement of their materials moves
        them. `middle`: of a shutter, of which this is another moment; meshes are then subdivided as there. None once
        `is_stopped` said so, which is asked every 20 ms."""

class Scene:
    """An immutable snapshot."""

    @property
    def triangle_count(self) -> int: ...
    @property
    def instance_count(self) -> int: ...
    @property
    def volume_name(self) -> str:
        """Of a material with participating media that is in use; empty without any."""
    @property
    def dispersive_name(self) -> str:
        """Of a material in use that refracts light by its wavelength; empty without any."""
    @property
    def warnings(self) -> list[str]:
        """Of vertices that displacement could not move."""
    @property
    def has_shadow_catchers(self) -> bool: ...
    def shadow_catchers_alone(self) -> Scene:
        """The scene in which light finds nothing else: what the camera sees of other surfaces is held out."""
    def backdrop(self) -> Scene:
        """The world alone."""

class Settings:
    """All members can be given as keyword arguments; Error for a value out of range names the member."""

    def __init__(self, **members) -> None: ...
    width: int  # full frame
    height: int
    region: tuple[int, int, int, int]  # x, y, width, height of the rendered part, y up; (0, 0, 0, 0) = all
    samples: int  # >= 1
    seed: int
    threads: int  # 0: all
    direct: str  # "NEE", "LEARNED", "RIS", "RESTIR", "RESTIR_CACHE"
    secondary: str  # "NEE", "LEARNED", "RIS", "CELL_RESERVOIRS"
    indirect: str  # "PATH", "SCREEN_REUSE", "WORLD_REUSE", "CELL_SHARED"
    bias: str  # "UNBIASED", "FAST"
    # Of reservoirs for direct light; numbers that are 0 become the chosen answer's own.
    light_candidates: int  # M
    temporal_reuse: bool
    confidence_cap: float  # of history, in frames
    spatial_reuse: bool  # of direct light
    path_spatial_reuse: bool  # of indirect light
    # Of SCREEN_REUSE; the target of WORLD_REUSE too.
    path_source: str  # "BSDF", "COSINE", "UNIFORM": density of directions from visible points
    path_target: str  # "REFLECTED", "RADIANCE": what the choice among paths is proportional to
    path_validation: int  # frames after which paths of the history are traced again; 0: never
    path_multi_bounce: float  # share of tiles whose paths go on beyond the first sample point; 0: all
    # Of spatial reservoirs' own history, in frames; 0: none, and never more neighbours than three.
    path_spatial_cap: float
    # Of WORLD_REUSE.
    path_cell_count: int  # reservoirs that a visible point takes from its cell
    path_deep_points: bool  # whether cells hold the next vertices of paths as well
    spatial_neighbours: int  # per round
    spatial_radius: float  # pixels
    spatial_rounds: int
    visibility_reuse: bool
    # Of CELL_SHARED: how many vertices share their paths, at the visible point and at the next one; 1: not there, 0: 64 and 256.
    share_visible: int
    share_deep: int
    first_frame_history: bool  # with temporal_reuse: of the first frame alone, unless reservoirs are in use
    share_for_denoiser: bool  # by 16 at visible points, and on trial only where light is rare
    share_trial: bool  # whether a trial before the first sample decides if sharing pays
    share_visible_pixels: float  # edge of the cells that bound groups, in pixels
    share_deep_pixels: float
    cache_merged: int  # reservoirs of its cell that a visible point takes
    cache_candidates: int  # (surface point, light) pairs behind the reservoirs of a cell
    cache_refresh: int  # frames until all reservoirs of a cell have been made anew
    # Of the cells of the world-space grid; 0 for the default.
    cell_pixels: float  # edge of a cell as seen in the picture; 0: 10 pixels, with WORLD_REUSE 10 % of the picture
    min_cell_size: float  # smallest edge, as a share of the diagonal of the scene's box
    normal_cells: bool  # whether cells are divided by the direction of the surface
    # With a RenderCache and temporal reuse: go on with the history of the last session, if that had the same settings but
    # for samples, threads, time_limit, noise_threshold, exposures, passes and the size of the picture; and leave the own
    # history there.
    keep_history: bool
    is_draft: bool  # the picture only bridges the time until a finer one: drafts have a history of their own
    keep_instances: bool  # each mesh keeps an Embree scene of its own: moves are cheap, rays cost a little more
    # Bounces to where light came from in earlier frames. AUTO: where a trial says that it pays; never with history, nor
    # where samples are too few to tell.
    guiding: str  # "OFF", "ON", "AUTO"
    caustic_guide: bool  # bounces look for light of small lamps by way of smooth surfaces
    light_sampling: LightSampling
    # Looks, where light samples compete with the BSDF's and the scene has no portals, for windows and other openings that
    # the sky lights an interior through, and takes them for portals if that promises less noise. True by default.
    find_openings: bool
    # Light samples, where they compete with the BSDF's, look for what shines through flat panes of smooth glass,
    # too. True by default.
    light_through_panes: bool
    light_samples: int  # of the first vertex of a path, with NEE and more than two emitters; 0: 1
    # "SOBOL" (Owen-scrambled, boxes of pixels together), "PIXEL_SOBOL" (each pixel by itself), "RANDOM" (independent)
    sequence: str
    pixel_filter: PixelFilter
    filter_width: float  # pixels
    max_bounces: int
    max_diffuse_bounces: int
    max_glossy_bounces: int
    max_transmission_bounces: int
    max_volume_bounces: int
    max_transparent_bounces: int
    min_bounces: int  # Russian roulette starts after these
    film_transparent: bool
    film_transparent_glass: bool
    clamp_direct: float  # 0: off
    clamp_indirect: float
    filter_glossy: float  # softens gloss after scatterings of a lower density (1/sr), 0: off
    caustics_reflective: bool  # whether diffuse scattering finds light by way of reflections
    caustics_refractive: bool
    time_limit: float  # seconds, 0: none
    # The render ends once little noise is left: the standard error of the picture as a display shows it, where black is 0
    # and white 1, in all blocks of 8 x 8 pixels but one in twenty; looked at after 16, 24, 32, 48, 64 ... samples, and
    # not ended before 0.4 / noise_threshold of them. 0: never. Session.start throws Error unless `tells_noise`.
    noise_threshold: float
    # With a threshold: blocks of 8 x 8 pixels take no more samples once they have reached it, and those around them
    # nearly; the render ends when all have. Where frames look at those of others (can_blur_motion) it does nothing.
    adaptive_sampling: bool
    display_exposure: float  # what the picture is multiplied by to be shown, for that alone
    film_exposure: float  # multiplies all light in passes, after clamping
    # With a shutter: how far it is open, at even steps from its opening to its closing and straight between; empty: fully.
    shutter_curve: Sequence[float]
    # Besides Combined: Direct, Indirect, Emission, Environment, Depth, Normal, Position, Denoising Albedo, Denoising
    # Normal; and, of one frame: Cells, Cell Occupancy, Cell Level, Normal Bin, Reservoir Confidence, Reservoir Weight,
    # Reuse Count, Light Choice Entropy, Light Choice Samples, Guided; Sample Count, of each pixel.
    passes: Sequence[str]
    groups_behind_film: bool  # the environment behind a transparent film is in its light group
    occlusion_distance: float  # metres, of Ambient Occlusion
    mist_range: tuple[float, float, float]  # metres to where Mist begins, its depth, power of the fraction in between

    @property
    def tells_noise(self) -> bool:
        """Whether samples of different frames are independent, so that what they differ by tells their noise."""

class Progress:
    status: Status
    frames_done: int
    frames: int
    seconds: float
    remaining_seconds: float  # negative: not known yet
    noise: float  # as of `noise_threshold`, when last looked at; negative: not yet, or there is no threshold
    expected_frames: int  # `frames`, or fewer that will do for `noise_threshold`
    mean_samples: float  # of the pixels: `frames_done`, or fewer with `adaptive_sampling`
    pixels_left: float  # share of those that are still sampled
    openings: int  # found, that the sky is looked for through; 0 before rendering
    stage: str  # "Building", "Caching light", "Rendering"
    stage_done: float  # of "Caching light", 0 to 1
    error: str
    memory_bytes: int
    non_finite_samples: int
    non_finite_weights: int  # of reservoirs; they counted as zero
    stage_seconds: dict[str, float]  # CPU time of the process by stage, so far; empty for the path tracer without reuse
    version: int  # changes whenever new pixels can be read

class RenderCache:
    """What a render can take over from an earlier one: Embree scenes of meshes and of all of them, the lights, the cells
    of the light cache, each while what it depends on is the same; and with `Settings.keep_history` the history of
    frames. May be used by several sessions at once, of which one has the history."""

    def __init__(self) -> None: ...
    def drop_history(self) -> None:
        """Free the buffers of history, many bytes for each pixel."""
    @property
    def memory_bytes(self) -> int: ...

class Session:
    """Renders a scene on its own native thread. Every method may be called from any Python thread; none holds the GIL
    while waiting."""

    def __init__(self, settings: Settings) -> None: ...
    def start(self, scene: Scene, cache: RenderCache | None = None, shutter: Sequence[Scene] | None = None) -> None:
        """Starts rendering and returns at once; once per session. The cache is looked into and filled. `shutter`, for
        motion blur: the scene at even steps from when the shutter opens to when it closes, without the one in the
        middle, which is `scene`. Error for an odd number of them, and for settings that keep samples."""
    @staticmethod
    def can_blur_motion(settings: Settings) -> bool:
        """Whether frames of these settings keep no samples: then `start` takes a shutter."""
    def wait(self, seconds: float) -> Progress: ...
    def cancel(self) -> None:
        """Returns once the render has stopped (at most 100 ms)."""
    def hold_after(self, samples: int) -> None:
        """Renders no more than so many samples until told again, so that several sessions can keep step; pixels are
        published there alone. May be told before `start`, too."""
    def read(self, pass_name: str) -> NDArray[np.float32]:
        """(height, width, channels) of the region, row 0 at the bottom. "Combined" has 4 channels, premultiplied. Data
        passes (Depth, Normal, Position) are means over the samples that hit something. Zeros before the first frame."""
    def pass_names(self) -> list[str]: ...
