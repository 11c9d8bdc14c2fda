"""Where the CPU time of a frame goes, by library and kind of work: the difference of two profiles."""

from __future__ import annotations

import sys
from collections import Counter

from tests.benchmark.profiling import LIBRARIES, library_group, profile, require_perf
from tests.benchmark.scaling.measure import FINAL, PATH_TRACER, SYSTEMS

SCENES = ("city_grid", "bright_interior", "door_ajar")  # of the scoreboard
BOUNCES = 12
EMBREE_ASKED, BOOKKEEPING_ASKED = 50.0, 10.0  # percent: at least, at most
BOOKKEEPING = "sorting, bookkeeping"
# In names of our functions: cells and groups of pixels, records of light and the tables made from them, the film.
BOOKKEEPING_WORDS = (
    *("sort", "HashGrid", "CellGroups", "make_groups", "cell_key", "cell_level", "normal_bin", "group_class"),
    *(
        "ClusterStatistics",
        "CellTraining",
        "LearnedLightTable::add_row",
        "light_record",
        "collect_records",
        "sum_equal_pairs",
    ),
    *("start_pixel", "BandedFrame::finish", "Film::", "add_to_film"),
)
COLUMNS = (*LIBRARIES[:2], BOOKKEEPING, *LIBRARIES[2:])


def kind_of_work(library: str, symbol: str) -> str:
    group = library_group(library)
    if group == "Cistern" and any(word in symbol for word in BOOKKEEPING_WORDS):
        return BOOKKEEPING
    return group


def has_symbols(counts: Counter[tuple[str, str]]) -> bool:
    """Of ours; a stripped library has addresses in their place."""
    ours = [symbol for library, symbol in counts if library_group(library) == "Cistern"]
    return any("cistern::" in symbol for symbol in ours)


def shares(scene: str, system: str, pixels: int, samples: list[int]) -> dict[str, float]:
    """Percent by column. Ends the command where the core has no symbols."""
    module = "tests.benchmark.scaling.breakdown"
    few, many = (
        profile([sys.executable, "-m", module, scene, system, str(pixels), str(n)], "rendered") for n in samples
    )
    if not has_symbols(many):
        raise SystemExit("The core is stripped: configure it with -DCMAKE_STRIP= so that perf can name its functions")
    many.subtract(few)
    found: Counter[str] = Counter()
    for (library, symbol), count in many.items():
        found[kind_of_work(library, symbol)] += count
    return {column: 100.0 * found[column] / found.total() for column in COLUMNS}


def table(scenes: list[str], pixels: int, samples: list[int]) -> list[str]:
    """Of both systems; asked of Embree and of sorting and bookkeeping, in the head."""
    require_perf()
    asked = {COLUMNS[0]: f" (≥ {EMBREE_ASKED:.0f})", BOOKKEEPING: f" (≤ {BOOKKEEPING_ASKED:.0f})"}
    lines = ["| scene | system | " + " | ".join(f"{c} %{asked.get(c, '')}" for c in COLUMNS) + " |"]
    lines.append("|---" * (len(COLUMNS) + 2) + "|")
    for scene in scenes:
        for system in (PATH_TRACER, FINAL):
            found = shares(scene, system, pixels, samples)
            lines.append(f"| {scene} | {system} | " + " | ".join(f"{v:.1f}" for v in found.values()) + " |")
            print(lines[-1], flush=True)
    return lines


def render(scene: str, system: str, pixels: str, samples: str) -> None:
    """Inside the sampled process."""
    from tests.benchmark.papers.sessions import Sessions
    from tests.benchmark.scoreboard.catalogue import scene_named

    sessions = Sessions(scene_named(scene), int(pixels), BOUNCES, "TREE")
    sessions.mean(int(samples), 1, **SYSTEMS[system])
    print("rendered", flush=True)


if __name__ == "__main__":
    render(*sys.argv[1:])
