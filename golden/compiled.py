"""Where numba keeps compiled code: a folder for each module and the sources that it depends on.

numba keys its cache on the one file of a function: an edited constant or an inlined unit of another file would go
unnoticed. Chosen by golden/__init__.py (NUMBA_CACHE_LOCATOR_CLASSES).
"""

from __future__ import annotations

import ast
import hashlib
import os
from functools import cache
from pathlib import Path

from numba.core import config
from numba.core.caching import UserProvidedCacheLocator

ROOT = Path(__file__).resolve().parent


@cache
def _source(path: Path) -> bytes:
    return path.read_bytes()


def _file(module: str) -> Path | None:
    """Source of a module of this package, if it is one."""
    path = ROOT.parent.joinpath(*module.split("."))
    return next((f for f in (path.with_suffix(".py"), path / "__init__.py") if f.is_file()), None)


@cache
def imports(path: Path) -> frozenset[Path]:
    """Sources of this package that a source imports, but for those that only a type checker reads."""
    found = set()
    nodes = [ast.parse(_source(path))]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            continue
        nodes += ast.iter_child_nodes(node)
        names = []
        if isinstance(node, ast.ImportFrom) and not node.level and node.module.split(".")[0] == ROOT.name:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names if alias.name.split(".")[0] == ROOT.name]
        found.update(file for file in map(_file, names) if file is not None)
    return frozenset(found - {ROOT / "__init__.py"})


@cache
def sources(path: Path) -> frozenset[Path]:
    """A source and every source of this package that it imports, directly or not."""
    found, waiting = {path}, [path]
    while waiting:
        new = imports(waiting.pop()) - found
        found |= new
        waiting += new
    return frozenset(found)


@cache
def stamp(path: Path) -> str:
    """Hash of sources(path)."""
    text = hashlib.sha256()
    for source in sorted(sources(path)):
        text.update(os.path.relpath(source, ROOT).encode() + b"\0" + _source(source))
    return text.hexdigest()[:16]


class Locator(UserProvidedCacheLocator):
    """numba's locator for functions of this package; others have numba's own."""

    def get_cache_path(self) -> str:
        return str(Path(config.CACHE_DIR) / f"{Path(self._py_file).stem}-{stamp(Path(self._py_file).resolve())}")

    @classmethod
    def from_function(cls, py_func, py_file):
        inside = Path(py_file).resolve().is_relative_to(ROOT)
        return super().from_function(py_func, py_file) if inside else None
