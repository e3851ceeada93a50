"""splatcore's golden model: what the RTL computes, bit for bit, and when, cycle for cycle."""

import os
from pathlib import Path

__version__ = "0.1.0"


def _compiled_code() -> str:
    """Folder for numba's compiled code (golden/compiled.py)."""
    project = Path(__file__).resolve().parent.parent
    checkout = (project / "pyproject.toml").exists()
    return str((project / "build" if checkout else Path.home() / ".cache" / "splatcore") / "numba")


os.environ.setdefault("NUMBA_CACHE_DIR", _compiled_code())
os.environ.setdefault("NUMBA_CACHE_LOCATOR_CLASSES", "golden.compiled.Locator,UserProvidedCacheLocator")
