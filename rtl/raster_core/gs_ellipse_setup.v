// gs_ellipse_setup: u and v of a footprint at the centre of the first pixel of a group of subtiles, for the intersection test.
//
//   latency of u LATENCY = 3, of v one cycle less; one result per cycle, never stalls
//
//   S1 offset    dx, dy = centre of the pixel - mean             exact
//   S2 multiply  high and low parts of a*dx, b*dy, c*dy, without the products of low bits    floor to .(EDGE_F+3)
//   S3 narrow    u = a*dx + b*dy                                 floor to SQ7.EDGE_F; `far` where u or v does not fit

`default_nettype none
`include "gs_params.vh"

module gs_ellipse_setup #(
    parameter MEAN_F = `GS_MEAN_F,
    parameter MEAN_W = `GS_MEAN_W,
    parameter CHOL_F = `GS_CHOL_F,
    parameter CHOL_W = `GS_CHOL_W,
    parameter EDGE_F = `GS_EDGE_F
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

    // out: same order; parts of v belong to the result of the next cycle
    output wire                     out_valid,
    output wire [EDGE_F+7:0]        out_u0,      // SQ7.EDGE_F
    output wire                     out_far,     // nothing of the group is hit; u0 and v mean nothing
    output wire [EDGE_F+8:0]        out_v_high,  // SQ5.(EDGE_F+3)
    output wire [EDGE_F+5:0]        out_v_low    // SQ2.(EDGE_F+3)
);

    localparam GUARD  = 3;                                  // bits of a product below EDGE_F
    localparam LOW    = CHOL_F + MEAN_F - EDGE_F - GUARD;   // bits of a product that are dropped
    localparam LOW_C  = LOW / 2 < CHOL_F - 12 ? LOW / 2 : CHOL_F - 12;  // of the footprint, and
    localparam LOW_D  = LOW - LOW_C;                        // of the offset: their product is left out
    localparam PROD_W = CHOL_W + 1 + MEAN_W + 1;
    localparam PART_W = PROD_W - LOW;
    localparam SUM_W  = PART_W + 1;
    localparam LOW_W  = EDGE_F + GUARD + 3;                 // SQ2.PART_F: a low part is below 2^-12 * 2^14
    localparam V_W    = EDGE_F + GUARD + 6;                 // SQ5.PART_F
    localparam [PROD_W-1:0] BIAS_U = {PROD_W{1'b1}} << LOW_D;                   // -1: the SCU's u may be rounded down
    localparam [PROD_W-1:0] BIAS_V = {{PROD_W-1{1'b0}}, 1'b1} << (LOW_D + 2);   // 4: floors lie on both sides of |v|

    generate
        if (LOW < 2 || LOW_C < 1) begin : g_rule
            CHOL_F_must_be_13_and_with_MEAN_F_hold_EDGE_F_and_5_bits bad ();
        end
    endgenerate

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
    reg [MEAN_W:0] s1_dx;
    reg [MEAN_W:0] s1_dy;
    reg [CHOL_W:0] s1_a;
    reg [CHOL_W:0] s1_b;
    reg [CHOL_W:0] s1_c;
    always @(posedge clk) begin
        s1_dx <= {2'b00, in_x0, 1'b1, {MEAN_F-1{1'b0}}} - {in_mean_x[MEAN_W-1], in_mean_x};
        s1_dy <= {2'b00, in_y0, 1'b1, {MEAN_F-1{1'b0}}} - {in_mean_y[MEAN_W-1], in_mean_y};
        s1_a  <= {1'b0, in_a};
        s1_b  <= in_b;
        s1_c  <= {1'b0, in_c};
    end

    // S2 multiply: high and low part of the footprint, the latter with the high part of the offset only
    wire signed [PROD_W-1:0]   s1_dx_all  = {{PROD_W-MEAN_W-1{s1_dx[MEAN_W]}}, s1_dx};
    wire signed [PROD_W-1:0]   s1_dy_all  = {{PROD_W-MEAN_W-1{s1_dy[MEAN_W]}}, s1_dy};
    wire signed [PROD_W-1:0]   s1_dx_high = s1_dx_all >>> LOW_D;
    wire signed [PROD_W-1:0]   s1_dy_high = s1_dy_all >>> LOW_D;
    wire signed [CHOL_W:LOW_C] s1_a_high  = s1_a[CHOL_W:LOW_C];
    wire signed [CHOL_W:LOW_C] s1_b_high  = s1_b[CHOL_W:LOW_C];
    wire signed [CHOL_W:LOW_C] s1_c_high  = s1_c[CHOL_W:LOW_C];
    wire signed [LOW_C:0]      s1_a_low   = {1'b0, s1_a[LOW_C-1:0]};
    wire signed [LOW_C:0]      s1_b_low   = {1'b0, s1_b[LOW_C-1:0]};
    wire signed [LOW_C:0]      s1_c_low   = {1'b0, s1_c[LOW_C-1:0]};
    wire signed [PROD_W-1:0]   bias_u     = BIAS_U;
    wire signed [PROD_W-1:0]   bias_v     = BIAS_V;
    wire signed [PROD_W-1:0]   s1_adx = s1_a_high * s1_dx_all + bias_u;
    wire signed [PROD_W-1:0]   s1_bdy = s1_b_high * s1_dy_all;
    wire signed [PROD_W-1:0]   s1_cdy = s1_c_high * s1_dy_all + bias_v;
    wire signed [PROD_W-1:0]   s1_adx_rest = s1_a_low * s1_dx_high;
    wire signed [PROD_W-1:0]   s1_bdy_rest = s1_b_low * s1_dy_high;
    wire signed [PROD_W-1:0]   s1_cdy_rest = s1_c_low * s1_dy_high;
    reg signed [SUM_W-1:0]  s2_adx;       // .PART_F = .(EDGE_F+GUARD)
    reg signed [SUM_W-1:0]  s2_bdy;
    reg        [PART_W-1:0] s2_cdy;
    reg        [LOW_W-1:0]  s2_adx_rest;  // SQ2.PART_F
    reg        [LOW_W-1:0]  s2_bdy_rest;
    reg        [LOW_W-1:0]  s2_cdy_rest;
    always @(posedge clk) begin
        s2_adx      <= {s1_adx[LOW_D+PART_W-1], s1_adx[LOW_D +: PART_W]};
        s2_bdy      <= {s1_bdy[LOW_D+PART_W-1], s1_bdy[LOW_D +: PART_W]};
        s2_cdy      <= s1_cdy[LOW_D +: PART_W];
        s2_adx_rest <= s1_adx_rest[LOW_C +: LOW_W];
        s2_bdy_rest <= s1_bdy_rest[LOW_C +: LOW_W];
        s2_cdy_rest <= s1_cdy_rest[LOW_C +: LOW_W];
    end
    assign out_v_high = s2_cdy[V_W-1:0];
    assign out_v_low  = s2_cdy_rest;
    wire [PART_W-1:V_W-1] s2_v_top = s2_cdy[PART_W-1:V_W-1];

    // S3 narrow
    wire signed [SUM_W-1:0] s2_adx_low = {{SUM_W-LOW_W{s2_adx_rest[LOW_W-1]}}, s2_adx_rest};
    wire signed [SUM_W-1:0] s2_bdy_low = {{SUM_W-LOW_W{s2_bdy_rest[LOW_W-1]}}, s2_bdy_rest};
    wire signed [SUM_W-1:0] s2_u = s2_adx + s2_bdy + s2_adx_low + s2_bdy_low;
    wire [SUM_W-1:GUARD+EDGE_F+7] s2_u_top = s2_u[SUM_W-1:GUARD+EDGE_F+7];
    reg [EDGE_F+7:0] s3_u0;
    reg              s3_far;
    always @(posedge clk) begin
        s3_u0  <= s2_u[GUARD +: EDGE_F+8];
        s3_far <= (|s2_u_top && !(&s2_u_top)) || (|s2_v_top && !(&s2_v_top));
    end
    assign out_u0  = s3_u0;
    assign out_far = s3_far;

    wire unused_ok = &{1'b0, s1_adx, s1_bdy, s1_cdy, s1_adx_rest, s1_bdy_rest, s1_cdy_rest, s2_u[GUARD-1:0]};

endmodule

`default_nettype wire
