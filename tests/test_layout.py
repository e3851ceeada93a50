"""One name, four places; and what every tracked file must keep to."""

import re
import subprocess
from pathlib import Path

import pytest

from tests import builds
from tests.builds import ROOT

RTL = sorted((ROOT / "rtl").rglob("*.v"))
LIMIT = 320  # lines in a file
MARKERS = re.compile(r"\b(TO" r"DO|FIX" r"ME|XX" r"X|HA" r"CK)\b")
ABSOLUTE = re.compile(r"(?<![\w.:/])/(home|root|work|Users|mnt|tmp|opt)/")


def places(module: Path) -> list[Path]:
    """The golden model, bench and page of a module. Leaf cells of rtl/common have no golden model."""
    folder = module.parent.relative_to(ROOT / "rtl")
    name = module.stem.removeprefix("gs_")
    golden = [] if folder == Path("common") else [Path("golden") / folder / f"{name}.py"]
    return [*golden, Path("tb") / folder / f"test_{name}.py", Path("docs") / folder / f"{name}.md"]


def tracked() -> list[Path]:
    """Files under version control, or, in an unpacked archive, those outside of generated folders."""
    listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listing.returncode == 0 and listing.stdout:
        names = [Path(name) for name in listing.stdout.split("\0") if name]
    else:
        generated = {".venv", "build", "out", ".git", "__pycache__", ".pytest_cache", ".ruff_cache", ".hypothesis"}
        names = [p.relative_to(ROOT) for p in ROOT.rglob("*") if not generated & set(p.relative_to(ROOT).parts)]
    return sorted(name for name in names if (ROOT / name).is_file())


def texts() -> list[tuple[Path, str]]:
    found = []
    for name in tracked():
        data = (ROOT / name).read_bytes()
        if b"\0" not in data:
            found.append((name, data.decode()))
    return found


@pytest.mark.parametrize("module", RTL, ids=lambda path: path.stem)
def test_a_module_has_its_golden_model_bench_and_page(module):
    missing = [str(place) for place in places(module) if not (ROOT / place).is_file()]
    assert not missing, f"{module.relative_to(ROOT)} lacks {', '.join(missing)}"


@pytest.mark.parametrize("module", RTL, ids=lambda path: path.stem)
def test_a_file_holds_the_one_module_it_is_named_after(module):
    assert re.findall(r"^\s*module\s+(\w+)", module.read_text(), re.MULTILINE) == [module.stem]
    assert module.stem.startswith("gs_")


@pytest.mark.parametrize("module", RTL, ids=lambda path: path.stem)
def test_implicit_nets_are_off_in_the_file_only(module):
    text = module.read_text()
    assert text.count("`default_nettype none\n") == 1 and text.endswith("`default_nettype wire\n")


def test_no_bench_or_page_of_a_module_that_is_gone():
    modules = builds.modules()
    stale = [p for p in (ROOT / "tb").rglob("test_*.py") if p.stem.replace("test_", "gs_", 1) not in modules]
    for core in ("sorting_core", "raster_core", "common"):
        stale += [p for p in (ROOT / "docs" / core).glob("*.md") if not (ROOT / f"rtl/{core}/gs_{p.stem}.v").exists()]
    assert not [str(path.relative_to(ROOT)) for path in stale]


def test_files_are_short():
    long = {str(n): t.count("\n") for n, t in texts() if n.suffix in (".v", ".py") and t.count("\n") > LIMIT}
    assert not long, f"more than {LIMIT} lines: {long}"


def test_no_markers_of_unfinished_work():
    assert not [f"{name}: {match[0]}" for name, text in texts() for match in [MARKERS.search(text)] if match]


def test_no_absolute_paths():
    assert not [f"{name}: {match[0]}" for name, text in texts() for match in [ABSOLUTE.search(text)] if match]
