"""The papers' parameters as properties of `scene.cistern`; 0 stands for the chosen system's own number.

[Bitterli 2020] Spatiotemporal Reservoir Resampling for Real-Time Ray Tracing with Dynamic Direct Lighting.
[Boissé 2021] World-Space Spatiotemporal Reservoir Reuse for Ray-Traced Global Illumination.
[Zhang 2023] World-Space Spatiotemporal Path Resampling for Path Tracing.
[Stefanescu 2025] Worldspace ReSTIR for Direct Illumination.
"""

from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from .techniques import PATH_SOURCE_ITEMS, PATH_TARGET_ITEMS

# The largest values that the core takes.
MAX_CANDIDATES = 1024
MAX_LIGHT_SAMPLES = 64
MAX_NEIGHBOURS = 32
MAX_ROUNDS = 16
MAX_GROUP = 256
MAX_CACHED = 32
MAX_CACHE_CANDIDATES = 2**16
MAX_REFRESH = 2**16
MAX_VALIDATION = 2**16


class ReuseSettings:
    """A part of `scene.cistern`."""

    light_samples: IntProperty(
        name="Light Samples",
        description=(
            "Lights that each sample asks at the first surface it meets, where there are more than two. More make "
            "direct light less noisy, and samples slower. 0 means 1; the preset Final takes 2"
        ),
        default=0,
        min=0,
        soft_max=8,
        max=MAX_LIGHT_SAMPLES,
    )
    use_caustic_guide: BoolProperty(
        name="Guide to Caustics",
        description=(
            "Send some bounces to where photons say that the light of small lamps comes by way of smooth surfaces, as "
            "that of the sun by windows: it would come as fireflies. Final renders only; the preset Final has it"
        ),
        default=False,
    )
    light_candidates: IntProperty(
        name="Light Candidates",
        description=(
            "Light samples drawn at each visible point, of which one is kept (M). 0 means 8 with RIS and the cell "
            "cache [Stefanescu 2025, §4.1], 32 with ReSTIR [Bitterli 2020, §5]"
        ),
        default=0,
        min=0,
        soft_max=64,
        max=MAX_CANDIDATES,
    )
    use_temporal_reuse: BoolProperty(
        name="Temporal Reuse",
        description=(
            "Carry choices of light and of paths over to the next sample [Bitterli 2020, §4]. The first samples gain; "
            "the average of many gains nothing, because they are no longer independent: the preset Final does without"
        ),
        default=True,
    )
    confidence_cap: FloatProperty(
        name="Confidence Cap",
        description=(
            "How many times the confidence of the new sample that of the previous ones may have. 0 means 20 with "
            "ReSTIR [Bitterli 2020, §5], 10 with the cell cache [Stefanescu 2025, §4.1]"
        ),
        default=0.0,
        min=0.0,
        soft_max=100.0,
        max=1e6,
        precision=1,
    )
    use_spatial_reuse: BoolProperty(
        name="Spatial Reuse",
        description="Pass each pixel's choice of direct light on to pixels nearby [Bitterli 2020, §4]",
        default=True,
    )
    spatial_neighbours: IntProperty(
        name="Neighbours",
        description=(
            "Pixels nearby that a pixel takes choices from, in each round. 0 means 5 with ReSTIR "
            "[Bitterli 2020, §5], 8 with the cell cache [Stefanescu 2025, §4.1]"
        ),
        default=0,
        min=0,
        soft_max=16,
        max=MAX_NEIGHBOURS,
    )
    spatial_radius: FloatProperty(
        name="Radius",
        description=(
            "Largest distance of these pixels in pixels. 0 means 30 with ReSTIR [Bitterli 2020, §5], 5 with the "
            "cell cache [Stefanescu 2025, §4.1]"
        ),
        default=0.0,
        min=0.0,
        soft_max=100.0,
        max=10000.0,
        subtype="PIXEL",
    )
    spatial_rounds: IntProperty(
        name="Rounds",
        description=(
            "How often choices are passed on to neighbours in each sample. 0 means 2 with ReSTIR and fast weights, "
            "otherwise 1 [Bitterli 2020, §5]"
        ),
        default=0,
        min=0,
        max=MAX_ROUNDS,
    )
    use_visibility_reuse: BoolProperty(
        name="Visibility Reuse",
        description=(
            "Drop a pixel's own choice where it lies in shadow before passing it on [Bitterli 2020, §4]: one more "
            "shadow ray for each pixel"
        ),
        default=False,
    )
    use_path_spatial_reuse: BoolProperty(
        name="Spatial Reuse of Paths",
        description=(
            "Take light paths from pixels nearby [Ouyang 2021, §4], or from what lay in the same cell of the scene one "
            "sample before [Zhang 2023, §4]"
        ),
        default=True,
    )
    path_target: EnumProperty(
        name="Choose Paths by",
        description="What light paths are chosen in proportion to where several meet",
        items=PATH_TARGET_ITEMS,
        default="REFLECTED",
    )
    path_source: EnumProperty(
        name="Path Directions",
        description=(
            "How directions are drawn in which visible points look for light paths. Lobes smoother than 0.2 keep their "
            "own [Ouyang 2021, §6]"
        ),
        items=PATH_SOURCE_ITEMS,
        default="BSDF",
    )
    path_multi_bounce: FloatProperty(
        name="Tiles with More Bounces",
        description=(
            "Share of the tiles of 64 x 32 pixels whose light paths go on after the first bounce; they then stand for "
            "the others. 0.25 in [Ouyang 2021, §5]; 0 means all"
        ),
        default=0.0,
        min=0.0,
        max=1.0,
        precision=2,
    )
    path_validation: IntProperty(
        name="Validate Paths",
        description=(
            "Samples per pixel after which light paths of the history are traced again, to drop those that no longer "
            "hold: 6 in [Ouyang 2021, §5]. Also done after an edit of lights or surfaces, where with 0 the history "
            "starts anew. Within a final render nothing changes, and it alters no pixel"
        ),
        default=0,
        min=0,
        soft_max=30,
        max=MAX_VALIDATION,
    )
    share_visible: IntProperty(
        name="Group at Visible Points",
        description=(
            "Visible points that hand each other the light paths they found. 1 shares nothing there. 16 at most where "
            "pixels have history, or a denoiser follows. 0 means 64"
        ),
        default=0,
        min=0,
        max=MAX_GROUP,
    )
    share_deep: IntProperty(
        name="Group at Next Points",
        description=(
            "Points one bounce farther that hand each other the light paths they found. 1 shares nothing there. "
            "0 means 256"
        ),
        default=0,
        min=0,
        max=MAX_GROUP,
    )
    use_first_frame_history: BoolProperty(
        name="History at First Sample Only",
        description=(
            "Carry paths over from picture to picture alone: the first sample of each takes up and leaves history, "
            "later ones are independent, so that a view at rest clears faster. Not together with light reservoirs, "
            "which need each sample"
        ),
        default=False,
    )
    use_share_for_denoiser: BoolProperty(
        name="For Denoisers",
        description=(
            "The picture is denoised later, as by a node of the compositor: visible points share in groups of 16 at "
            "most, whose noise has less in common, and on trial only where light is rare. Always so with Denoise"
        ),
        default=False,
    )
    use_share_trial: BoolProperty(
        name="Only Where It Pays",
        description=(
            "Before the first of independent samples, blocks of the picture are tried with and without: paths are "
            "not handed on where they alone surely make less noise for their time"
        ),
        default=True,
    )
    cache_reservoirs: IntProperty(
        name="Cached Samples",
        description=(
            "Prepared light samples that a visible point takes from its cell (X). 0 means 4 [Stefanescu 2025, §4.2]"
        ),
        default=0,
        min=0,
        soft_max=16,
        max=MAX_CACHED,
    )
    cache_candidates: IntProperty(
        name="Cache Candidates",
        description=(
            "Pairs of a surface point and a light sample that the prepared samples of a cell are chosen from. "
            "0 means 1024 [Stefanescu 2025, §4.2]"
        ),
        default=0,
        min=0,
        soft_max=4096,
        max=MAX_CACHE_CANDIDATES,
    )
    cache_refresh: IntProperty(
        name="Cache Refresh",
        description=(
            "Samples per pixel after which the prepared samples of a cell are drawn anew, so that its errors average "
            "out; small pictures take more. 0 means 32; with fast weights they stay as they are, as published "
            "[Stefanescu 2025, §3.1]"
        ),
        default=0,
        min=0,
        soft_max=256,
        max=MAX_REFRESH,
    )
    cell_pixels: FloatProperty(
        name="Cell Size",
        description=(
            "Edge of a cell as it looks on the picture, in pixels; farther cells are larger [Boissé 2021, Alg. 4]. "
            "0 means 10, and for WORLD_REUSE a tenth of the picture [Zhang 2023, §5.2]"
        ),
        default=0.0,
        min=0.0,
        soft_max=200.0,
        max=10000.0,
        subtype="PIXEL",
    )
    min_cell_size: FloatProperty(
        name="Smallest Cell",
        description="Edge of the smallest cells as a share of the scene's diagonal. 0 means 0.01 [Zhang 2023, §5.3]",
        default=0.0,
        min=0.0,
        max=1.0,
        precision=4,
        step=0.1,
    )
    use_normal_cells: BoolProperty(
        name="Cells by Normal",
        description=(
            "Divide cells by the direction their surfaces face [Zhang 2023, §4.2]; without, by position alone. Passes "
            "and views of cells show the difference"
        ),
        default=True,
    )
