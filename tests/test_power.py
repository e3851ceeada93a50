"""`make power`: gates simulated by our own simulator, their energy, recordings, and the results that are kept."""

from pathlib import Path

import numpy as np
import pytest

from synth import activity, circuit, energy, gatesim, power
from synth.cells import Arc, Cell
from synth.flow import Library
from synth.memories import Memory
from synth.netlist import Netlist

NONE = np.zeros((4, 5))


@pytest.fixture(scope="module")
def toy() -> Library:
    flop = Cell("DFF", 2.0, 100.0, {"Q": "D"}, {"Q": 9.0}, {"Q": 0.5}, {"CLK": 1.0, "D": 1.0})
    flop.pin_energy = {"CLK": 0.25, "D": 0.1}
    flop.arcs += [Arc("Q", "CLK", "clock", NONE), Arc("", "D", "setup", NONE)]
    inverter = Cell("INV", 1.0, 50.0, {"Y": "!A"}, {"Y": 9.0}, {"Y": 0.2}, {"A": 2.0})
    inverter.arcs.append(Arc("Y", "A", "negative", NONE))
    gate = Cell("ICG", 1.0, 0.0, {"G": "(CK * E)"}, {"G": 9.0}, {"G": 0.3}, {"CK": 2.0, "E": 1.0})
    gate.pin_energy = {"CK": 0.2, "E": 0.15}
    gate.arcs += [Arc("G", "CK", "gated", NONE), Arc("", "E", "setup", NONE)]
    return Library(Path("toy.lib"), {"DFF": flop, "INV": inverter, "ICG": gate}, "toy")


def column(*bits: int) -> np.ndarray:
    return np.array(bits, np.uint8)[:, None]


def simulate(design: Netlist, library: Library, given: np.ndarray, expected: np.ndarray) -> gatesim.Activity:
    return gatesim.run(circuit.build(design, library, 0.0), design.inputs, given, design.outputs, expected)


CLK, D, Q1, Y, Q2 = range(2, 7)


def chain() -> Netlist:
    """d -> flip-flop -> inverter -> flip-flop -> q."""
    gates = {"DFF": np.array([[CLK, D, Q1], [CLK, Y, Q2]]), "INV": np.array([[Q1, Y]])}
    ports = {"clk": np.array([CLK]), "d": np.array([D]), "q": np.array([Q2])}
    return Netlist(nets=7, gates=gates, inputs=np.array([D]), outputs=np.array([Q2]), ports=ports)


def test_truth_tables_are_read_from_the_cells_functions():
    assert circuit.truth("(A * !B) + (!A * B)", ["A", "B"]) == 0b0110
    assert circuit.truth("(!A) + (!B)", ["A", "B"]) == 0b0111
    assert (circuit.truth("1", []), circuit.truth("0", [])) == (1, 0)


def test_energy_of_each_cycle_is_that_of_its_toggles(toy):
    """A toggle costs its driver's energy, 1/2 V^2 of the pins (0.245 fJ a fF), and what the pins' cells add."""
    d, q1, y, q2 = 0.245 + 0.1, 0.5 + 2 * 0.245, 0.2 + 0.245 + 0.1, 0.5 + 0.245
    found = simulate(chain(), toy, column(0, 1, 1, 0), column(0, 1, 1, 0))
    np.testing.assert_allclose(found.energy[:, gatesim.LOGIC], [0, d + q2, q1 + y, d + q2])
    np.testing.assert_allclose(found.energy[:, gatesim.CLOCK], 2 * (2 * 0.245) + 2 * 2 * 0.25)
    np.testing.assert_allclose(found.energy[:, gatesim.GLITCH], 0, atol=1e-12)
    assert not found.differ.any()
    assert circuit.build(chain(), toy, 0.0).leakage == pytest.approx((2 * 100 + 50) * 1e-9)


def test_an_output_unlike_the_rtls_is_seen_in_its_cycle(toy):
    found = simulate(chain(), toy, column(0, 1, 1, 0), column(0, 1, 0, 0))
    assert found.differ.tolist() == [False, False, True, False]


def test_wire_adds_to_every_pin_of_a_net(toy):
    bare, wired = (circuit.build(chain(), toy, wire).toggle for wire in (0.0, 2.5))
    np.testing.assert_allclose((wired - bare)[[D, Q1, Q2]], 2.5 * 0.173 * 0.245)
    assert wired[CLK] - bare[CLK] == pytest.approx(2 * 2.5 * 0.173 * 0.245)


@pytest.mark.parametrize("late", [5, 40])
def test_a_pulse_passes_a_gate_that_is_faster_than_it(toy, late):
    """d and !d meet in an AND 20 ps slow: a pulse as long as the inverter is slow passes or does not."""
    d, n, p = range(3, 6)
    slow = Cell("SLOW", 1.0, 0.0, {"Y": "!A"}, {"Y": 9.0}, {"Y": 0.2}, {"A": 2.0})
    both = Cell("AND", 1.0, 0.0, {"Y": "A * B"}, {"Y": 9.0}, {"Y": 0.4}, {"A": 1.0, "B": 1.0})
    for cell, delay in ((slow, late), (both, 20)):
        ahead = np.array([[delay, 0, 0, 0, 0]] * 4, float)
        cell.arcs += [Arc("Y", pin, "negative", ahead) for pin in cell.caps]
    library = Library(Path("toy.lib"), {**toy.cells, "SLOW": slow, "AND": both}, "toy")
    gates = {"SLOW": np.array([[d, n]]), "AND": np.array([[d, n, p]])}
    design = Netlist(nets=6, gates=gates, inputs=np.array([d]), outputs=np.array([p]), ports={"clk": np.array([2])})
    found = simulate(design, library, column(0, 1, 0), column(0, 0, 0))
    pulse = 2 * (0.4 + 0.245)
    np.testing.assert_allclose(found.energy[:, gatesim.GLITCH], [0, pulse if late > 20 else 0, 0], atol=1e-12)
    assert not found.differ.any()


def test_a_gated_register_holds_and_its_clock_costs_only_what_is_enabled(toy):
    clk, e, d, g, q = range(2, 7)
    gates = {"DFF": np.array([[g, d, q]]), "ICG": np.array([[clk, e, g]])}
    ports = {"clk": np.array([clk])}
    design = Netlist(nets=7, gates=gates, inputs=np.array([e, d]), outputs=np.array([q]), ports=ports)
    found = simulate(design, toy, np.array([[1, 1], [0, 0], [1, 0], [1, 0]], np.uint8), column(0, 1, 1, 0))
    assert not found.differ.any()
    always = 2 * (0.245 * 2.0 + 0.2)
    enabled = 2 * (0.3 + 0.245 + 0.25)
    expected = [always + enabled, always, always + enabled, always + enabled]
    np.testing.assert_allclose(found.energy[:, gatesim.CLOCK], expected)


def test_a_loop_of_gates_is_refused(toy):
    design = chain()
    design.gates["INV"] = np.array([[Q1, Y], [D, 7], [7, D]])
    design.nets = 8
    with pytest.raises(RuntimeError, match="loop"):
        circuit.build(design, toy, 0.0)


def test_a_memory_gives_the_old_word_and_holds_it(toy):
    """Ports of a 4 x 2 memory: wr_en 3, wr_addr 4:5, wr_data 6:7, rd_en 8, rd_addr 9:10, rd_data 11:12."""
    nets = [np.array(n) for n in ([3], [4, 5], [6, 7], [8], [9, 10], [11, 12])]
    ram = dict(zip(circuit.RAM_PORTS, nets, strict=True))
    design = Netlist(nets=13, inputs=np.arange(3, 11), outputs=nets[-1], ports={"clk": np.array([2])})
    design.rams = [(Memory(2, 4), ram)]
    design.memory_in, design.memory_out = np.arange(3, 11), nets[-1]
    given = np.array(
        [[1, 0, 1, 1, 0, 0, 0, 0],   # 1 -> word 2
         [1, 0, 1, 0, 1, 1, 0, 1],   # 2 -> word 2, read it: still 1
         [0, 0, 0, 0, 0, 1, 0, 1],   # read it again
         [0, 0, 0, 0, 0, 0, 0, 0],
         [0, 0, 0, 0, 0, 0, 0, 0]], np.uint8,
    )  # fmt: skip
    found = simulate(design, toy, given, np.array([[0, 0], [0, 0], [1, 0], [0, 1], [0, 1]], np.uint8))
    assert not found.differ.any()
    assert found.accesses.tolist() == [[2, 2]]


# Recordings

MODULE = """module unit_of_test #(
    parameter W = 5
) (
    input  wire         clk,
    input  wire         in_valid,
    input  wire [W-1:0] in_word,  // five bits
    output reg          out_valid
);
endmodule
"""


def test_a_recording_reads_back_as_the_ports(tmp_path, monkeypatch):
    source = tmp_path / "unit_of_test.v"
    source.write_text(MODULE)
    monkeypatch.setattr(activity, "FOLDER", tmp_path)
    (tmp_path / "record").mkdir()
    lines = [1 | 19 << 1 | 0 << 6, 0 | 7 << 1 | 1 << 6]
    for name in ("slice.a", "slice.b", "slice.c"):
        text = "".join(f"{line if name == 'slice.b' else 0:02x}\n" for line in lines)
        (tmp_path / "record" / f"unit_of_test~{name}.hex").write_text(text + "1")  # the last line is cut off
    found = activity.stimulus("unit_of_test", {"in_valid": 1, "in_word": 5, "out_valid": 1}, source)
    assert found.instance == "slice.b"
    assert found.side("input").tolist() == [[1, 1, 1, 0, 0, 1], [0, 1, 1, 1, 0, 0]]
    assert found.side("output").tolist() == [[0], [1]]


def test_a_copy_that_records_is_the_module_and_its_recorder(tmp_path):
    (copy,) = (p for p in activity.sources(["gs_merge_sort_unit"], tmp_path) if p.is_relative_to(tmp_path))
    text = copy.read_text()
    assert text.count("$fwrite(record_file") == 1 and "out_last, out_entry, out_ready" in text
    assert text.index("$fwrite") < text.index("endmodule")


def test_stretches_are_sums_over_each_stretch():
    assert power.stretches(np.array([1.0, 2, 3, 4]), 2).tolist() == [3, 5, 7]


def test_busy_and_idle_are_the_hottest_and_the_coolest_stretch():
    spent = np.full((4000, 3), [1000.0, 0.0, 0.0])
    spent[1000:2500, gatesim.LOGIC] = 3000.0
    spent[3000:3064, gatesim.CLOCK] = 200.0
    found = power.figures(spent, 0.5)
    assert (found["busy_mw"], found["clock_mw"], found["idle_mw"]) == (4.5, 1.0, 0.7)


# Frames


def test_energy_of_a_frame_adds_idle_busy_and_memory():
    unit = {"0": {"idle_mw": 1.0, "busy_mw": 3.0}, "memory_mw": 0.0}
    run = {
        "per_frame": [
            {"cycles": 5, "dram_bytes": {}},
            {"cycles": 1_000_000, "dram_bytes": {"sorting": {"read": 1000, "write": 250}}},
        ],
        "utilisation": {part.busy: 0.5 for part in energy.PARTS} | {"preprocessing units": 0.0},
    }
    found = energy.frame(run, {part.module: unit for part in energy.PARTS}, (1000, 1000))
    assert found["mj"]["SCUs"] == pytest.approx(16 * 2.0 * 1e-3)
    assert found["mj"]["DRAM"] == pytest.approx(1250 * 8 * 8e-9)
    assert found["total_mj"] == pytest.approx((16 + 4 + 16) * 2e-3 + 8e-5)
    assert found["mpx_per_j"] == pytest.approx(1 / (found["total_mj"] * 1e-3), rel=1e-3)


# What is kept


def test_the_page_shows_the_results_that_are_kept():
    assert power.text() in power.PAGE.read_text(), "run `python -m synth.power --page`"


@pytest.mark.slow  # an honest failure between a change of RTL and the next `make power`
@pytest.mark.parametrize("module", power.LIST)
def test_results_are_those_of_this_rtl(module):
    kept = power.load().get(module) or pytest.skip(f"no result yet: make power UNIT={module}")
    assert kept["made_from"] == power.digest(module), f"run `make power UNIT={module}`"
