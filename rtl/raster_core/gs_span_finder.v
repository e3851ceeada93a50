// gs_span_finder: how far an ellipse reaches to the right and to the left over the eight rows of a group.
//
//   latency LATENCY = 2, one ellipse per cycle, never stalls; no valid bit
//
//   S0 steps   odd multiples of b, one cycle ahead of the reaches    exact
//   S1 rows    reach - j*b, reach + j*b; larger of two rows          exact
//   S2 span    largest of all rows                                   exact

`default_nettype none
`include "gs_params.vh"

module gs_span_finder #(
    parameter SUBTILE = `GS_SUBTILE,
    parameter ITU_F   = `GS_ITU_F,
    parameter EDGE_F  = `GS_EDGE_F
) (
    input  wire                         clk,

    // in: one cycle ahead of the reaches
    input  wire [EDGE_F+1:0]            in_b,       // SQ1.EDGE_F

    // rows: row j at bit j and at (ITU_F+2)*j
    input  wire [SUBTILE-1:0]           row_empty,
    input  wire [SUBTILE*(ITU_F+2)-1:0] row_reach,  // UQ2.ITU_F

    // out: below -12 when every row is empty
    output wire [EDGE_F+6:0]            out_right,  // SQ6.EDGE_F: largest reach - j*b
    output wire [EDGE_F+6:0]            out_left    // SQ6.EDGE_F: largest reach + j*b
);

    localparam W     = EDGE_F + 7;  // SQ6.EDGE_F
    localparam ITU_W = ITU_F + 2;

    generate
        if (SUBTILE != 8) begin : g_rule
            SUBTILE_must_be_8 bad ();
        end
    endgenerate

    function [W-1:0] larger;
        input signed [W-1:0] x;
        input signed [W-1:0] y;
        larger = x > y ? x : y;
    endfunction

    // S0 steps
    wire [W-1:0] in_b1 = {{W-EDGE_F-2{in_b[EDGE_F+1]}}, in_b};
    reg [W-1:0] s0_b1;
    reg [W-1:0] s0_b3;
    reg [W-1:0] s0_b5;
    reg [W-1:0] s0_b7;
    always @(posedge clk) begin
        s0_b1 <= in_b1;
        s0_b3 <= (in_b1 << 1) + in_b1;
        s0_b5 <= (in_b1 << 2) + in_b1;
        s0_b7 <= (in_b1 << 3) - in_b1;
    end
    wire [8*W-1:0] s0_jb = {s0_b7, s0_b3 << 1, s0_b5, s0_b1 << 2, s0_b3, s0_b1 << 1, s0_b1, {W{1'b0}}};

    // S1 rows. A reach counts as its upper end; that of an empty row is -32 and something.
    wire [8*W-1:0] s1_right;
    wire [8*W-1:0] s1_left;
    genvar j;
    generate
        for (j = 0; j < 8; j = j + 1) begin : g_row
            wire [W-1:0] reach = {{2{row_empty[j]}}, 3'b000, row_reach[j*ITU_W +: ITU_W], {EDGE_F-ITU_F{1'b1}}};
            assign s1_right[j*W +: W] = reach - s0_jb[j*W +: W];
            assign s1_left[j*W +: W]  = reach + s0_jb[j*W +: W];
        end
    endgenerate
    reg [4*W-1:0] s1_right2;
    reg [4*W-1:0] s1_left2;
    generate
        for (j = 0; j < 4; j = j + 1) begin : g_two
            always @(posedge clk) begin
                s1_right2[j*W +: W] <= larger(s1_right[2*j*W +: W], s1_right[(2*j+1)*W +: W]);
                s1_left2[j*W +: W]  <= larger(s1_left[2*j*W +: W], s1_left[(2*j+1)*W +: W]);
            end
        end
    endgenerate

    // S2 span
    reg [W-1:0] s2_right;
    reg [W-1:0] s2_left;
    always @(posedge clk) begin
        s2_right <= larger(larger(s1_right2[0 +: W], s1_right2[W +: W]),
                           larger(s1_right2[2*W +: W], s1_right2[3*W +: W]));
        s2_left  <= larger(larger(s1_left2[0 +: W], s1_left2[W +: W]), larger(s1_left2[2*W +: W], s1_left2[3*W +: W]));
    end
    assign out_right = s2_right;
    assign out_left  = s2_left;

endmodule

`default_nettype wire
