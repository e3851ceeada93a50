"""splatcore's golden model: what the RTL computes, bit for bit, and when, cycle for cycle."""

import hashlib
import os
from pathlib import Path

__version__ = "0.1.0"


def _compiled_code() -> str:
    """Folder for numba's compiled code, named after every source that could be part of it.

    numba keys its cache on the one file of a function: an edited constant or inlined unit would go unnoticed.
    """
    here = Path(__file__).resolve().parent
    sources = hashlib.sha256()
    for path in sorted(here.rglob("*.py")):
        sources.update(path.name.encode() + b"\0" + path.read_bytes())
    checkout = (here.parent / "pyproject.toml").exists()
    root = here.parent / "build" if checkout else Path.home() / ".cache" / "splatcore"
    return str(root / "numba" / sources.hexdigest()[:16])


os.environ.setdefault("NUMBA_CACHE_DIR", _compiled_code())
