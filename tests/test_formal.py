"""Rule 2 (valid and fields hold) is proven for every output stream of every module; a broken module is not."""

import pytest

from tb.formal.settings import LEFT_OUT, SETTINGS, Setting
from tests import builds, formal
from tests.builds import ROOT

pytestmark = pytest.mark.slow
MODULES = [name for name, path in builds.modules().items() if ROOT / "rtl" in path.parents]


@pytest.mark.parametrize("module", [name for name in MODULES if formal.output_streams(name)])
def test_output_streams_hold_their_beats(module):
    if module in LEFT_OUT:
        pytest.skip(f"too large to prove in one piece: {LEFT_OUT[module]}")
    problem = formal.prove(module, SETTINGS.get(module, Setting()), ROOT / "build" / "formal" / module)
    assert not problem, problem


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("head_go = out_ready || !head_valid", "head_go = 1'b1"),
        ("head_valid <= spare_valid || in_valid", "head_valid <= in_valid"),
        ("if (in_ready) spare_data", "spare_data"),
    ],
    ids=["head-moves-too-early", "spare-is-forgotten", "spare-is-overwritten"],
)
def test_only_a_skid_buffer_that_shows_other_beats_fails(right, wrong, request):
    """The second and the third lose data but hold what they show: their bench fails, and their proof holds."""
    folder = ROOT / "build" / "formal" / request.node.callspec.id
    folder.mkdir(parents=True, exist_ok=True)
    source = (ROOT / "rtl" / "common" / "gs_skid.v").read_text()
    assert right in source
    broken = folder / "gs_skid.v"
    broken.write_text(source.replace(right, wrong))
    problem = formal.prove("gs_skid", SETTINGS["gs_skid"], folder, [broken])
    assert bool(problem) is ("head_go" in wrong), problem
