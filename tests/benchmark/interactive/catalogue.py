"""What happens to a scene, and the systems that then render it."""

from __future__ import annotations

from dataclasses import dataclass

from tests.benchmark.scoreboard.catalogue import CYCLES, PATH_TRACER, Engine
from tests.benchmark.scoreboard.catalogue import engine_named as scoreboard_engine

FRAMES = (1, 4, 16, 32)  # after the event; in the pan, since it began
FRAMES_BEFORE = 16  # at rest, which leave a history
PAN_DEGREES, PAN_METRES = 0.25, 0.01  # of each frame


@dataclass(frozen=True)
class Moment:
    """The scene, but with its camera turned to the left about the vertical and moved along its own X axis, and with one
    glowing material of another brightness."""

    degrees: float = 0.0
    metres: float = 0.0
    brightness: float = 1.0


REST = Moment()  # in which all events end
ELSEWHERE = Moment(degrees=90.0)
DIMMED = Moment(brightness=0.5)


def pan(frame: int) -> Moment:
    """Frame 0 is where the camera rests before it."""
    left = FRAMES[-1] - frame
    return Moment(left * PAN_DEGREES, left * PAN_METRES) if left else REST


MOMENTS = (ELSEWHERE, DIMMED, *(pan(frame) for frame in range(FRAMES[-1] + 1)))
BEFORE: dict[str, Moment | None] = {"cold start": None, "camera cut": ELSEWHERE, "light edit": DIMMED}
PAN = "slow pan"
EVENTS = (*BEFORE, PAN)

OURS = "interactive"
ENGINES = (
    Engine(OURS, "Interactive (ours)", "OURS", {"preset": "INTERACTIVE"}),
    Engine("final", "Final (ours), no history", "OURS", {"preset": "FINAL"}),
    Engine("ouyang", "ReSTIR GI [Ouyang 2021]", "PAPERS", {"preset": "RESTIR_GI", "direct": "RESTIR"}),
    Engine("zhang", "world-space paths [Zhang 2023]", "PAPERS", {"preset": "WORLD_PATHS", "direct": "RESTIR"}),
    Engine(PATH_TRACER, "path tracer", "PATH", {"preset": "PATH_TRACING"}),
    scoreboard_engine(CYCLES),
    scoreboard_engine("cycles-front"),
)


def engine_named(name: str) -> Engine:
    return next(engine for engine in ENGINES if engine.name == name)


def is_cycles(engine: Engine) -> bool:
    return engine.engine_id == "CYCLES"
