"""What files and the compositor have to know of mattes: which names stand behind the ids.

Keys and values are those of the Cryptomatte specification 1.2.0, as Cycles writes them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import bpy

from .passes import matte_kinds, matte_layer_name

if TYPE_CHECKING:
    from types import ModuleType


def stamp(
    engine: bpy.types.RenderEngine,
    view_layer: bpy.types.ViewLayer,
    names: Mapping[str, Iterable[str]],
    core: ModuleType,
) -> None:
    """Write the manifests of the view layer's mattes into the metadata of the render; `names` by kind."""
    for kind in matte_kinds(view_layer):
        layer = f"{view_layer.name}.{matte_layer_name(kind)}"
        for key, value in metadata(layer, names[kind], core).items():
            engine.get_result().stamp_data_add_field(key, value)


def metadata(layer: str, names: Iterable[str], core: ModuleType) -> dict[str, str]:
    """Of a layer of mattes, all that a reader needs to find things in it by name."""
    prefix = f"cryptomatte/{hex_hash(layer, core)[:7]}"
    manifest = {name: hex_hash(name, core) for name in sorted(names)}
    return {
        f"{prefix}/name": layer,
        f"{prefix}/hash": "MurmurHash3_32",
        f"{prefix}/conversion": "uint32_to_float32",
        f"{prefix}/manifest": json.dumps(manifest, ensure_ascii=False, separators=(",", ":")),
    }


def hex_hash(name: str, core: ModuleType) -> str:
    return f"{core.matte_hash(name):08x}"
