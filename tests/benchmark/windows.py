"""What openings and light through panes are worth, to look at: rooms with a window by Cycles and by Cistern, for equal
CPU time.

  python -m tests.benchmark.windows [--seconds 20] [--size 360 270] [--output tests/benchmark/plots]

Writes windows.jpg. Above, under an even world and a sky, Cycles, Cycles with a portal in the window, Final without
openings and with them; below, where the sun shines in through glass, Cycles, Cycles with glass that throws no shadow
(as one helps oneself), Final without openings and light through panes, and with both. One thread; `--seconds` are those
of the samples, told from two short renders.
"""

from __future__ import annotations

from tests.benchmark.equal_time import Picture, run
from tests.benchmark.everyday.scenes import PANE, SCENES


def window(title: str, scene: str, engine: str, finds: bool = False, is_shadowless: bool = False) -> Picture:
    """`finds`: openings, and light through panes; `is_shadowless`: the glass."""

    def build() -> None:
        import bpy

        SCENES[scene]()
        if is_shadowless:
            bpy.context.scene.objects[PANE].visible_shadow = False

    return Picture(title, engine, build, {"find_openings": finds, "light_through_panes": finds})


def open_window(world: str) -> tuple[Picture, ...]:
    return (
        window("Cycles", f"window_{world}", "CYCLES"),
        window("Cycles with a portal", f"portal_{world}", "CYCLES"),
        window("Final without openings", f"window_{world}", "CISTERN"),
        window("Final", f"window_{world}", "CISTERN", finds=True),
    )


ROWS = {
    "even world": open_window("world"),
    "sky": open_window("sky"),
    "sun behind glass": (
        window("Cycles", "glazed_sun", "CYCLES"),
        window("Cycles, glass without shadow", "glazed_sun", "CYCLES", is_shadowless=True),
        window("Final without light through panes", "glazed_sun", "CISTERN"),
        window("Final", "glazed_sun", "CISTERN", finds=True),
    ),
}


if __name__ == "__main__":
    run(__doc__, ROWS, "windows.jpg")
