// gs_ellipse_setup: u and v of a footprint at the centre of the first pixel of a group of subtiles.
//
//   latency LATENCY = 3, one result per cycle, never stalls
//
//   S1 offset    dx, dy = centre of the pixel - mean             exact
//   S2 multiply  a*dx, b*dy, c*dy                                exact
//   S3 narrow    u = a*dx + b*dy, v = c*dy -> SQ8.STEP_F         half_up, sat

`default_nettype none
`include "gs_params.vh"

module gs_ellipse_setup #(
    parameter MEAN_F = `GS_MEAN_F,
    parameter MEAN_W = `GS_MEAN_W,
    parameter CHOL_F = `GS_CHOL_F,
    parameter CHOL_W = `GS_CHOL_W,
    parameter STEP_F = `GS_STEP_F,
    parameter STEP_W = `GS_STEP_W
) (
    input  wire                     clk,
    input  wire                     rst,

    // in: a footprint and a pixel
    input  wire                     in_valid,
    input  wire [CHOL_W-1:0]        in_a,       // UQ1.CHOL_F
    input  wire [CHOL_W:0]          in_b,       // SQ1.CHOL_F
    input  wire [CHOL_W-1:0]        in_c,       // UQ1.CHOL_F
    input  wire [MEAN_W-1:0]        in_mean_x,  // SQ13.MEAN_F
    input  wire [MEAN_W-1:0]        in_mean_y,  // SQ13.MEAN_F
    input  wire [MEAN_W-MEAN_F-2:0] in_x0,      // pixels
    input  wire [MEAN_W-MEAN_F-2:0] in_y0,      // pixels

    // out: same order
    output wire                     out_valid,
    output wire [STEP_W-1:0]        out_u0,     // SQ8.STEP_F
    output wire [STEP_W-1:0]        out_v0      // SQ8.STEP_F
);

    localparam DROP   = CHOL_F + MEAN_F - STEP_F;  // fraction bits that narrow() rounds away
    localparam PROD_W = CHOL_W + 1 + MEAN_W + 1;
    localparam SUM_W  = PROD_W + 1;
    localparam HIGH_W = SUM_W - DROP - STEP_W + 1;  // bits that are all equal unless it saturates

    // SUM_W bits .(CHOL_F+MEAN_F) to SQ8.STEP_F: half_up, sat
    function [STEP_W-1:0] narrow;
        input [SUM_W-1:0] x;
        reg   [SUM_W-1:0] rounded;
        begin
            rounded = x + {{SUM_W-DROP{1'b0}}, 1'b1, {DROP-1{1'b0}}};
            if (rounded[SUM_W-1 -: HIGH_W] == {HIGH_W{rounded[SUM_W-1]}}) narrow = rounded[DROP +: STEP_W];
            else narrow = {rounded[SUM_W-1], {STEP_W-1{!rounded[SUM_W-1]}}};
        end
    endfunction

    reg s1_valid;
    reg s2_valid;
    reg s3_valid;
    always @(posedge clk) begin
        s1_valid <= in_valid && !rst;
        s2_valid <= s1_valid && !rst;
        s3_valid <= s2_valid && !rst;
    end
    assign out_valid = s3_valid;

    // S1 offset: SQ14.MEAN_F
    wire [MEAN_W:0] in_dx = {2'b00, in_x0, 1'b1, {MEAN_F-1{1'b0}}} - {in_mean_x[MEAN_W-1], in_mean_x};
    wire [MEAN_W:0] in_dy = {2'b00, in_y0, 1'b1, {MEAN_F-1{1'b0}}} - {in_mean_y[MEAN_W-1], in_mean_y};
    reg signed [MEAN_W:0] s1_dx;
    reg signed [MEAN_W:0] s1_dy;
    reg signed [CHOL_W:0] s1_a;
    reg signed [CHOL_W:0] s1_b;
    reg signed [CHOL_W:0] s1_c;
    always @(posedge clk) begin
        s1_dx <= in_dx;
        s1_dy <= in_dy;
        s1_a  <= {1'b0, in_a};
        s1_b  <= in_b;
        s1_c  <= {1'b0, in_c};
    end

    // S2 multiply: .(CHOL_F+MEAN_F)
    reg signed [PROD_W-1:0] s2_adx;
    reg signed [PROD_W-1:0] s2_bdy;
    reg signed [PROD_W-1:0] s2_cdy;
    always @(posedge clk) begin
        s2_adx <= s1_a * s1_dx;
        s2_bdy <= s1_b * s1_dy;
        s2_cdy <= s1_c * s1_dy;
    end

    // S3 narrow
    wire [SUM_W-1:0] s2_u = {s2_adx[PROD_W-1], s2_adx} + {s2_bdy[PROD_W-1], s2_bdy};
    wire [SUM_W-1:0] s2_v = {s2_cdy[PROD_W-1], s2_cdy};
    reg [STEP_W-1:0] s3_u0;
    reg [STEP_W-1:0] s3_v0;
    always @(posedge clk) begin
        s3_u0 <= narrow(s2_u);
        s3_v0 <= narrow(s2_v);
    end
    assign out_u0 = s3_u0;
    assign out_v0 = s3_v0;

endmodule

`default_nettype wire
