"""How each proof is set up: sizes that keep it small, and what a module may expect of its neighbours."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Setting:
    """Sizes, fields without meaning, and the neighbours' part of the contract."""

    parameters: dict[str, int] = field(default_factory=dict)
    # field -> condition under which it carries nothing and may change, e.g. the entry of an end beat
    void: dict[str, str] = field(default_factory=dict)
    # Verilog in the harness: state of the neighbours, and assumptions on what they send
    neighbours: str = ""
    # keep the memories; without, they give any word (a proof that passes so is the stronger one)
    memory: bool = False


SETTINGS = {
    "gs_skid": Setting({"WIDTH": 8}),
    "gs_fifo": Setting({"WIDTH": 8, "DEPTH": 4}),
    "gs_block_buffer": Setting({"WIDTH": 8, "DEPTH": 8}, void={"out_data": "out_len == 0"}),
}
