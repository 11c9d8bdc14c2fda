"""What direct_bias and path_bias share: the options, and the table of a system's replicas against a reference's."""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path

from tests.support.statistics import Comparison

Row = tuple[str, str, str, Comparison]  # scene, system, bias


def parser(description: str) -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    result.add_argument("--replicas", type=int, default=64)
    result.add_argument("--frames", type=int, default=8)
    result.add_argument("--json", type=Path)
    return result


def show(table: Sequence[Row], file: Path | None) -> None:
    """Prints the table, and writes all its numbers where a file is named."""
    print("| scene | system | bias | mean / reference | worst block | standard errors | verdict |")
    print("|---|---|---|---|---|---|---|")
    for name, system, bias, c in table:
        verdict = "agrees" if c.agrees else "differs"
        mean = f"{c.ratio:.4f} ± {c.ratio_error:.4f}"
        print(f"| {name} | {system} | {bias} | {mean} | {c.largest_difference:.3f} | {c.largest_z:.1f} | {verdict} |")
    if file:
        keys = ("scene", "system", "bias")
        found = [dict(zip(keys, row[:3], strict=True)) | dataclasses.asdict(row[3]) for row in table]
        file.write_text(json.dumps(found, indent=1))
