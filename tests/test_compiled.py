"""Compiled code is kept under what it depends on: golden/compiled.py."""

import os
import subprocess
import sys

from golden.compiled import ROOT, sources


def names(module: str) -> set[str]:
    return {path.relative_to(ROOT).as_posix() for path in sources(ROOT / module)}


def test_code_depends_on_constants_and_inlined_units_only():
    found = names("raster_core/subtile_blender.py")
    assert {"params.py", "fixed.py", "raster_core/exp2_unit.py", "raster_core/power_unit.py"} <= found
    assert not {"oracle.py", "commands.py", "frame.py", "timing/engine.py"} & found


def test_what_only_a_type_checker_reads_is_no_source():
    assert "from golden.frame import Frame" in (ROOT / "timing/preprocess_engine.py").read_text()
    assert "frame.py" not in names("timing/preprocess_engine.py")


def test_functions_of_the_package_are_kept_there(tmp_path):
    code = (
        "from golden import compiled, fixed\n"
        "print(fixed.half_up._cache.cache_path, compiled.stamp(compiled.ROOT / 'fixed.py'))"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    environment.pop("NUMBA_CACHE_LOCATOR_CLASSES", None)
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    where, stamp = ran.stdout.split()
    assert where == str(tmp_path / f"fixed-{stamp}")
