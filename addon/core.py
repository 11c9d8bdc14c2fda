"""Loads the native core on first use, and says in one sentence why it cannot be loaded.

Registering the add-on must work without the core: only a render needs it.
"""

import importlib
import sys
from pathlib import Path
from types import ModuleType

MODULE_NAME = "cistern_core"

CPU_INFO = Path("/proc/cpuinfo")

# The part of x86-64-v3 that Linux lists by name (`abm` is its word for LZCNT); the core is compiled for that level, so
# importing it on an older processor would end Blender with an illegal instruction.
REQUIRED_CPU_FLAGS = frozenset({"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"})


class CoreUnavailableError(RuntimeError):
    """The native core cannot be loaded; the text is a sentence for the user."""


def load() -> ModuleType:
    """The module `cistern_core`. Raises CoreUnavailableError."""
    missing = missing_cpu_flags(CPU_INFO)
    if missing:
        raise CoreUnavailableError(
            f"Cistern needs a processor of the x86-64-v3 level (2013 or later); this one lacks {', '.join(missing)}."
        )
    try:
        return importlib.import_module(MODULE_NAME)
    except (ImportError, OSError, RuntimeError) as error:
        raise CoreUnavailableError(explain(error, [Path(entry) for entry in sys.path if entry])) from error


def missing_cpu_flags(cpu_info: Path) -> list[str]:
    """Names of the required processor features that the system's list lacks; empty where there is no such list."""
    try:
        lines = cpu_info.read_text().splitlines()
    except OSError:
        return []
    for line in lines:
        key, _, value = line.partition(":")
        if key.strip() == "flags":
            return sorted(REQUIRED_CPU_FLAGS - set(value.split()))
    return []


def explain(error: Exception, search_path: list[Path]) -> str:
    """The sentence for a failed import, given the folders that were searched."""
    if not isinstance(error, ModuleNotFoundError) or error.name != MODULE_NAME:
        return f"Cistern's native core cannot be loaded: {error}"
    running = f"{sys.version_info.major}.{sys.version_info.minor}"
    others = sorted({binary.name for folder in search_path for binary in folder.glob(f"{MODULE_NAME}*.so")})
    if others:
        return f"Cistern's native core is not built for Python {running}; found only {', '.join(others)}."
    return f"Cistern's native core ({MODULE_NAME}) is not installed for Python {running}."


def is_core_error(error: BaseException) -> bool:
    """True for the exception with which the core refuses bad input: its text is meant for the user."""
    module = sys.modules.get(MODULE_NAME)
    return module is not None and isinstance(error, module.Error)
