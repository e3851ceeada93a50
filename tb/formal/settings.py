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
    # cycles from reset that are searched for a broken stream, where no full proof is found; 0 is the full proof
    bound: int = 0


def answers(burst: str, list_in: str, bits: int) -> str:
    """Memory answers only bursts that have ended; fewer than 2^(bits-1) wait for an answer, and as few are sent while
    lists wait for their done."""
    return f"""
    wire burst_go = {burst};
    wire list_go  = {list_in};
    reg [{bits - 1}:0] owed  = 0;
    reg [{bits - 1}:0] since = 0;
    reg [7:0] lists = 0;
    always @(posedge clk) begin
        owed  <= rst ? 0 : owed + burst_go - m_axi_bvalid;
        lists <= rst ? 0 : lists + list_go - (done_valid && done_ready);
        since <= rst || (lists == 0 && !list_go) ? 0 : since + burst_go;
    end
    always @(*) assume (!m_axi_bvalid || owed != 0);
    always @(*) assume (!owed[{bits - 1}] && !since[{bits - 1}]);
"""


def reads(bits: int) -> str:
    """Memory sends only beats that were asked for."""
    return f"""
    reg [{bits - 1}:0] owed = 0;
    wire [{bits - 1}:0] asked = m_axi_arvalid && m_axi_arready ? m_axi_arlen + 1 : 0;
    always @(posedge clk) owed <= rst ? 0 : owed + asked - (m_axi_rvalid && m_axi_rready);
    always @(*) assume (!m_axi_rvalid || owed != 0);
"""


def constant(*ports: str) -> str:
    """Ports that do not change while the module works."""
    names = ", ".join(ports)
    return f"""
    reg [255:0] before;
    always @(posedge clk) before <= {{{names}}};
    always @(*) assume (!started || before == {{{names}}});
"""


def replies(reply: str, *orders: str) -> str:
    """A reply comes only behind one beat of every order."""
    lines = [f"wire reply_go = {reply}_valid && {reply}_ready;"]
    for order in orders:
        lines.append(f"reg [3:0] {order}_open = 0;")
        step = f"{order}_open + ({order}_valid && {order}_ready) - reply_go"
        lines.append(f"always @(posedge clk) {order}_open <= rst ? 0 : {step};")
        lines.append(f"always @(*) assume (!{reply}_valid || {order}_open != 0);")
    return "\n".join(lines)


LISTS = {"a_entry": "a_last", "b_entry": "b_last"}

SETTINGS = {
    "gs_skid": Setting({"WIDTH": 8}),
    "gs_fifo": Setting({"WIDTH": 8, "DEPTH": 4}),
    "gs_block_buffer": Setting({"WIDTH": 8, "DEPTH": 8}, void={"out_data": "out_len == 0"}),
    # mark_used counts what waits; it is no field of the mark
    "gs_hit_queue": Setting({"QUEUE": 16, "CHUNK": 8, "MARKS": 4}, void={"mark_used": "1'b1"}),
    "gs_axi_list_reader": Setting(
        {"N_W": 10, "ADDR_W": 13}, void={"list_entry": "list_last"}, neighbours=reads(10), bound=12
    ),
    "gs_axi_answers": Setting(
        {"N_W": 4, "CNT_W": 4}, neighbours=answers("burst", "fin_valid && fin_ready", 4), memory=True, bound=12
    ),
    "gs_axi_block_writer": Setting(
        {"N_W": 8},
        void={"blk_entry": "blk_len == 0"},
        neighbours=answers("m_axi_wvalid && m_axi_wready && m_axi_wlast", "cmd_valid && cmd_ready", 4),
        memory=True,
        bound=12,
    ),
    "gs_axi_pixel_writer": Setting(
        {"DONES": 2},
        neighbours=answers("m_axi_wvalid && m_axi_wready && m_axi_wlast", "cmd_valid && cmd_ready", 12)
        + constant("cfg_width", "cfg_addr", "cfg_stride"),
        memory=True,
        bound=12,
    ),
    "gs_sort_sequencer": Setting(neighbours=replies("written", "a", "b", "core", "out")),
    "gs_sort_lane": Setting(bound=6),
    "gs_chunk_sorter": Setting({"CHUNK": 16, "SORT_N": 4, "ENTRY_W": 8}, void=LISTS | {"out_entry": "out_last"}),
    "gs_sorting_core": Setting({"CHUNK": 16, "SORT_N": 4, "ENTRY_W": 8}, void=LISTS | {"out_entry": "out_len == 0"}),
    "gs_bitonic_sort_unit": Setting({"SORT_N": 4, "ENTRY_W": 8}),
}

# Too large for a proof of their own; their output streams are those of the parts named here.
LEFT_OUT = {
    "gs_sorting_core": "not decided within 300 s; its parts and its bench hold the same rules",
    "gs_pixel_resolver": "px is the output of a gs_skid",
    "gs_late_buffer": "feat_req and upd are outputs of gs_skid",
    "gs_late_core": "feat_req and upd are those of gs_late_buffer, px is that of gs_pixel_resolver",
    "gs_raster_core": "feat_req and upd are those of gs_batch_buffer, px is that of gs_pixel_resolver",
    "gs_raster_lane": "done joins those of both writers, the other streams are those of the gs_axi units",
    "gs_slice": "its streams are those of the sort lanes and of the raster lane",
}
