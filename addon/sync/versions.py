"""What differs between Blender 4.2 and 5.x, found out by looking for the feature; versions are compared only where
Cycles makes something else of the same data."""

from __future__ import annotations

import importlib
import sys
import warnings
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np

_HAS_5_0 = bpy.app.version >= (5, 0, 0)
_HAS_5_1 = bpy.app.version >= (5, 1, 0)
_HAS_5_2 = bpy.app.version >= (5, 2, 0)
_HAS_5_3 = bpy.app.version >= (5, 3, 0)


def image_reader() -> ModuleType | None:
    """OpenImageIO from the Python path, or the copy that Blender carries beside its interpreter, or None."""
    return _bundled("OpenImageIO")


def volume_reader() -> ModuleType | None:
    """OpenVDB in the same way, under the name it has from Blender 4.4 on or the one before; None where there is none,
    as in the Python wheels of Blender 4.2."""
    return _bundled("openvdb") or _bundled("pyopenvdb")


def colour_reader() -> ModuleType | None:
    """OpenColorIO in the same way; None in the Python wheels of Blender 4.2."""
    return _bundled("PyOpenColorIO")


def _bundled(name: str) -> ModuleType | None:
    bundled = bpy.utils.system_resource("PYTHON")
    if bundled:
        version = f"python{sys.version_info.major}.{sys.version_info.minor}"
        site_packages = str(Path(bundled) / "lib" / version / "site-packages")
        if site_packages not in sys.path:
            sys.path.append(site_packages)
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def joins_links() -> bool:
    """Whether Blender resolves shader trees for engines: Cycles then sees values in place of links that carry them."""
    return _HAS_5_0


def working_space() -> str:
    """Name of the file's scene-linear colour space; before files could choose, it was always Rec. 709."""
    settings = getattr(bpy.data, "colorspace", None)
    return settings.working_space if settings is not None else "Linear Rec.709"


def light_strength(light: bpy.types.Light) -> np.ndarray:
    """Colour times energy times 2^exposure, tinted by the colour temperature: (3,) scene-linear, unit by light type."""
    strength = np.array(light.color, np.float64) * light.energy * 2.0 ** getattr(light, "exposure", 0.0)
    if getattr(light, "use_temperature", False):
        strength = strength * np.array(light.temperature_color, np.float64)
    return strength


def light_is_normalized(light: bpy.types.Light) -> bool:
    """Whether the energy is a power, independent of the light's size."""
    return getattr(light, "normalize", True)


def light_casts_shadow(light: bpy.types.Light) -> bool:
    """Cycles' own switch where it still exists, else the one all engines share."""
    cycles = getattr(light, "cycles", None)
    return getattr(cycles, "cast_shadow", light.use_shadow)


def materials_are_trees() -> bool:
    """Whether every material has nodes, as from 5.0 on. There Cycles shows what has no material as a new Principled
    BSDF, before as diffuse."""
    return _HAS_5_0


def alpha_mode_decides() -> bool:
    """Whether Cycles goes by the Alpha Mode of images, and not by what their files say of themselves."""
    return _HAS_5_1


def has_old_voronoi_cells() -> bool:
    """Whether Cycles places the cells of Voronoi textures of two dimensions and more by another hash."""
    return not _HAS_5_0


def wraps_scaled_magic() -> bool:
    """Whether Cycles wraps the coordinates of Magic textures around after they are scaled, not before."""
    return _HAS_5_2


def films_cover_metal() -> bool:
    """Whether Cycles lets a thin film lie on metal, too."""
    return _HAS_5_0


def radius_is_free_path() -> bool:
    """Whether the radius of subsurface scattering by Random Walk is the mean free path, as from 5.2 on, where what it
    was before has become Random Walk Legacy."""
    return _HAS_5_2


def rough_diffuse_is_dim() -> bool:
    """Whether light that is reflected more than once between its facets is coloured once too often."""
    return not _HAS_5_3


def coats_are_whole() -> bool:
    """Whether a part that a coat covers is both dimmed and tinted, and the rest neither."""
    return _HAS_5_3


def glass_is_anisotropic() -> bool:
    """Whether that of a Principled BSDF is where its metal is."""
    return _HAS_5_3


def thin_glass_is_wide() -> bool:
    """Whether thin walls of glass spread what passes them more, as in the first version that has them."""
    return not _HAS_5_3


def bump_filter_width() -> float:
    """Of a new Bump node, in pixels, which is that of displacement too; 1 before it could be chosen (Blender 4.2)."""
    return 0.1 if hasattr(bpy.types, "ShaderNodeBsdfMetallic") else 1.0


def poly_curves_are_straight() -> bool:
    """Whether Cycles draws hair curves of the type Poly straight between their keys."""
    return _HAS_5_0


def box_projections_end() -> bool:
    """Whether those of tiled images are magenta outside the first tile, in place of repeating it."""
    return _HAS_5_2


def baked_pixel_step() -> float:
    """What part of a pixel the derivatives are for that Blender tells an engine that bakes."""
    return 1.0 if _HAS_5_2 else 0.5


def voxel_centre() -> float:
    """Where in a voxel of an OpenVDB file its value lies: at its lower corner, as in OpenVDB, from 5.0 on;
    before in its middle."""
    return 0.0 if _HAS_5_0 else 0.5


def tiles_end_sharply() -> bool:
    """Whether Cycles cuts off what interpolation reaches around grids that are tiles alone."""
    return not _HAS_5_2


def uses_nodes(block: bpy.types.Material | bpy.types.World | bpy.types.Light) -> bool:
    """Whether it is what its nodes make of it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # from 5.0 on every block has a tree
        return block.node_tree is not None and getattr(block, "use_nodes", True)


def cycles_setting(data_block: bpy.types.ID, name: str, default: Any) -> Any:  # noqa: ANN401
    """A setting that lives with the Cycles add-on, or `default` where that add-on is disabled."""
    return getattr(getattr(data_block, "cycles", None), name, default)


def adaptive_switch(obj: bpy.types.Object) -> bpy.types.bpy_struct | None:
    """What has the switch `use_adaptive_subdivision` of an object whose last modifier subdivides: from 5.0 on the
    modifier, before the object, by Cycles' add-on. None for others."""
    last = obj.modifiers[-1] if len(obj.modifiers) else None
    if last is None or last.type != "SUBSURF":
        return None
    return last if hasattr(last, "use_adaptive_subdivision") else getattr(obj, "cycles", None)


def adaptive_edges(obj: bpy.types.Object, scene: bpy.types.Scene) -> tuple[float, float] | None:
    """How long the edges of an object may be that its last modifier subdivides adaptively: in pixels, and in its own
    space, 0 where pixels count. None for others. Before 5.0 it is an experimental feature of Cycles."""
    switch = adaptive_switch(obj)
    if switch is None or not switch.use_adaptive_subdivision:
        return None
    if isinstance(switch, bpy.types.Modifier):
        return (
            switch.adaptive_pixel_size,
            switch.adaptive_object_edge_length if switch.adaptive_space == "OBJECT" else 0.0,
        )
    is_on = cycles_setting(scene, "feature_set", "SUPPORTED") == "EXPERIMENTAL"
    return (switch.dicing_rate, 0.0) if is_on else None
