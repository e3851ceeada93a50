// gs_power_unit: p = u^2 + v^2 - log2(opacity) of one Gaussian at the 64 pixels of a subtile, 16 of them a cycle.
//
//   one Gaussian every 4 cycles; no backpressure; beat k, pixel rows 2k and 2k+1, leaves LATENCY + k = 11 + k cycles
//   behind in_valid
//
//   S1         dx, dy = centre of the first pixel - mean                     exact
//   S2 to S4   c*dy, a*dx, b*dy on one multiplier, cut in two by a register  exact
//   S4 to S6   their sums                                                    half_up
//   S5, S7     v, u of the first pixel wait; beyond SQ5 all is far           wrap
//   S8         v of the upper row                                            exact
//   S9         u of both rows; |v| -> UQ2.DIST_F                             exact; half_up, else far
//   S10        |u| of every lane -> UQ2.DIST_F; v^2 + opacity                half_up, else far; exact
//   S11        p                                                             half_up, high bits and far are one bit
//
//   u and v count modulo 64: a subtile is less than 28 of either wide, so what wraps lies beyond 4.

`default_nettype none
`include "gs_params.vh"

module gs_power_unit #(
    parameter LANES     = `GS_LANES,
    parameter MEAN_F    = `GS_MEAN_F,
    parameter MEAN_W    = `GS_MEAN_W,
    parameter CHOL_F    = `GS_CHOL_F,
    parameter CHOL_W    = `GS_CHOL_W,
    parameter OPACITY_F = `GS_OPACITY_F,
    parameter OPACITY_W = `GS_OPACITY_W,
    parameter STEP_F    = `GS_STEP_F,
    parameter DIST_F    = `GS_DIST_F,
    parameter DIST_W    = `GS_DIST_W,
    parameter POWER_F   = `GS_POWER_F,
    parameter POWER_W   = `GS_POWER_W  // of p: above its integer bits one that says "or more"
) (
    input  wire                         clk,
    input  wire                         rst,

    // in: a Gaussian, and the first pixel of the subtile; not within 4 cycles of the one before
    input  wire                         in_valid,
    input  wire [MEAN_W-MEAN_F-2:0]     in_x0,       // pixels
    input  wire [MEAN_W-MEAN_F-2:0]     in_y0,       // pixels
    input  wire [MEAN_W-1:0]            in_mean_x,   // SQ13.MEAN_F
    input  wire [MEAN_W-1:0]            in_mean_y,   // SQ13.MEAN_F
    input  wire [CHOL_W-1:0]            in_a,        // UQ1.CHOL_F
    input  wire [CHOL_W:0]              in_b,        // SQ1.CHOL_F
    input  wire [CHOL_W-1:0]            in_c,        // UQ1.CHOL_F
    input  wire [OPACITY_W-1:0]         in_opacity,  // UQ3.OPACITY_F

    // out: lane l is column l % 8 of the upper (l < 8) or lower row
    output wire [LANES*POWER_W-1:0]     out_p        // .POWER_F each; when the top bit is set, that is all
);

    localparam U_W       = STEP_F + 6;                       // SQ5.STEP_F
    localparam SET_DROP  = CHOL_F + MEAN_F - STEP_F;
    localparam SUM_W     = CHOL_W + MEAN_W + 3;
    localparam LOW_W     = (CHOL_W + 1) / 2;                 // of a factor, in the lower one of two products
    localparam PART_W    = LOW_W + MEAN_W + 2;
    localparam HIGH_W    = SUM_W - SET_DROP - U_W + 1;       // bits that are all equal unless it is far
    localparam DIST_DROP = STEP_F - DIST_F;
    localparam SQUARE_W  = 2*DIST_W;
    localparam E_DROP    = 2*DIST_F - POWER_F;
    localparam NEAR_W    = E_DROP + POWER_W - 1;             // bits of a sum that is not far
    localparam SHIFT     = 2*DIST_F - OPACITY_F;
    localparam BIAS_W    = (SQUARE_W > OPACITY_W + SHIFT ? SQUARE_W : OPACITY_W + SHIFT) + 1;  // v^2 + opacity
    localparam E_W       = SQUARE_W + 1;
    localparam [SUM_W-1:0]        SET_HALF  = 1 << (SET_DROP - 1);
    localparam [DIST_DROP-1:0]    DIST_HALF = 1 << (DIST_DROP - 1);
    localparam [BIAS_W-1:0]       HALF      = 1 << (E_DROP - 1);

    generate
        if (LANES != 16) begin : g_rule
            LANES_must_be_16 bad ();
        end
        if (DIST_DROP < 1 || E_DROP < 1) begin : g_narrow_rule
            DIST_F_must_be_below_STEP_F_and_above_half_of_POWER_F bad ();
        end
        if (OPACITY_W > OPACITY_F + 4 || POWER_W > POWER_F + 5) begin : g_range_rule
            OPACITY_and_POWER_must_have_4_integer_bits_at_most bad ();
        end
    endgenerate

    // |SQ5.STEP_F| to UQ2.DIST_F: half_up; the top bit says 4 or more. The sign's +1 and the half meet in one carry.
    function [DIST_W:0] distance;
        input [U_W-1:0]  x;
        reg   [U_W-2:0]  flipped;
        reg              carry;
        reg   [DIST_W:0] rounded;
        begin
            flipped  = x[U_W-2:0] ^ {U_W-1{x[U_W-1]}};
            carry    = flipped[DIST_DROP-1] || (x[U_W-1] && &(flipped[DIST_DROP-1:0] | DIST_HALF));
            rounded  = {1'b0, flipped[DIST_DROP +: DIST_W]} + {{DIST_W{1'b0}}, carry};
            distance = {rounded[DIST_W] || |flipped[U_W-2:DIST_DROP+DIST_W], rounded[DIST_W-1:0]};
        end
    endfunction

    // start_q[n]: the first beat of a Gaussian stands at stage n. What is filled once per Gaussian stays for four cycles,
    // and is passed on in time for the next one.
    reg [12:1] start_q;
    reg        s10_live;  // a beat stands there
    wire       s9_live = |start_q[12:9];
    always @(posedge clk) begin
        start_q  <= rst ? 12'd0 : {start_q[11:1], in_valid};
        s10_live <= s9_live;
    end

    // S1: dx, dy SQ14.MEAN_F
    reg [CHOL_W-1:0]    s1_a;
    reg [CHOL_W:0]      s1_b;
    reg [CHOL_W-1:0]    s1_c;
    reg [OPACITY_W-1:0] s1_opacity;
    reg [MEAN_W:0]      s1_dx;
    reg [MEAN_W:0]      s1_dy;
    always @(posedge clk) if (in_valid) begin
        s1_a       <= in_a;
        s1_b       <= in_b;
        s1_c       <= in_c;
        s1_opacity <= in_opacity;
        s1_dx      <= {2'b00, in_x0, 1'b1, {MEAN_F-1{1'b0}}} - {in_mean_x[MEAN_W-1], in_mean_x};
        s1_dy      <= {2'b00, in_y0, 1'b1, {MEAN_F-1{1'b0}}} - {in_mean_y[MEAN_W-1], in_mean_y};
    end

    // S2 to S4: c*dy, a*dx, b*dy, one after the other, as two products of half the digits each
    reg  signed [CHOL_W:0]      s2_x;
    reg  signed [MEAN_W:0]      s2_y;
    reg  signed [PART_W-1:0]    s3_low;
    reg  signed [PART_W-1:0]    s3_high;
    reg         [SUM_W-1:0]     s4_sum;  // c*dy when a Gaussian stands at S4, a*dx + b*dy at S6
    wire signed [LOW_W:0]       s2_low  = {1'b0, s2_x[LOW_W-1:0]};
    wire signed [CHOL_W-LOW_W:0] s2_high = s2_x[CHOL_W:LOW_W];
    wire        [SUM_W-1:0]     s3_wide_low  = {{SUM_W-PART_W{s3_low[PART_W-1]}}, s3_low};
    wire        [SUM_W-1:0]     s3_wide_high = {{SUM_W-PART_W{s3_high[PART_W-1]}}, s3_high};
    always @(posedge clk) begin
        s2_x    <= start_q[3] ? s1_b : {1'b0, start_q[2] ? s1_a : s1_c};
        s2_y    <= start_q[2] ? s1_dx : s1_dy;
        s3_low  <= s2_low * s2_y;
        s3_high <= s2_high * s2_y;
        s4_sum  <= s3_wide_low + (s3_wide_high << LOW_W) + (start_q[5] ? s4_sum : SET_HALF);
    end
    wire s4_near = s4_sum[SUM_W-1 -: HIGH_W] == {HIGH_W{s4_sum[SUM_W-1]}};

    // S5 to S8: what waits
    reg [U_W-1:0]       s5_v;
    reg                 s5_near;
    reg [CHOL_W-1:0]    s5_a;
    reg [CHOL_W:0]      s5_b;
    reg [CHOL_W-1:0]    s5_c;
    reg [OPACITY_W-1:0] s5_opacity;
    reg [U_W-1:0]       s7_u;
    reg                 s7_near;
    always @(posedge clk) begin
        if (start_q[4]) begin
            s5_v       <= s4_sum[SET_DROP +: U_W];
            s5_near    <= s4_near;
            s5_a       <= s1_a;
            s5_b       <= s1_b;
            s5_c       <= s1_c;
            s5_opacity <= s1_opacity;
        end
        if (start_q[6]) begin
            s7_u    <= s4_sum[SET_DROP +: U_W];
            s7_near <= s4_near && s5_near;
        end
    end

    // S8 and S9: two rows a beat
    reg [CHOL_W:0]      s8_b;
    reg [CHOL_W-1:0]    s8_c;
    reg [U_W-1:0]       s8_v;
    reg [CHOL_W-1:0]    s9_a;
    reg [OPACITY_W-1:0] s9_opacity;
    reg                 s9_near;
    reg [2*U_W-1:0]     s9_u;
    wire [U_W-1:0] s8_wide_b = {{U_W-CHOL_W-1{s8_b[CHOL_W]}}, s8_b};
    wire [U_W-1:0] s8_wide_c = {{U_W-CHOL_W{1'b0}}, s8_c};
    wire [U_W-1:0] s9_wide_a = {{U_W-CHOL_W{1'b0}}, s9_a};
    wire [U_W-1:0] s8_step   = start_q[8] ? s8_wide_b : s8_wide_b << 1;
    always @(posedge clk) begin
        if (start_q[7]) begin
            s8_b <= s5_b;
            s8_c <= s5_c;
        end
        s8_v <= start_q[7] ? s5_v : s8_v + (s8_wide_c << 1);
        if (start_q[8]) begin
            s9_a       <= s5_a;
            s9_opacity <= s5_opacity;
            s9_near    <= s7_near;
        end
        s9_u[0 +: U_W]   <= start_q[8] ? s7_u : s9_u[0 +: U_W] + (s8_wide_b << 1);
        s9_u[U_W +: U_W] <= (start_q[8] ? s7_u : s9_u[U_W +: U_W]) + s8_step;
    end

    // v is a stage ahead of u: S10 adds the opacity and half of p's last place
    wire [BIAS_W-1:0]     s9_offset = ({{BIAS_W-OPACITY_W{1'b0}}, s9_opacity} << SHIFT) + HALF;
    wire [2*NEAR_W-1:0]   s10_biases;
    wire [1:0]            s10_fars;
    wire [LANES*U_W-1:0]  s9_us;
    genvar r;
    genvar l;
    generate
        for (r = 0; r < 2; r = r + 1) begin : g_row
            reg  [DIST_W:0]   s9_v;      // far, UQ2.DIST_F
            reg  [NEAR_W-1:0] s10_bias;  // .(2*DIST_F)
            reg               s10_far;
            wire [BIAS_W-1:0] s9_wide = {{BIAS_W-DIST_W{1'b0}}, s9_v[DIST_W-1:0]};
            wire [BIAS_W-1:0] s9_bias = s9_wide * s9_wide + s9_offset;
            always @(posedge clk) begin
                s9_v <= distance(r == 0 ? s8_v : s8_v + s8_wide_c);
                if (s9_live) begin
                    s10_bias <= s9_bias[NEAR_W-1:0];
                    s10_far  <= s9_v[DIST_W] || !s9_near || |s9_bias[BIAS_W-1:NEAR_W];
                end
            end
            assign s10_biases[r*NEAR_W +: NEAR_W] = s10_bias;
            assign s10_fars[r] = s10_far;

            // u + i*a: the lower ones first
            wire [U_W-1:0]   s9_u0 = s9_u[r*U_W +: U_W];
            wire [U_W-1:0]   s9_u1 = s9_u0 + s9_wide_a;
            wire [2*U_W-1:0] s9_u23 = {s9_u1 + (s9_wide_a << 1), s9_u0 + (s9_wide_a << 1)};
            wire [4*U_W-1:0] s9_u0123 = {s9_u23, s9_u1, s9_u0};
            wire [4*U_W-1:0] s9_u4567;
            for (l = 0; l < 4; l = l + 1) begin : g_column
                assign s9_u4567[l*U_W +: U_W] = s9_u0123[l*U_W +: U_W] + (s9_wide_a << 2);
            end
            assign s9_us[8*r*U_W +: 8*U_W] = {s9_u4567, s9_u0123};
        end

        for (l = 0; l < LANES; l = l + 1) begin : g_lane
            localparam ROW = l / 8;
            reg  [DIST_W:0]    s10_u_n;  // complement: what stands behind an inverting flip-flop is the value
            reg  [POWER_W-1:0] s11_p;
            wire [DIST_W:0]    s10_u = ~s10_u_n;  // far, UQ2.DIST_F
            wire [E_W-1:0] s10_wide = {{E_W-DIST_W{1'b0}}, s10_u[DIST_W-1:0]};
            wire [E_W-1:0] s10_sum  = s10_wide * s10_wide + {{E_W-NEAR_W{1'b0}}, s10_biases[ROW*NEAR_W +: NEAR_W]};
            always @(posedge clk) begin
                if (s9_live) s10_u_n <= ~distance(s9_us[l*U_W +: U_W]);
                if (s10_live) begin
                    s11_p <= {s10_u[DIST_W] || s10_fars[ROW] || |s10_sum[E_W-1:NEAR_W], s10_sum[E_DROP +: POWER_W-1]};
                end
            end
            assign out_p[l*POWER_W +: POWER_W] = s11_p;
            wire unused_ok = &{1'b0, s10_sum[E_DROP-1:0]};
        end
    endgenerate
    wire unused_ok = &{1'b0, s4_sum[SET_DROP-1:0]};

endmodule

`default_nettype wire
