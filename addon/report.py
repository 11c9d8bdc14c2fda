"""What a rendered view layer cost and what went wrong, as one printed line that scripts can read."""

import contextlib
import json
import sys
import traceback
from dataclasses import asdict, dataclass, field

LINE_PREFIX = "CISTERN "

# More than the view layers of any one frame; keeps a long animation from filling memory.
KEPT_REPORTS = 256


@dataclass
class RenderReport:
    """The line of one view layer. Times in seconds include the export of the scene, `sync_seconds` alone is the export;
    memory is the core's largest use in megabytes (10^6 bytes). `samples` are the most that a pixel has, `mean_samples`
    fewer with adaptive sampling. `noise` is the most of any block of pixels but the noisiest twentieth, None where it
    was not looked at."""

    frame: int
    layer: str
    samples: int = 0
    mean_samples: float = 0.0
    noise: float | None = None
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    sync_seconds: float = 0.0
    peak_memory_mb: float = 0.0
    warnings: list[str] = field(default_factory=list)
    error: str | None = None

    def warn_once(self, warning: str) -> None:
        """Several views of a layer have the same to say."""
        if warning not in self.warnings:
            self.warnings.append(warning)


# The reports of this process, newest last.
last: list[RenderReport] = []

# View layers of this process whose render failed.
error_count = 0


def last_report() -> RenderReport | None:
    """The newest report, or None before the first render."""
    return last[-1] if last else None


def line(report: RenderReport) -> str:
    """`CISTERN {json}`, without line breaks and in ASCII, whatever the names of the data-blocks."""
    values = {key: round(value, 6) if isinstance(value, float) else value for key, value in asdict(report).items()}
    return LINE_PREFIX + json.dumps(values)


def print_traceback(error: Exception) -> None:
    """Of an unforeseen error, to standard error."""
    with contextlib.suppress(OSError, ValueError):  # nobody reads it any more
        traceback.print_exception(error)


def publish(report: RenderReport) -> None:
    """Keep the report and print its line."""
    global error_count
    error_count += report.error is not None
    last.append(report)
    del last[:-KEPT_REPORTS]
    with contextlib.suppress(OSError, ValueError):  # nobody reads it any more
        sys.stdout.write(line(report) + "\n")
        sys.stdout.flush()
