// gs_merge_sort_unit: merges four sorted lists and drops the invalid entries (MSU+).
//
//   takes one beat a cycle, registered output, latency 1: lists of n entries in all take n + 1 cycles
//   every ready sees all heads and out_ready combinationally
//
//   All heads must be present. The smallest entry is taken, of equal ones that of the first list. Without cfg_keep an
//   entry that is to be dropped is taken at once, whatever the other heads are; only a and b, which are parts of one
//   list, are put in order among themselves first. Four end beats become one.

`default_nettype none
`include "gs_params.vh"

module gs_merge_sort_unit #(
    parameter ENTRY_W = `GS_ENTRY_W
) (
    input  wire               clk,
    input  wire               rst,

    // 1: keep invalid entries (the unit sorts), 0: drop them (it deletes); constant while a list passes
    input  wire               cfg_keep,

    // a, b, c, d: list streams; entry {invalid, key, index}
    input  wire               a_valid,
    output wire               a_ready,
    input  wire [ENTRY_W-1:0] a_entry,
    input  wire               a_last,
    input  wire               b_valid,
    output wire               b_ready,
    input  wire [ENTRY_W-1:0] b_entry,
    input  wire               b_last,
    input  wire               c_valid,
    output wire               c_ready,
    input  wire [ENTRY_W-1:0] c_entry,
    input  wire               c_last,
    input  wire               d_valid,
    output wire               d_ready,
    input  wire [ENTRY_W-1:0] d_entry,
    input  wire               d_last,

    // out: list stream
    output wire               out_valid,
    input  wire               out_ready,
    output wire [ENTRY_W-1:0] out_entry,
    output wire               out_last
);

    // As numbers, invalid entries come last, or, with the bit inverted, first.
    wire [ENTRY_W-1:0] first = {!cfg_keep, {ENTRY_W - 1{1'b0}}};
    wire [ENTRY_W-1:0] a_rank = a_entry ^ first;
    wire [ENTRY_W-1:0] b_rank = b_entry ^ first;
    wire [ENTRY_W-1:0] c_rank = c_entry ^ first;
    wire [ENTRY_W-1:0] d_rank = d_entry ^ first;

    // The better one of a, b and that of c, d; all pairs are compared at once.
    wire ab_end = a_last && b_last;
    wire cd_end = c_last && d_last;
    wire ends   = ab_end && cd_end;
    wire pick_a = !a_last && (b_last || a_entry <= b_entry);
    wire pick_c = !c_last && (d_last || c_rank <= d_rank);
    wire ab_first = pick_a ? (pick_c ? a_rank <= c_rank : a_rank <= d_rank)
                           : (pick_c ? b_rank <= c_rank : b_rank <= d_rank);
    wire pick_ab = !ab_end && (cd_end || ab_first);
    wire take_a = pick_ab && pick_a;
    wire take_b = pick_ab && !pick_a;
    wire take_c = !pick_ab && pick_c;
    wire take_d = !pick_ab && !pick_c;
    wire [ENTRY_W-1:0] taken = ({ENTRY_W{take_a}} & a_entry) | ({ENTRY_W{take_b}} & b_entry) |
                               ({ENTRY_W{take_c}} & c_entry) | ({ENTRY_W{take_d}} & d_entry);

    reg                s1_valid;
    reg  [ENTRY_W-1:0] s1_entry;
    reg                s1_last;
    wire               go = a_valid && b_valid && c_valid && d_valid && (out_ready || !s1_valid);

    assign a_ready   = go && (take_a || ends);
    assign b_ready   = go && (take_b || ends);
    assign c_ready   = go && (take_c || ends);
    assign d_ready   = go && take_d;
    assign out_valid = s1_valid;
    assign out_entry = s1_entry;
    assign out_last  = s1_last;

    always @(posedge clk) begin
        if (go) s1_valid <= ends || cfg_keep || !taken[ENTRY_W-1];
        else if (out_ready) s1_valid <= 1'b0;
        if (go) s1_entry <= taken;
        if (go) s1_last <= ends;
        if (rst) s1_valid <= 1'b0;
    end

endmodule

`default_nettype wire
