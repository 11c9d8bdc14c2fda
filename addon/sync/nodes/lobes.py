"""How many lobes a surface may have at once: the core holds so many of them and leaves out the rest."""

from __future__ import annotations

from collections.abc import Iterable

from .instructions import Value

MAX_LOBES = 64  # Bsdf::kMaxLobes of native/shading/bsdf.h

_WITHOUT_LOBES = (
    "CLOSURE_RAY_PORTAL",
    *("CLOSURE_TRANSPARENT", "CLOSURE_EMISSION", "CLOSURE_HOLDOUT", "CLOSURE_NORMAL", "CLOSURE_AOV"),
    *("CLOSURE_VOLUME", "CLOSURE_VOLUME_EMISSION", "CLOSURE_DISPLACEMENT", "CLOSURE_DISPLACED_BUMP"),
)
# Operands by their place in native/scene/op_table.cpp.
_ROUGHNESS_AND_NORMAL = {"CLOSURE_DIFFUSE": (2, 3), "CLOSURE_PRINCIPLED": (7, 6)}  # of diffuse reflection
_PRINCIPLED_LAYERS = (2, 14, 15, 20)  # metallic, transmission, coat, sheen
_THIN_LAYERS = (8, 8, 14)  # of thin walls: subsurface scattering to either side, and what passes glass
_IS_THIN = 3  # by its place in the parameters


def most_lobes(closures: Iterable[tuple[str, tuple[Value, ...], tuple[int, ...]]]) -> int:
    """What these closures add up to where none is negligible. The core merges diffuse lobes of one normal."""
    count, merged = 0, set()
    for op, inputs, parameters in closures:
        if op in _WITHOUT_LOBES:
            continue
        roughness, normal = _ROUGHNESS_AND_NORMAL.get(op, (None, None))
        if roughness is not None and _is_zero(inputs[roughness]):
            merged.add(inputs[normal])
        else:
            count += 1
        if op == "CLOSURE_PRINCIPLED":
            layers = _PRINCIPLED_LAYERS + (_THIN_LAYERS if parameters[_IS_THIN] else ())
            count += 1 + sum(not _is_zero(inputs[layer]) for layer in layers)  # 1: specular reflection
    return count + len(merged)


def _is_zero(value: Value) -> bool:
    return value.constant is not None and value.constant[0] == 0.0
