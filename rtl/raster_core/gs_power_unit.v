// gs_power_unit: p = u^2 + v^2 - log2(opacity) of one Gaussian at the 64 pixels of a subtile, 16 of them a cycle.
//
//   one Gaussian every 4 cycles; no backpressure; beat k, pixel rows 2k and 2k+1, leaves LATENCY + k = 10 + k cycles
//   behind in_valid
//
//   S1         dx, dy = centre of the first pixel - mean                     exact
//   S2 to S4   a*dx, b*dy, c*dy on one multiplier                            exact
//   S5         u and v of the beat's upper row: set up, then stepped         half_up, sat to SQ8.STEP_F
//   S6         u and v of both rows                                          exact
//   S7         u of every lane; |v| -> UQ2.DIST_F                            exact; half_up, sat
//   S8         |u| -> UQ2.DIST_F; v^2                                        half_up, sat; exact
//   S9         u^2; v^2 + opacity                                            exact
//   S10        p                                                             half_up, high bits collected in one

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
    parameter STEP_W    = `GS_STEP_W,
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

    localparam U_W       = STEP_W + 1;                       // SQ9.STEP_F
    localparam SET_DROP  = CHOL_F + MEAN_F - STEP_F;
    localparam PROD_W    = CHOL_W + 1 + MEAN_W + 1;
    localparam SUM_W     = PROD_W + 1;
    localparam HIGH_W    = SUM_W - SET_DROP - STEP_W + 1;    // bits that are all equal unless it saturates
    localparam A_W       = CHOL_W + 3;                       // 7a
    localparam DIST_DROP = STEP_F - DIST_F;
    localparam SQUARE_W  = 2*DIST_W;
    localparam BIAS_W    = SQUARE_W + 1;                     // v^2 + opacity
    localparam E_W       = BIAS_W + 1;
    localparam E_DROP    = 2*DIST_F - POWER_F;
    localparam [BIAS_W-1:0]    HALF      = 1 << (E_DROP - 1);
    localparam [DIST_DROP-1:0] DIST_HALF = 1 << (DIST_DROP - 1);

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

    // .(CHOL_F+MEAN_F) to SQ8.STEP_F: half_up, sat
    function [STEP_W-1:0] set_narrow;
        input [SUM_W-1:0] x;
        reg   [SUM_W-1:0] rounded;
        begin
            rounded = x + {{SUM_W-SET_DROP{1'b0}}, 1'b1, {SET_DROP-1{1'b0}}};
            if (rounded[SUM_W-1 -: HIGH_W] == {HIGH_W{rounded[SUM_W-1]}}) set_narrow = rounded[SET_DROP +: STEP_W];
            else set_narrow = {rounded[SUM_W-1], {STEP_W-1{!rounded[SUM_W-1]}}};
        end
    endfunction

    // |SQ9.STEP_F| to UQ2.DIST_F: half_up, sat. The sign's +1 and the half meet in one carry.
    function [DIST_W-1:0] distance;
        input [U_W-1:0]  x;
        reg   [U_W-2:0]  flipped;
        reg              carry;
        reg   [DIST_W:0] rounded;
        begin
            flipped  = x[U_W-2:0] ^ {U_W-1{x[U_W-1]}};
            carry    = flipped[DIST_DROP-1] || (x[U_W-1] && &(flipped[DIST_DROP-1:0] | DIST_HALF));
            rounded  = {1'b0, flipped[DIST_DROP +: DIST_W]} + {{DIST_W{1'b0}}, carry};
            distance = rounded[DIST_W-1:0] | {DIST_W{rounded[DIST_W] || |flipped[U_W-2:DIST_DROP+DIST_W]}};
        end
    endfunction

    function [SQUARE_W-1:0] square;
        input [DIST_W-1:0] x;
        square = {{DIST_W{1'b0}}, x} * {{DIST_W{1'b0}}, x};
    endfunction

    // start_q[n]: the first beat of a Gaussian stands at stage n. What is filled once per Gaussian stays for four cycles,
    // and is passed on in time for the next one.
    reg [7:1] start_q;
    always @(posedge clk) start_q <= rst ? 7'd0 : {start_q[6:1], in_valid};

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

    // S2 to S4: a*dx leaves the multiplier at S2, b*dy at S3, c*dy at S4
    wire signed [CHOL_W:0] mul_x = start_q[2] ? s1_b : {1'b0, start_q[3] ? s1_c : s1_a};
    wire signed [MEAN_W:0] mul_y = start_q[1] ? s1_dx : s1_dy;
    reg  signed [PROD_W-1:0] s2_prod;
    reg  [SUM_W-1:0] s3_sum;
    wire [SUM_W-1:0] s2_wide = {s2_prod[PROD_W-1], s2_prod};
    always @(posedge clk) begin
        s2_prod <= mul_x * mul_y;
        s3_sum  <= s2_wide + (s3_sum & {SUM_W{start_q[3]}});
    end

    // S5: two rows a beat
    wire [STEP_W-1:0] s4_u0 = set_narrow(s3_sum);
    wire [STEP_W-1:0] s4_v0 = set_narrow(s2_wide);
    reg [CHOL_W-1:0]    s5_a;
    reg [CHOL_W:0]      s5_b;
    reg [CHOL_W-1:0]    s5_c;
    reg [OPACITY_W-1:0] s5_opacity;
    reg [U_W-1:0]       s5_u;
    reg [U_W-1:0]       s5_v;
    wire [A_W-1:0] s5_wide_a = {3'b000, s5_a};
    wire [U_W-1:0] s5_wide_b = {{U_W-CHOL_W-1{s5_b[CHOL_W]}}, s5_b};
    wire [U_W-1:0] s5_wide_c = {{U_W-CHOL_W{1'b0}}, s5_c};
    always @(posedge clk) begin
        if (start_q[4]) begin
            s5_a       <= s1_a;
            s5_b       <= s1_b;
            s5_c       <= s1_c;
            s5_opacity <= s1_opacity;
        end
        s5_u <= start_q[4] ? {s4_u0[STEP_W-1], s4_u0} : s5_u + (s5_wide_b << 1);
        s5_v <= start_q[4] ? {s4_v0[STEP_W-1], s4_v0} : s5_v + (s5_wide_c << 1);
    end

    // S6: both rows, and the odd multiples of a
    reg [A_W-1:0]   s6_a1;
    reg [A_W-1:0]   s6_a3;
    reg [A_W-1:0]   s6_a5;
    reg [A_W-1:0]   s6_a7;
    reg [2*U_W-1:0] s6_u;
    reg [2*U_W-1:0] s6_v;
    always @(posedge clk) begin
        if (start_q[5]) begin
            s6_a1 <= s5_wide_a;
            s6_a3 <= (s5_wide_a << 1) + s5_wide_a;
            s6_a5 <= (s5_wide_a << 2) + s5_wide_a;
            s6_a7 <= (s5_wide_a << 3) - s5_wide_a;
        end
        s6_u <= {s5_u + s5_wide_b, s5_u};
        s6_v <= {s5_v + s5_wide_c, s5_v};
    end
    wire [8*A_W-1:0] s6_ia = {s6_a7, s6_a3 << 1, s6_a5, s6_a1 << 2, s6_a3, s6_a1 << 1, s6_a1, {A_W{1'b0}}};

    // S7 to S9 of v, a stage ahead of u: S9 adds the opacity and half of p's last place
    reg  [OPACITY_W-1:0] s8_opacity;
    wire [BIAS_W-1:0]    s8_offset = ({{BIAS_W-OPACITY_W{1'b0}}, s8_opacity} << (2*DIST_F - OPACITY_F)) + HALF;
    wire [2*BIAS_W-1:0]  s9_biases;
    genvar r;
    generate
        for (r = 0; r < 2; r = r + 1) begin : g_row
            reg [DIST_W-1:0]   s7_v;     // UQ2.DIST_F
            reg [SQUARE_W-1:0] s8_v2;    // UQ4.(2*DIST_F)
            reg [BIAS_W-1:0]   s9_bias;  // UQ5.(2*DIST_F)
            always @(posedge clk) begin
                s7_v    <= distance(s6_v[r*U_W +: U_W]);
                s8_v2   <= square(s7_v);
                s9_bias <= {1'b0, s8_v2} + s8_offset;
            end
            assign s9_biases[r*BIAS_W +: BIAS_W] = s9_bias;
        end
    endgenerate
    always @(posedge clk) if (start_q[7]) s8_opacity <= s5_opacity;

    // S7 to S10 of u
    genvar l;
    generate
        for (l = 0; l < LANES; l = l + 1) begin : g_lane
            localparam ROW = l / 8;
            localparam COL = l % 8;
            reg  [U_W-1:0]      s7_u;    // SQ9.STEP_F
            reg  [DIST_W-1:0]   s8_u;    // UQ2.DIST_F
            reg  [SQUARE_W-1:0] s9_u2;   // UQ4.(2*DIST_F)
            wire [E_W-1:0]      s9_sum = {{E_W-SQUARE_W{1'b0}}, s9_u2} + {1'b0, s9_biases[ROW*BIAS_W +: BIAS_W]};
            reg  [POWER_W-1:0]      s10_p;
            always @(posedge clk) begin
                s7_u  <= s6_u[ROW*U_W +: U_W] + {{U_W-A_W{1'b0}}, s6_ia[COL*A_W +: A_W]};
                s8_u  <= distance(s7_u);
                s9_u2 <= square(s8_u);
                s10_p <= {|s9_sum[E_W-1:E_DROP+POWER_W-1], s9_sum[E_DROP +: POWER_W-1]};
            end
            assign out_p[l*POWER_W +: POWER_W] = s10_p;
            wire unused_ok = &{1'b0, s9_sum[E_DROP-1:0]};
        end
    endgenerate

endmodule

`default_nettype wire
