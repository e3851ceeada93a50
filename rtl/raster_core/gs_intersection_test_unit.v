// gs_intersection_test_unit: is a subtile among the columns that an ellipse spans?
//
//   latency UNIT_LATENCY = 1, one ellipse per cycle, never stalls; no valid bit
//
//   S1 compare  low <= column <= high

`default_nettype none
`include "gs_params.vh"

module gs_intersection_test_unit #(
    parameter EDGE_F = `GS_EDGE_F
) (
    input  wire              clk,

    // in: columns in steps of u, from the group's first pixel
    input  wire [EDGE_F+5:0] in_column,  // UQ6.EDGE_F: of the subtile's first pixel
    input  wire [EDGE_F+8:0] in_low,     // SQ8.EDGE_F
    input  wire [EDGE_F+8:0] in_high,    // SQ8.EDGE_F
    input  wire              in_live,    // 0: never hit

    // out: same order
    output wire              out_hit
);

    wire signed [EDGE_F+8:0] in_at   = {3'b000, in_column};
    wire signed [EDGE_F+8:0] in_from = in_low;
    wire signed [EDGE_F+8:0] in_to   = in_high;
    reg s1_hit;
    always @(posedge clk) s1_hit <= in_live && in_from <= in_at && in_at <= in_to;
    assign out_hit = s1_hit;

endmodule

`default_nettype wire
