// gs_intersection_test_unit: does an ellipse touch one of the eight pixel rows of a subtile?
//
//   latency UNIT_LATENCY = 5, one entry per cycle, never stalls
//
//   S1 steps    -(u0 + 7a), and odd multiples of b and c         exact
//   S2 rows     per row: u at its left end, -u at its right end, v      exact
//   S3 nearest  per row: du = max(left, -right, 0), |v|          exact, then floor, sat to UQ2.ITU_F
//   S4 square   du^2, v^2                                        exact
//   S5 compare  du^2 + v^2 <= limit in any row

`default_nettype none
`include "gs_params.vh"

module gs_intersection_test_unit #(
    parameter SUBTILE   = `GS_SUBTILE,
    parameter CHOL_W    = `GS_CHOL_W,
    parameter STEP_F    = `GS_STEP_F,
    parameter STEP_W    = `GS_STEP_W,
    parameter ITU_F     = `GS_ITU_F,
    parameter ITU_W     = `GS_ITU_W,
    parameter OPACITY_F = `GS_OPACITY_F,
    parameter OPACITY_W = `GS_OPACITY_W
) (
    input  wire               clk,
    input  wire               rst,

    // in: an ellipse as seen from the first pixel of the subtile
    input  wire               in_valid,
    input  wire [STEP_W:0]    in_u0,     // SQ9.STEP_F: U0 of the group + 8*s*a
    input  wire [STEP_W-1:0]  in_v0,     // SQ8.STEP_F
    input  wire [CHOL_W-1:0]  in_a,      // UQ1.STEP_F
    input  wire [CHOL_W:0]    in_b,      // SQ1.STEP_F
    input  wire [CHOL_W-1:0]  in_c,      // UQ1.STEP_F
    input  wire [2*ITU_F+OPACITY_W-OPACITY_F:0] in_limit,  // .(2*ITU_F), signed: bound() of the golden model

    // out: same order
    output wire               out_valid,
    output wire               out_hit
);

    localparam U_W     = STEP_W + 1;  // SQ9.STEP_F
    localparam DROP    = STEP_F - ITU_F;
    localparam LIMIT_W = 2*ITU_F + OPACITY_W - OPACITY_F + 1;
    localparam REST_W  = LIMIT_W + 2;
    localparam WIDER   = REST_W - 2*ITU_W;

    generate
        if (SUBTILE != 8) begin : g_rule
            SUBTILE_must_be_8 bad ();
        end
        if (WIDER < 2) begin : g_limit_rule
            OPACITY_must_have_3_integer_bits_at_least bad ();
        end
    endgenerate

    // A number that is not negative to UQ2.ITU_F: floor, sat
    function [ITU_W-1:0] narrow;
        input [U_W-DROP-1:0] x;  // SQ9.ITU_F, the bits below are gone
        begin
            narrow = x[ITU_W-1:0] | {ITU_W{|x[U_W-DROP-1:ITU_W]}};
        end
    endfunction

    reg s1_valid;
    reg s2_valid;
    reg s3_valid;
    reg s4_valid;
    reg s5_valid;
    always @(posedge clk) begin
        s1_valid <= in_valid && !rst;
        s2_valid <= s1_valid && !rst;
        s3_valid <= s2_valid && !rst;
        s4_valid <= s3_valid && !rst;
        s5_valid <= s4_valid && !rst;
    end
    assign out_valid = s5_valid;

    // S1 steps. Only the odd multiples cost an adder.
    wire [U_W-1:0] in_a1 = {{U_W-CHOL_W{1'b0}}, in_a};
    wire [U_W-1:0] in_b1 = {{U_W-CHOL_W-1{in_b[CHOL_W]}}, in_b};
    wire [U_W-1:0] in_c1 = {{U_W-CHOL_W{1'b0}}, in_c};
    wire [U_W-1:0] in_v  = {in_v0[STEP_W-1], in_v0};
    reg [U_W-1:0] s1_left;
    reg [U_W-1:0] s1_right;  // negated
    reg [U_W-1:0] s1_v;
    reg [U_W-1:0] s1_b1;
    reg [U_W-1:0] s1_b3;
    reg [U_W-1:0] s1_b5;
    reg [U_W-1:0] s1_b7;
    reg [U_W-1:0] s1_c1;
    reg [U_W-1:0] s1_c3;
    reg [U_W-1:0] s1_c5;
    reg [U_W-1:0] s1_c7;
    always @(posedge clk) begin
        s1_left  <= in_u0;
        s1_right <= in_a1 - (in_a1 << 3) - in_u0;
        s1_v     <= in_v;
        s1_b1    <= in_b1;
        s1_b3    <= (in_b1 << 1) + in_b1;
        s1_b5    <= (in_b1 << 2) + in_b1;
        s1_b7    <= (in_b1 << 3) - in_b1;
        s1_c1    <= in_c1;
        s1_c3    <= (in_c1 << 1) + in_c1;
        s1_c5    <= (in_c1 << 2) + in_c1;
        s1_c7    <= (in_c1 << 3) - in_c1;
    end
    wire [8*U_W-1:0] s1_jb = {s1_b7, s1_b3 << 1, s1_b5, s1_b1 << 2, s1_b3, s1_b1 << 1, s1_b1, {U_W{1'b0}}};
    wire [8*U_W-1:0] s1_jc = {s1_c7, s1_c3 << 1, s1_c5, s1_c1 << 2, s1_c3, s1_c1 << 1, s1_c1, {U_W{1'b0}}};

    // The limit keeps pace with the rows.
    reg [LIMIT_W-1:0] s1_limit;
    reg [LIMIT_W-1:0] s2_limit;
    reg [LIMIT_W-1:0] s3_limit;
    reg [LIMIT_W-1:0] s4_limit;
    always @(posedge clk) begin
        s1_limit <= in_limit;
        s2_limit <= s1_limit;
        s3_limit <= s2_limit;
        s4_limit <= s3_limit;
    end

    wire [7:0] s4_inside;
    genvar j;
    generate
        for (j = 0; j < 8; j = j + 1) begin : g_row
            // S2 rows
            reg [U_W-1:0] s2_left;
            reg [U_W-1:0] s2_right;  // negated
            reg [U_W-1:0] s2_v;
            always @(posedge clk) begin
                s2_left  <= s1_left + s1_jb[j*U_W +: U_W];
                s2_right <= s1_right - s1_jb[j*U_W +: U_W];
                s2_v     <= s1_v + s1_jc[j*U_W +: U_W];
            end

            // S3 nearest: a is not negative, so one of left and -right is positive at most
            wire [U_W-1:0] s2_du = (s2_left & {U_W{!s2_left[U_W-1]}}) | (s2_right & {U_W{!s2_right[U_W-1]}});
            wire [U_W-1:0] s2_dv = s2_v[U_W-1] ? ~s2_v + {{U_W-1{1'b0}}, 1'b1} : s2_v;
            reg [ITU_W-1:0] s3_du;  // UQ2.ITU_F
            reg [ITU_W-1:0] s3_dv;  // UQ2.ITU_F
            always @(posedge clk) begin
                s3_du <= narrow(s2_du[U_W-1:DROP]);
                s3_dv <= narrow(s2_dv[U_W-1:DROP]);
            end

            // S4 square
            reg [2*ITU_W-1:0] s4_u2;  // UQ4.(2*ITU_F)
            reg [2*ITU_W-1:0] s4_v2;
            always @(posedge clk) begin
                s4_u2 <= {{ITU_W{1'b0}}, s3_du} * {{ITU_W{1'b0}}, s3_du};
                s4_v2 <= {{ITU_W{1'b0}}, s3_dv} * {{ITU_W{1'b0}}, s3_dv};
            end

            // S5 compare: limit - du^2 - v^2 is not negative
            wire [REST_W-1:0] s4_rest = {{2{s4_limit[LIMIT_W-1]}}, s4_limit}
                                      - {{WIDER{1'b0}}, s4_u2} - {{WIDER{1'b0}}, s4_v2};
            assign s4_inside[j] = !s4_rest[REST_W-1];
            wire unused_row_ok = &{1'b0, s2_du, s2_dv, s4_rest};
        end
    endgenerate

    reg s5_hit;
    always @(posedge clk) s5_hit <= |s4_inside;
    assign out_hit = s5_hit;

endmodule

`default_nettype wire
