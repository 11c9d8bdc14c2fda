"""matplotlib, which nothing but the plots of benchmarks needs."""

from __future__ import annotations

from types import ModuleType

MISSING = "matplotlib, which draws the plots, is not installed: .venv/bin/pip install matplotlib"


def require_matplotlib() -> None:
    """Ends the command with one line and status 1 where it is missing: to be called before anything is rendered."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise SystemExit(MISSING) from None


def load_pyplot() -> ModuleType:
    """Draws to files, with or without a screen."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot
