"""Writes the Liberty file that mapping reads from the cell table (cells.py).

python -m synth.liberty OUT.lib
"""

from __future__ import annotations

import sys
from pathlib import Path

from synth.cells import LOADS, SLEWS, Arc, Cell, grid, load

SENSE = {
    "positive": "positive_unate",
    "negative": "negative_unate",
    "both": "non_unate",
    "clock": "non_unate",
    "gated": "positive_unate",
}
GATE_ROLE = {"gated": "clock_gate_clock_pin", "setup": "clock_gate_enable_pin", "tie": "clock_gate_test_pin"}
TABLES = ("cell_rise", "cell_fall", "rise_transition", "fall_transition")
HEAD = """library (splatcore_asap7) {
 delay_model : table_lookup;
 time_unit : "1ps";
 capacitive_load_unit (1, ff);
 voltage_unit : "1V";
 current_unit : "1mA";
 leakage_power_unit : "1pW";
 pulling_resistance_unit : "1kohm";
 nom_process : 1;
 nom_temperature : 25;
 nom_voltage : 0.7;
 default_max_transition : 320;
 lu_table_template (delay) {
  variable_1 : input_net_transition;
  variable_2 : total_output_net_capacitance;
  index_1 ("INDEX_1");
  index_2 ("INDEX_2");
 }
"""


def index(values) -> str:
    return ", ".join(f"{v:g}" for v in values)


def timing(arc: Arc) -> list[str]:
    """The timing group of an arc."""
    lines = ["   timing () {", f'    related_pin : "{arc.pin}";', f"    timing_sense : {SENSE[arc.kind]};"]
    lines.append(f"    timing_type : {'rising_edge' if arc.kind == 'clock' else 'combinational'};")
    for name, coefficients in zip(TABLES, arc.coefficients):
        rows = ", \\\n".join('      "' + ", ".join(f"{v:.4f}" for v in row) + '"' for row in grid(coefficients))
        lines += [f"    {name} (delay) {{", "     values ( \\", rows + " \\", "     );", "    }"]
    return [*lines, "   }"]


def group(cell: Cell) -> list[str]:
    """The cell group. A flip-flop's output is what its data were: q or, inverted, q_n."""
    lines = [f" cell ({cell.name}) {{", f"  area : {cell.area:g};", f"  cell_leakage_power : {cell.leakage:g};"]
    if cell.sequential:
        lines += ["  ff (q, q_n) {", '   clocked_on : "CLK";', '   next_state : "D";', "  }"]
    if cell.clock_gate:
        lines.append("  clock_gating_integrated_cell : latch_posedge;")
    for pin, function in cell.functions.items():
        shown = {"D": "q", "!D": "q_n"}[function.replace("(", "").replace(")", "")] if cell.sequential else function
        role = ["   clock_gate_out_pin : true;", "   state_function"] if cell.clock_gate else ["   function"]
        lines += [f"  pin ({pin}) {{", "   direction : output;", *role[:-1], f'{role[-1]} : "{shown}";']
        if cell.max_load[pin]:
            lines.append(f"   max_capacitance : {cell.max_load[pin]:g};")
        for arc in cell.arcs:
            if arc.output == pin:
                lines += timing(arc)
        lines.append("  }")
    for pin, cap in cell.caps.items():
        kinds = [arc.kind for arc in cell.arcs if arc.pin == pin]
        role = ["   clock : true;"] if "clock" in kinds else []
        if cell.clock_gate:
            role = [f"   {GATE_ROLE[kind]} : true;" for kind in kinds]
        lines += [f"  pin ({pin}) {{", "   direction : input;", *role, f"   capacitance : {cap:g};", "  }"]
    return [*lines, " }"]


def write(cells: dict[str, Cell], path: Path) -> None:
    """Write the library; setup times stay with our own timing (timing.py), mapping has no use for them."""
    head = HEAD.replace("INDEX_1", index(SLEWS)).replace("INDEX_2", index(LOADS))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(head + "\n".join(line for cell in cells.values() for line in group(cell)) + "\n}\n")


if __name__ == "__main__":
    write(load(), Path(sys.argv[1]))
