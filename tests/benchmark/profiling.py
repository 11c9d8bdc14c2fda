"""Where the CPU time of a command goes, by Linux `perf` (package linux-perf)."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERTZ = 499  # samples for each second of CPU time
PROCESS_SECONDS = 1200
# First pattern that a library's name contains; what none matches is OTHER.
GROUPS = (
    ("Embree", "embree"),
    ("Cistern", "cistern_core"),
    ("TBB", "tbb"),
    ("C library", "libm"),
    ("C library", "libc"),
)
OTHER = "other"
LIBRARIES = (*dict.fromkeys(group for group, _ in GROUPS), OTHER)


def library_group(library: str) -> str:
    return next((group for group, pattern in GROUPS if pattern in library), OTHER)


def require_perf() -> None:
    """Ends the command with one line where it is missing: to be called before anything is rendered."""
    if shutil.which("perf") is None:
        raise SystemExit("perf is missing: install the package linux-perf")


def profile(command: Sequence[str], said: str) -> Counter[tuple[str, str]]:
    """Samples by library and symbol of a whole process; the kernel's own time is left out. Ends the command when the
    process fails, or does not print `said`."""
    with tempfile.TemporaryDirectory(prefix="cistern-perf-") as folder:
        file = str(Path(folder) / "perf.data")
        record = ["perf", "record", "-q", "-e", "cpu-clock:u", "-F", str(HERTZ), "-o", file, "--", *command]
        limits = dict(capture_output=True, text=True, timeout=PROCESS_SECONDS, cwd=ROOT)
        done = subprocess.run(record, check=False, **limits)
        if done.returncode != 0 or said not in done.stdout:
            raise SystemExit(f"{' '.join(command)} failed:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
        report = ["perf", "report", "-q", "-n", "--stdio", "--sort", "dso,symbol", "-i", file]
        table = subprocess.run(report, check=True, **limits).stdout
    result: Counter[tuple[str, str]] = Counter()
    for count, library, symbol in re.findall(r"^\s*[\d.]+%\s+(\d+)\s+(\S+)\s+\[.\]\s+(.*?)\s*$", table, re.MULTILINE):
        result[library, symbol] += int(count)
    return result
