"""Makes addon/package.py and its parts importable, as they are where that is run."""

from tests.extension import environments  # noqa: F401
