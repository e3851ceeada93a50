// gs_subtile_compute_unit: blends Gaussians, one after the other, on the 64 pixels of one 8x8 subtile.
//
//   one operation (blend a Gaussian, or change the subtile) every BEATS = 4 cycles, 16 pixels a cycle, no backpressure
//   inside; op_ready is a register's; LATENCY = 16 from taking a swap to sat_valid
//
//   S1..S4   set-up: dx, dy, then a*dx, b*dy, c*dy on one multiplier    half_up, sat to SQ8.STEP_F
//   S5, S6   u and v at the start of the beat's two pixel rows          exact
//   S7       u of every lane                                            exact
//   S8       |u|, |v| -> UQ2.DIST_F (v one stage earlier)               half_up, sat
//   S9       squares; v's is joined by the opacity                      exact
//   S10      p = u^2 + v^2 + opacity -> .POWER_F                        half_up
//   S11      2^-p (gs_exp2_unit) and p <= CUT; pixel buffer read
//   S12 weigh       alpha * T -> w; swap: state out, state in           half_up
//   S13 attenuate   w = min(w, T - 1), T - w
//   S14 accumulate  acc + w * colour, done = T < T_STOP                 half_up, cannot overflow
//   S15             back to S12
//
//   S12 to S15 are a ring that holds the subtile, four pixels a lane, and moves only when a beat is at S12: operations
//   meet in it back to back, whatever the gaps between them were. A beat's last stages are so done by the next operation.

`default_nettype none
`include "gs_params.vh"

module gs_subtile_compute_unit #(
    parameter SUBTILE   = `GS_SUBTILE,
    parameter LANES     = `GS_LANES,
    parameter GROUPS    = `GS_GROUPS,
    parameter MEAN_F    = `GS_MEAN_F,
    parameter MEAN_W    = `GS_MEAN_W,
    parameter CHOL_F    = `GS_CHOL_F,
    parameter CHOL_W    = `GS_CHOL_W,
    parameter OPACITY_F = `GS_OPACITY_F,
    parameter OPACITY_W = `GS_OPACITY_W,
    parameter COLOUR_F  = `GS_COLOUR_F,
    parameter COLOUR_W  = `GS_COLOUR_W,
    parameter STEP_F    = `GS_STEP_F,
    parameter STEP_W    = `GS_STEP_W,
    parameter DIST_F    = `GS_DIST_F,
    parameter DIST_W    = `GS_DIST_W,
    parameter POWER_F   = `GS_POWER_F,
    parameter CUT       = `GS_CUT,
    parameter EXP_F     = `GS_EXP_F,
    parameter ALPHA_F   = `GS_ALPHA_F,
    parameter ALPHA_MAX = `GS_ALPHA_MAX,
    parameter T_F       = `GS_T_F,
    parameter T_STOP    = `GS_T_STOP,
    parameter ACC_F     = `GS_ACC_F,
    parameter ACC_W     = `GS_ACC_W
) (
    input  wire                           clk,
    input  wire                           rst,

    // op: taken every fourth cycle at most
    input  wire                           op_valid,
    output wire                           op_ready,
    input  wire                           op_swap,     // 1: change the subtile, 0: blend a Gaussian
    input  wire                           op_store,    // swap: write the held pixels back
    input  wire                           op_fresh,    // swap: fresh pixels instead of those in the pixel buffer
    input  wire [$clog2(GROUPS)-1:0]      op_group,    // swap: the group to load
    input  wire [3:0]                     op_cols,     // swap, fresh: columns inside the picture, 0..8
    input  wire [3:0]                     op_rows,     // swap, fresh: rows inside the picture, 0..8
    input  wire [MEAN_W-MEAN_F-2:0]       op_x0,       // blend: first pixel of the subtile
    input  wire [MEAN_W-MEAN_F-2:0]       op_y0,
    input  wire [CHOL_W-1:0]              op_a,        // blend: UQ1.CHOL_F
    input  wire [CHOL_W:0]                op_b,        // SQ1.CHOL_F
    input  wire [CHOL_W-1:0]              op_c,        // UQ1.CHOL_F
    input  wire [MEAN_W-1:0]              op_mean_x,   // SQ13.MEAN_F
    input  wire [MEAN_W-1:0]              op_mean_y,   // SQ13.MEAN_F
    input  wire [OPACITY_W-1:0]           op_opacity,  // UQ3.OPACITY_F
    input  wire [COLOUR_W-1:0]            op_red,      // UQ2.COLOUR_F
    input  wire [COLOUR_W-1:0]            op_green,    // UQ2.COLOUR_F
    input  wire [COLOUR_W-1:0]            op_blue,     // UQ2.COLOUR_F

    // px: pixel buffer; word {group, beat} holds lane l at bit l * (T_F + 2 + 3*ACC_W): {done, blue, green, red, T}
    output wire                               px_rd_en,
    output wire [$clog2(GROUPS)+1:0]          px_rd_addr,
    input  wire [LANES*(T_F+2+3*ACC_W)-1:0]   px_rd_data,  // one cycle after its address
    output wire                               px_wr_en,
    output wire [$clog2(GROUPS)+1:0]          px_wr_addr,
    output wire [LANES*(T_F+2+3*ACC_W)-1:0]   px_wr_data,

    // sat: what a swap put out; all means nothing before the first subtile is in
    output wire                           sat_valid,
    output wire [$clog2(GROUPS)-1:0]      sat_group,   // the group that was held
    output wire                           sat_stored,
    output wire                           sat_all,     // all 64 of its pixels are done

    // trace: which lanes blended in this cycle
    output wire                           trace_valid,
    output wire [LANES-1:0]               trace_blend
);

    localparam GROUP_W  = $clog2(GROUPS);
    localparam T_W      = T_F + 1;
    localparam W_W      = T_F;                         // a weight is below 1
    localparam STATE_W  = T_W + 3*ACC_W + 1;
    localparam COLOURS_W = 3*COLOUR_W;
    localparam U_W      = STEP_W + 1;                  // SQ9.STEP_F
    localparam SET_DROP = CHOL_F + MEAN_F - STEP_F;
    localparam PROD_W   = CHOL_W + 1 + MEAN_W + 1;
    localparam SUM_W    = PROD_W + 1;
    localparam HIGH_W   = SUM_W - SET_DROP - STEP_W + 1;  // bits that are all equal unless it saturates
    localparam DIST_DROP = STEP_F - DIST_F;
    localparam SQUARE_W = 2*DIST_W;
    localparam E_DROP   = 2*DIST_F - POWER_F;
    localparam BIAS_W   = SQUARE_W + 1;                // v^2 + opacity
    localparam P_W      = POWER_F + 3;                 // of a p that may be kept
    localparam PSUM_W   = BIAS_W + 1;
    localparam PRODT_W  = ALPHA_F + T_W;
    localparam ACC_DROP = T_F + COLOUR_F - ACC_F;
    localparam FULL_W   = ACC_W + ACC_DROP;
    // half_up(alpha * T) can only be T where T is no more than 1/2 / (1 - ALPHA_MAX): these bits
    localparam LOW_W    = $clog2((1 << (ALPHA_F - 1)) / ((1 << ALPHA_F) - ALPHA_MAX) + 1);
    localparam [P_W-1:0]     CUT_P     = CUT[P_W-1:0];
    localparam [ALPHA_F-1:0] ALPHA_TOP = ALPHA_MAX[ALPHA_F-1:0];
    localparam [T_W-1:0]     T_END     = T_STOP[T_W-1:0];

    generate
        if (SUBTILE != 8) begin : g_subtile_rule
            SUBTILE_must_be_8 bad ();
        end
        if (LANES != 16) begin : g_lanes_rule
            LANES_must_be_16 bad ();
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

    // |SQ9.STEP_F| to UQ2.DIST_F: half_up, sat. The sign's +1 and the half only meet in the carry.
    function [DIST_W-1:0] distance;
        input [U_W-1:0]  x;
        reg   [U_W-2:0]  flipped;
        reg              carry;
        reg   [DIST_W:0] rounded;
        begin
            flipped = x[U_W-2:0] ^ {U_W-1{x[U_W-1]}};
            carry   = flipped[DIST_DROP-1] || (x[U_W-1] && &flipped[DIST_DROP-2:0]);
            rounded = {1'b0, flipped[DIST_DROP +: DIST_W]} + {{DIST_W{1'b0}}, carry};
            distance = rounded[DIST_W-1:0] | {DIST_W{rounded[DIST_W] || |flipped[U_W-2:DIST_DROP+DIST_W]}};
        end
    endfunction

    function [SQUARE_W-1:0] square;
        input [DIST_W-1:0] x;
        square = {{DIST_W{1'b0}}, x} * {{DIST_W{1'b0}}, x};
    endfunction

    // start_q[n]: the first beat of an operation stands at stage n. Beat k follows k cycles behind; registers that an
    // operation fills once are passed on in time for the next operation.
    reg  [14:1] start_q;
    wire        take = op_valid && op_ready;
    assign op_ready = !(start_q[1] || start_q[2] || start_q[3]);
    always @(posedge clk) start_q <= rst ? 14'd0 : {start_q[13:1], take};

    // What the last stages need of an operation, passed along.
    reg                 s1_swap;
    reg                 s1_store;
    reg                 s1_fresh;
    reg [GROUP_W-1:0]   s1_group;
    reg [3:0]           s1_cols;
    reg [3:0]           s1_rows;
    reg [OPACITY_W-1:0] s1_opacity;
    reg [COLOURS_W-1:0] s1_colours;
    reg                 s5_swap;
    reg                 s5_store;
    reg                 s5_fresh;
    reg [GROUP_W-1:0]   s5_group;
    reg [3:0]           s5_cols;
    reg [3:0]           s5_rows;
    reg [OPACITY_W-1:0] s5_opacity;
    reg [COLOURS_W-1:0] s5_colours;
    reg                 s8_swap;
    reg                 s8_store;
    reg                 s8_fresh;
    reg [GROUP_W-1:0]   s8_group;
    reg [3:0]           s8_cols;
    reg [3:0]           s8_rows;
    reg [OPACITY_W-1:0] s8_opacity;
    reg [COLOURS_W-1:0] s8_colours;
    reg                 s11_swap;
    reg                 s11_store;
    reg                 s11_fresh;
    reg [GROUP_W-1:0]   s11_group;
    reg [3:0]           s11_cols;
    reg [3:0]           s11_rows;
    reg [COLOURS_W-1:0] s11_colours;
    reg [COLOURS_W-1:0] s14_colours;
    always @(posedge clk) begin
        if (take) begin
            s1_swap    <= op_swap;
            s1_store   <= op_store;
            s1_fresh   <= op_fresh;
            s1_group   <= op_group;
            s1_cols    <= op_cols;
            s1_rows    <= op_rows;
            s1_opacity <= op_opacity;
            s1_colours <= {op_blue, op_green, op_red};
        end
        if (start_q[4]) begin
            s5_swap    <= s1_swap;
            s5_store   <= s1_store;
            s5_fresh   <= s1_fresh;
            s5_group   <= s1_group;
            s5_cols    <= s1_cols;
            s5_rows    <= s1_rows;
            s5_opacity <= s1_opacity;
            s5_colours <= s1_colours;
        end
        if (start_q[7]) begin
            s8_swap    <= s5_swap;
            s8_store   <= s5_store;
            s8_fresh   <= s5_fresh;
            s8_group   <= s5_group;
            s8_cols    <= s5_cols;
            s8_rows    <= s5_rows;
            s8_opacity <= s5_opacity;
            s8_colours <= s5_colours;
        end
        if (start_q[10]) begin
            s11_swap    <= s8_swap;
            s11_store   <= s8_store;
            s11_fresh   <= s8_fresh;
            s11_group   <= s8_group;
            s11_cols    <= s8_cols;
            s11_rows    <= s8_rows;
            s11_colours <= s8_colours;
        end
        if (start_q[13]) s14_colours <= s11_colours;
    end

    // S1: SQ14.MEAN_F
    wire [MEAN_W:0] op_dx = {2'b00, op_x0, 1'b1, {MEAN_F-1{1'b0}}} - {op_mean_x[MEAN_W-1], op_mean_x};
    wire [MEAN_W:0] op_dy = {2'b00, op_y0, 1'b1, {MEAN_F-1{1'b0}}} - {op_mean_y[MEAN_W-1], op_mean_y};
    reg [CHOL_W-1:0] s1_a;
    reg [CHOL_W:0]   s1_b;
    reg [CHOL_W-1:0] s1_c;
    reg [MEAN_W:0]   s1_dx;
    reg [MEAN_W:0]   s1_dy;
    always @(posedge clk) if (take) begin
        s1_a  <= op_a;
        s1_b  <= op_b;
        s1_c  <= op_c;
        s1_dx <= op_dx;
        s1_dy <= op_dy;
    end

    // S2..S4: a*dx leaves the multiplier in cycle 2, b*dy in cycle 3, c*dy in cycle 4
    wire signed [CHOL_W:0] mul_x = start_q[2] ? s1_b : {1'b0, start_q[3] ? s1_c : s1_a};
    wire signed [MEAN_W:0] mul_y = start_q[1] ? s1_dx : s1_dy;
    reg  signed [PROD_W-1:0] s2_prod;
    wire [SUM_W-1:0] s2_wide = {s2_prod[PROD_W-1], s2_prod};
    reg  [SUM_W-1:0] s3_sum;
    always @(posedge clk) begin
        s2_prod <= mul_x * mul_y;
        s3_sum  <= s2_wide + (s3_sum & {SUM_W{start_q[3]}});
    end

    // S5: u and v of the beat's upper row
    wire [STEP_W-1:0] s4_u0 = set_narrow(s3_sum);
    wire [STEP_W-1:0] s4_v0 = set_narrow(s2_wide);
    reg [CHOL_W-1:0] s5_a;
    reg [CHOL_W:0]   s5_b;
    reg [CHOL_W-1:0] s5_c;
    reg [U_W-1:0]    s5_u;
    reg [U_W-1:0]    s5_v;
    wire [U_W-1:0] s5_wide_b = {{U_W-CHOL_W-1{s5_b[CHOL_W]}}, s5_b};
    wire [U_W-1:0] s5_wide_c = {{U_W-CHOL_W{1'b0}}, s5_c};
    always @(posedge clk) begin
        if (start_q[4]) begin
            s5_a <= s1_a;
            s5_b <= s1_b;
            s5_c <= s1_c;
        end
        s5_u <= start_q[4] ? {s4_u0[STEP_W-1], s4_u0} : s5_u + (s5_wide_b << 1);
        s5_v <= start_q[4] ? {s4_v0[STEP_W-1], s4_v0} : s5_v + (s5_wide_c << 1);
    end

    // S6: both rows, and the odd multiples of a
    wire [CHOL_W+2:0] s5_wide_a = {3'b000, s5_a};
    reg [CHOL_W+2:0] s6_a1;  // UQ4.STEP_F
    reg [CHOL_W+2:0] s6_a3;
    reg [CHOL_W+2:0] s6_a5;
    reg [CHOL_W+2:0] s6_a7;
    reg [2*U_W-1:0]  s6_u;
    reg [2*U_W-1:0]  s6_v;
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
    wire [8*(CHOL_W+3)-1:0] s6_ia = {s6_a7, s6_a3 << 1, s6_a5, s6_a1 << 2, s6_a3, s6_a1 << 1, s6_a1,
                                     {CHOL_W+3{1'b0}}};

    // S7..S9 of v: half of p's last place goes in here, too
    localparam [BIAS_W-1:0] HALF = 1 << (E_DROP - 1);
    wire [BIAS_W-1:0] s8_opacity_wide = {{BIAS_W-OPACITY_W{1'b0}}, s8_opacity} << (2*DIST_F - OPACITY_F);
    wire [2*BIAS_W-1:0] s9_bias;
    genvar r;
    generate
        for (r = 0; r < 2; r = r + 1) begin : g_row
            reg [DIST_W-1:0]   s7_vm;    // UQ2.DIST_F
            reg [SQUARE_W-1:0] s8_v2;    // UQ4.(2*DIST_F)
            reg [BIAS_W-1:0]   s9_vbias;
            always @(posedge clk) begin
                s7_vm    <= distance(s6_v[r*U_W +: U_W]);
                s8_v2    <= square(s7_vm);
                s9_vbias <= {1'b0, s8_v2} + s8_opacity_wide + HALF;
            end
            assign s9_bias[r*BIAS_W +: BIAS_W] = s9_vbias;
        end
    endgenerate

    // S11 and S12, control: which beat, and what it is
    wire s11_valid = |start_q[14:11];
    wire [1:0] s11_beat = {start_q[14] || start_q[13], start_q[14] || start_q[12]};
    assign px_rd_en   = s11_valid && s11_swap && !s11_fresh;
    assign px_rd_addr = {s11_group, s11_beat};

    reg               s12_blend;
    reg               s12_swap;
    reg               s12_store;
    reg               s12_fresh;
    reg [1:0]         s12_beat;
    reg [GROUP_W-1:0] s12_group;
    always @(posedge clk) begin
        s12_blend <= s11_valid && !s11_swap && !rst;
        s12_swap  <= s11_valid && s11_swap && !rst;
        s12_store <= s11_store;
        s12_fresh <= s11_fresh;
        s12_beat  <= s11_beat;
        s12_group <= s11_group;
    end
    wire s12_go = s12_blend || s12_swap;

    genvar l;
    generate
        for (l = 0; l < LANES; l = l + 1) begin : g_lane
            // S7..S10
            reg [U_W-1:0]      s7_u;
            reg [DIST_W-1:0]   s8_um;     // UQ2.DIST_F
            reg [SQUARE_W-1:0] s9_u2;     // UQ4.(2*DIST_F)
            reg [P_W-1:0]      s10_p;     // UQ3.POWER_F
            reg                s10_over;  // and it would not fit
            wire [PSUM_W-1:0]  s9_sum = {{PSUM_W-SQUARE_W{1'b0}}, s9_u2}
                                      + {1'b0, s9_bias[(l>>3)*BIAS_W +: BIAS_W]};
            always @(posedge clk) begin
                s7_u     <= s6_u[(l>>3)*U_W +: U_W]
                          + {{U_W-CHOL_W-3{1'b0}}, s6_ia[(l%8)*(CHOL_W+3) +: CHOL_W+3]};
                s8_um    <= distance(s7_u);
                s9_u2    <= square(s8_um);
                s10_p    <= s9_sum[E_DROP +: P_W];
                s10_over <= |s9_sum[PSUM_W-1:E_DROP+P_W];
            end

            // S11, and alpha for S12
            wire [EXP_F:0]     s11_y;     // UQ1.EXP_F
            wire [EXP_F:0]     s11_rounded = s11_y + {{ALPHA_F+1{1'b0}}, 1'b1, {EXP_F-ALPHA_F-1{1'b0}}};
            wire [ALPHA_F:0]   s11_alpha   = s11_rounded[EXP_F:EXP_F-ALPHA_F];
            reg                s11_keep;
            reg                s12_keep;
            reg  [ALPHA_F-1:0] s12_alpha;  // UQ0.ALPHA_F
            gs_exp2_unit u_exp2 (
                .clk  (clk),
                .in_p (s10_p),
                .out_y(s11_y)
            );
            always @(posedge clk) begin
                s11_keep  <= !s10_over && s10_p <= CUT_P;
                s12_keep  <= s11_keep;
                s12_alpha <= s11_alpha > {1'b0, ALPHA_TOP} ? ALPHA_TOP : s11_alpha[ALPHA_F-1:0];
            end

            // The ring
            reg [T_W-1:0]   s12_t;     // UQ1.T_F
            reg [T_W-1:0]   s13_t;
            reg [T_W-1:0]   s14_t;
            reg [T_W-1:0]   s15_t;
            reg             s12_done;
            reg             s13_done;
            reg             s14_done;
            reg             s15_done;
            reg [W_W-1:0]   s13_w;     // UQ0.T_F
            reg [W_W-1:0]   s14_w;
            reg             s13_live;
            reg             s14_live;

            // S12 weigh
            reg  s12_dead;             // outside the picture
            wire s12_live = s12_keep && s12_blend && !s12_done;
            wire [PRODT_W-1:0] s12_wt = {{T_W{1'b0}}, s12_alpha} * {{ALPHA_F{1'b0}}, s12_t}
                                      + {{T_W{1'b0}}, 1'b1, {ALPHA_F-1{1'b0}}};
            wire [STATE_W-1:0] s12_loaded = s12_fresh ? {s12_dead, {3*ACC_W{1'b0}}, 1'b1, {T_F{1'b0}}}
                                                      : px_rd_data[l*STATE_W +: STATE_W];
            assign trace_blend[l] = s12_live;

            // S13 attenuate: T never reaches 0
            wire s13_all = s13_t[T_W-1:LOW_W] == {T_W-LOW_W{1'b0}} && s13_t[LOW_W-1:0] == s13_w[LOW_W-1:0];

            always @(posedge clk) begin
                s12_dead <= {1'b0, l[2:0]} >= s11_cols || {1'b0, s11_beat, l[3]} >= s11_rows;
                if (s12_go) begin
                    s13_w    <= s12_wt[ALPHA_F +: W_W] & {W_W{s12_live}};
                    s13_live <= s12_live;
                    s13_t    <= s12_swap ? s12_loaded[T_W-1:0] : s12_t;
                    s13_done <= s12_swap ? s12_loaded[STATE_W-1] : s12_done;

                    s14_w    <= {s13_w[W_W-1:LOW_W], s13_w[LOW_W-1:0] - {{LOW_W-1{1'b0}}, s13_all}};
                    s14_live <= s13_live;
                    s14_t    <= (s13_t - {1'b0, s13_w}) | {{T_W-1{1'b0}}, s13_all};
                    s14_done <= s13_done;

                    s15_t    <= s14_t;
                    s15_done <= s14_done || (s14_live && s14_t < T_END);

                    s12_t    <= s15_t;
                    s12_done <= s15_done;
                end
            end

            // S14 accumulate
            wire [3*ACC_W-1:0] s12_acc;  // {blue, green, red}, UQ3.ACC_F each
            for (r = 0; r < 3; r = r + 1) begin : g_colour
                reg  [ACC_W-1:0]  s12_sum;
                reg  [ACC_W-1:0]  s13_sum;
                reg  [ACC_W-1:0]  s14_sum;
                reg  [ACC_W-1:0]  s15_sum;
                wire [FULL_W-1:0] s14_full = {{FULL_W-W_W{1'b0}}, s14_w}
                                           * {{FULL_W-COLOUR_W{1'b0}}, s14_colours[r*COLOUR_W +: COLOUR_W]}
                                           + {s14_sum, 1'b1, {ACC_DROP-1{1'b0}}};
                always @(posedge clk) if (s12_go) begin
                    s13_sum <= s12_swap ? s12_loaded[T_W + r*ACC_W +: ACC_W] : s12_sum;
                    s14_sum <= s13_sum;
                    s15_sum <= s14_full[FULL_W-1:ACC_DROP];
                    s12_sum <= s15_sum;
                end
                assign s12_acc[r*ACC_W +: ACC_W] = s12_sum;
                wire unused_colour_ok = &{1'b0, s14_full[ACC_DROP-1:0]};
            end

            assign px_wr_data[l*STATE_W +: STATE_W] = {s12_done, s12_acc, s12_t};
            wire unused_lane_ok = &{1'b0, s9_sum[E_DROP-1:0], s11_rounded[EXP_F-ALPHA_F-1:0], s12_wt[PRODT_W-1],
                                    s12_wt[ALPHA_F-1:0]};
        end
    endgenerate

    assign trace_valid = s12_blend;

    // A swap passes: the held group goes out, the next one is held from then on.
    wire [LANES-1:0] s12_dones;
    generate
        for (l = 0; l < LANES; l = l + 1) begin : g_done
            assign s12_dones[l] = px_wr_data[l*STATE_W + STATE_W-1];
        end
    endgenerate
    reg [GROUP_W-1:0] held_q;
    reg               sat_valid_q;
    reg [GROUP_W-1:0] sat_group_q;
    reg               sat_stored_q;
    reg               sat_all_q;
    wire s12_last = s12_swap && s12_beat == 2'd3;
    always @(posedge clk) begin
        sat_valid_q <= s12_last && !rst;
        if (s12_swap) sat_all_q <= (sat_all_q || s12_beat == 2'd0) && &s12_dones;
        if (s12_last) begin
            sat_group_q  <= held_q;
            sat_stored_q <= s12_store;
            held_q       <= s12_group;
        end
        if (rst) held_q <= {GROUP_W{1'b0}};
    end
    assign px_wr_en   = s12_swap && s12_store;
    assign px_wr_addr = {held_q, s12_beat};
    assign sat_valid  = sat_valid_q;
    assign sat_group  = sat_group_q;
    assign sat_stored = sat_stored_q;
    assign sat_all    = sat_all_q;

endmodule

`default_nettype wire
