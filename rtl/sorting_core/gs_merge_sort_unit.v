// gs_merge_sort_unit: merges two sorted lists and drops the invalid entries (MSU+).
//
//   takes one beat a cycle, registered output, latency 1: lists of nA and nB entries take nA + nB + 1 cycles
//   a_ready and b_ready see both heads and out_ready combinationally
//
//   Both heads must be present. An entry that is to be dropped is taken at once, whatever the other head is, so the
//   result is the merge of what is left of both lists. Equal entries: a first. Two end beats become one.

`default_nettype none
`include "gs_params.vh"

module gs_merge_sort_unit #(
    parameter ENTRY_W = `GS_ENTRY_W
) (
    input  wire               clk,
    input  wire               rst,

    // 1: keep invalid entries (the unit sorts), 0: drop them (it deletes); constant while a list passes
    input  wire               cfg_keep,

    // a, b: list streams; entry {invalid, key, index}
    input  wire               a_valid,
    output wire               a_ready,
    input  wire [ENTRY_W-1:0] a_entry,
    input  wire               a_last,
    input  wire               b_valid,
    output wire               b_ready,
    input  wire [ENTRY_W-1:0] b_entry,
    input  wire               b_last,

    // out: list stream
    output wire               out_valid,
    input  wire               out_ready,
    output wire [ENTRY_W-1:0] out_entry,
    output wire               out_last
);

    wire a_drop = !cfg_keep && a_entry[ENTRY_W-1];
    wire b_drop = !cfg_keep && b_entry[ENTRY_W-1];
    wire take_a = !a_last && (b_last || a_drop || (!b_drop && a_entry <= b_entry));
    wire ends   = a_last && b_last;
    wire dropped = !ends && (take_a ? a_drop : b_drop);

    reg                s1_valid;
    reg  [ENTRY_W-1:0] s1_entry;
    reg                s1_last;
    wire               go = a_valid && b_valid && (out_ready || !s1_valid);

    assign a_ready   = go && (take_a || ends);
    assign b_ready   = go && !take_a;
    assign out_valid = s1_valid;
    assign out_entry = s1_entry;
    assign out_last  = s1_last;

    always @(posedge clk) begin
        if (go) s1_valid <= !dropped;
        else if (out_ready) s1_valid <= 1'b0;
        if (go) s1_entry <= take_a ? a_entry : b_entry;
        if (go) s1_last <= ends;
        if (rst) s1_valid <= 1'b0;
    end

endmodule

`default_nettype wire
