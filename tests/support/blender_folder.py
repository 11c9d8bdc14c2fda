"""A user folder of their own for processes that import bpy."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile

VARIABLE = "BLENDER_USER_RESOURCES"


def use_own_folder() -> None:
    """To be called before the first import of bpy, which would read the user's own configuration otherwise. The folder
    goes when the interpreter ends, after all that was registered to run then by those who imported bpy. Where the
    variable is set it lies in that folder, whose owner then removes what processes leave that end by os._exit."""
    folder = tempfile.mkdtemp(prefix="cistern-blender-", dir=os.environ.get(VARIABLE))
    os.environ[VARIABLE] = folder
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
