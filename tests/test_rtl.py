"""Every bench, with each of its parameter sets, on each simulator that is installed; some with other number formats."""

import shutil
from dataclasses import replace

import pytest

from tests import builds

# What differs in more than a width or is not in the slice (tests/test_cosim.py). `make rtl-settings` runs every bench.
AT_SETTINGS = (
    "tb.common.test_axi_list_reader",
    "tb.common.test_axi_block_writer",
    "tb.common.test_axi_record_reader",
    "tb.raster_core.test_group_finder",
    "tb.raster_core.test_row_reach",
    "tb.raster_core.test_subtile_compute_unit",
)


def cases():
    for bench in builds.discover():
        for simulator in bench.simulators:
            marks = [pytest.mark.slow] if bench.slow or simulator == "icarus" else []
            yield pytest.param(bench, simulator, id=f"{bench.bench}-{bench.label}-{simulator}", marks=marks)


@pytest.mark.parametrize(("bench", "simulator"), list(cases()))
def test_bench(bench, simulator):
    if simulator == "icarus" and shutil.which("iverilog") is None:
        pytest.skip("iverilog is not installed (optional four-state run)")
    assert builds.run(bench, simulator) > 0


@pytest.mark.slow
@pytest.mark.parametrize("setting", ["small", "wide"])
@pytest.mark.parametrize("bench", AT_SETTINGS)
def test_bench_at_setting(bench, setting):
    """Its first parameter set, under few stalls."""
    assert builds.run(replace(builds.load(bench)[0], setting=setting, few=True)) > 0


@pytest.mark.slow
def test_a_failing_bench_fails(tmp_path, monkeypatch):
    """The runner itself: a module that loses every second beat must not pass."""
    source = (builds.ROOT / "rtl" / "common" / "gs_skid.v").read_text()
    broken = tmp_path / "gs_skid.v"
    broken.write_text(source.replace("head_valid <= spare_valid || in_valid", "head_valid <= in_valid && !head_valid"))
    assert broken.read_text() != source
    monkeypatch.setattr(builds, "sources", lambda top: [broken])
    monkeypatch.setattr(builds, "BUILD", tmp_path)
    with pytest.raises(AssertionError, match="tests failed"):
        builds.run(builds.Bench("gs_skid", "tb.common.test_skid"))
