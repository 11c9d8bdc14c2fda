"""Shadow catchers: surfaces of which a picture shows nothing but the shadows that others cast on them.

Besides the picture of the scene, of which the core's pass Caught is what is seen on catchers, there is one of the
catchers alone, by the same random numbers. The quotient of the two is the shadow: exactly 1 where paths met nothing
else. Laid over footage, or over the world where the film is not transparent, it darkens that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import denoise
from .techniques import REFERENCE
from .view_modes import Picture, Reader, with_passes

CAUGHT_PASS = "Caught"
SHADOW_PASS = "Shadow Catcher"

# Of the time limit, if there is one, for the picture of the scene; the rest is for that of the catchers alone.
SCENE_SHARE = 0.6


@dataclass(frozen=True)
class ShadowPlan:
    """What a view layer with shadow catchers renders. `is_apart`: shadows are in a pass of their own, for the
    compositor, and not in Combined."""

    arguments: dict[str, Any]
    """Of the core's `Settings`, as if there were no catchers."""
    is_apart: bool

    @property
    def needs_backdrop(self) -> bool:
        return not (self.is_apart or self.arguments["film_transparent"])

    def scene_arguments(self) -> dict[str, Any]:
        return self.arguments | {
            "passes": [*self.arguments["passes"], CAUGHT_PASS],
            "film_transparent": self.needs_backdrop or self.arguments["film_transparent"],
            "groups_behind_film": self.needs_backdrop or self.arguments["groups_behind_film"],
            "time_limit": self.arguments["time_limit"] * SCENE_SHARE,
            "adaptive_sampling": False,  # samples of a pixel are those of the picture of catchers alone
            "find_openings": False,  # for the same reason
            "caustic_guide": False,
        }

    def alone_arguments(self, samples: int) -> dict[str, Any]:
        """`samples`: of the picture of the scene."""
        changes = {
            "passes": [CAUGHT_PASS],
            "film_transparent": True,
            "samples": samples,
            "time_limit": self.arguments["time_limit"] * (1.0 - SCENE_SHARE),
            "noise_threshold": 0.0,
            "find_openings": False,
            "caustic_guide": False,
        }
        return self.arguments | changes

    def backdrop_arguments(self, samples: int) -> dict[str, Any]:
        general = ("width", "height", "region", "seed", "threads", "pixel_filter", "filter_width", "film_exposure")
        general += ("shutter_curve",)
        return {
            **{name: self.arguments[name] for name in general if name in self.arguments},
            **REFERENCE,
            "samples": samples,
            "passes": ["Environment"],
            "find_openings": False,
        }


def unshadowed(read: Reader) -> Reader:
    """Reads the pass of shadows, too, of which the core knows nothing: as if there were none."""
    return lambda name: np.ones_like(read("Combined")[..., :3]) if name == SHADOW_PASS else read(name)


def hidden(read: Reader) -> Reader:
    """Combined without what is seen on catchers, as long as their shadows are not known."""
    matte = read("Combined") - read(CAUGHT_PASS)
    return with_passes(read, {"Combined": matte, denoise.NOISY_PASS: matte})


def without_catchers(read: Reader) -> Reader:
    """Combined without what is seen on catchers, for denoisers as one layer."""
    matte = read("Combined") - read(CAUGHT_PASS)
    nothing = np.zeros_like(matte[..., :3])
    return with_passes(read, {"Combined": matte} | dict.fromkeys(denoise.LAYER_PASSES, nothing))


def shadow(read: Reader, read_alone: Reader) -> Picture:
    """(height, width, 3): the share of light that other surfaces leave to catchers, 1 where there are none; more than 1
    where they bring light. By the passes of the picture of the scene, and of that of catchers alone."""
    caught, alone = read(CAUGHT_PASS), read_alone(CAUGHT_PASS)
    # Both over the part of the pixel that their samples found catchers in, which is left to chance behind surfaces that
    # are partly transparent.
    light, unshadowed = caught[..., :3] * alone[..., 3:], alone[..., :3] * caught[..., 3:]
    quotient = np.divide(light, unshadowed, out=np.ones_like(light), where=unshadowed > 0.0)
    # Over white where the film shows through, so that edges of catchers do not count twice.
    alpha = np.clip(read("Combined")[..., 3:], 0.0, 1.0)
    return 1.0 + alpha * (quotient - 1.0)


def over_shadow(matte: Picture, shadow_share: Picture, backdrop: Picture | None) -> Picture:
    """(height, width, 4), premultiplied: the rest of the picture laid over the shadow, and both over the backdrop
    (height, width, 3) if there is one. Alpha knows no colours: the shadow is the mean of its channels."""
    darkness = 1.0 - np.clip(shadow_share.mean(axis=2, keepdims=True), 0.0, 1.0)
    covered = np.clip(matte[..., 3:], 0.0, 1.0)
    alpha = covered + (1.0 - covered) * darkness
    if backdrop is None:
        return np.concatenate([matte[..., :3], alpha], axis=2)
    return np.concatenate([matte[..., :3] + (1.0 - alpha) * backdrop, np.ones_like(alpha)], axis=2)


def beside(matte: Picture, backdrop: Picture) -> Picture:
    """(height, width, 3): of the backdrop, what is not behind the rest of the picture."""
    return (1.0 - np.clip(matte[..., 3:], 0.0, 1.0)) * backdrop
