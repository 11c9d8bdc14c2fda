"""Loads the native core on first use, and says in one sentence why it cannot be loaded.

Registering the add-on must work without the core: only a render needs it.
"""

import importlib
import sys
from pathlib import Path
from types import ModuleType

MODULE_NAME = "cistern_core"

# For the user: what the extension brings.
SUPPORTED = "Python 3.11 (Blender 4.2 to 5.0) and 3.13 (Blender 5.1 to 5.3) on Linux x86-64"


class CoreUnavailableError(RuntimeError):
    """The native core cannot be loaded; the text is a sentence for the user."""


def load() -> ModuleType:
    """The module `cistern_core`. Raises CoreUnavailableError."""
    try:
        return importlib.import_module(MODULE_NAME)
    except (ImportError, OSError, RuntimeError) as error:
        raise CoreUnavailableError(explain(error, [Path(entry) for entry in sys.path if entry])) from error


def explain(error: Exception, search_path: list[Path]) -> str:
    """The sentence for a failed import, given the folders that were searched."""
    if not isinstance(error, ModuleNotFoundError) or error.name != MODULE_NAME:
        return f"Cistern's native core cannot be loaded: {error}"
    running = f"{sys.version_info.major}.{sys.version_info.minor}"
    others = sorted({binary.name for folder in search_path for binary in folder.glob(f"{MODULE_NAME}*.so")})
    if others:
        return f"Cistern's native core is not built for Python {running}; found only {', '.join(others)}."
    return f"Cistern's native core is not installed for Python {running}; its extension has it for {SUPPORTED}."


def status() -> tuple[bool, str]:
    """Whether the core can be loaded, and a sentence for the user: which core it is, or why it cannot."""
    try:
        module = load()
    except CoreUnavailableError as error:
        return False, str(error)
    return True, f"Native core {module.__version__} with Embree {module.EMBREE_VERSION} is ready."


def is_core_error(error: BaseException) -> bool:
    """True for the exception with which the core refuses bad input: its text is meant for the user."""
    module = sys.modules.get(MODULE_NAME)
    return module is not None and isinstance(error, module.Error)
