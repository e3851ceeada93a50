"""The mutation flow on one tiny unit: mutants, their netlist, their ends, and the proof of what changes nothing."""

import pytest

from tests.mutation import equivalent, netlist, unit

pytestmark = pytest.mark.slow


@pytest.fixture
def skid(monkeypatch, request):
    """gs_skid with a folder for each test, below the repository (Yosys sees no other)."""
    one = netlist.units()["gs_skid"]
    monkeypatch.setattr(netlist, "RESULTS", netlist.RESULTS / request.node.name)
    return one


def test_mutants_of_a_skid_buffer_are_killed_and_the_others_equivalent(skid):
    found = unit.run(skid, 5)
    assert [one["status"] for one in found["mutants"]] == ["killed"] * 5, found
    assert sum(found["kills"].values()) == 5


def test_only_a_mutant_that_changes_nothing_is_equivalent(skid):
    """A second spare beat is kept out by in_ready already; without reset, or with a head that moves, it differs."""
    skid.folder.mkdir(parents=True, exist_ok=True)
    mutants = netlist.draw(skid, 1000)
    text = skid.source.read_text().splitlines()
    by_name = {(text[one.line - 1].strip(), one.mode, one.wire): one for one in mutants}
    same = by_name["else if (in_valid && in_ready) spare_valid <= 1'b1;", "const1", "in_ready[0]"]
    other = by_name["wire            head_go = out_ready || !head_valid;", "const1", "head_go[0]"]
    assert equivalent.prove(skid, same) == "any state"
    assert equivalent.prove(skid, other) == ""


def test_a_mutant_at_an_input_that_the_part_ignores_is_equivalent(monkeypatch, request):
    monkeypatch.setattr(netlist, "RESULTS", netlist.RESULTS / request.node.name)
    lane = netlist.units()["gs_sort_lane"]
    lane.folder.mkdir(parents=True, exist_ok=True)
    mutants = {one.wire: one for one in netlist.draw(lane, 5000) if (one.mode, one.cell) == ("inv", "reader_a")}
    for wire, same in (("m_axi_a_rlast[0]", True), ("m_axi_a_rresp[1]", False)):
        part = equivalent.changed_part(lane, mutants[wire])
        assert part[0].stem == "gs_axi_list_reader"
        ports, _ = equivalent.open_pair(lane, mutants[wire], lane.folder, part)
        (lane.folder / "product.v").write_text(equivalent.product(ports, {}, states=False))
        assert equivalent.decide(lane.folder) is same, wire


def test_the_list_of_mutants_is_the_same_each_time(skid):
    skid.folder.mkdir(parents=True, exist_ok=True)
    assert netlist.draw(skid, 20) == netlist.draw(skid, 20)
