// gs_subtile_compute_unit: blends Gaussians, one after the other, on the 64 pixels of one 8x8 subtile.
//
//   one operation (blend a Gaussian, or change the subtile) every BEATS = 4 cycles, 16 pixels a cycle, no backpressure
//   inside; op_ready depends on registers only; LATENCY = 16 from taking a swap to sat_valid
//
//   S1 to S10       p (gs_power_unit)
//   S11             2^-p (gs_exp2_unit) and p <= CUT; pixel buffer read
//   S12 weigh       alpha * T -> w; swap: state out, state in      half_up
//   S13 attenuate   w = min(w, T - 1), T - w                       exact
//   S14 accumulate  acc + w * colour; done = T < T_STOP            half_up, cannot overflow
//   S15             back to S12
//
//   S12 to S15 are a ring that holds the subtile, four pixels a lane, and moves only when a beat is at S12: operations
//   meet in it back to back, whatever the gaps between them were. So the next operation does a beat's last stages.

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
    parameter POWER_W   = `GS_POWER_W,
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
    input  wire [COLOUR_W-1:0]            op_red,      // UQ3.COLOUR_F
    input  wire [COLOUR_W-1:0]            op_green,    // UQ3.COLOUR_F
    input  wire [COLOUR_W-1:0]            op_blue,     // UQ3.COLOUR_F

    // px: pixel buffer; word {group, beat} holds lane l at bit l * (T_F + 2 + 3*ACC_W): {done, blue, green, red, T}
    output wire                               px_rd_en,
    output wire [$clog2(GROUPS)+1:0]          px_rd_addr,
    input  wire [LANES*(T_F+2+3*ACC_W)-1:0]   px_rd_data,  // one cycle after its address
    output wire                               px_wr_en,
    output wire [$clog2(GROUPS)+1:0]          px_wr_addr,
    output wire [LANES*(T_F+2+3*ACC_W)-1:0]   px_wr_data,

    // sat: what a swap put out; all means nothing before the first subtile is in
    output reg                            sat_valid,
    output reg  [$clog2(GROUPS)-1:0]      sat_group,   // the group that was held
    output reg                            sat_stored,
    output reg                            sat_all,     // all 64 of its pixels are done

    // trace: which lanes blended in this cycle
    output wire                           trace_valid,
    output wire [LANES-1:0]               trace_blend
);

    localparam GROUP_W   = $clog2(GROUPS);
    localparam COLOURS_W = 3*COLOUR_W;
    localparam SWAP_W    = 3 + GROUP_W + 8;
    localparam T_W       = T_F + 1;
    localparam W_W       = T_F;                        // a weight is below 1
    localparam STATE_W   = T_W + 3*ACC_W + 1;
    localparam PROD_W    = ALPHA_F + T_W;
    localparam ACC_DROP  = T_F + COLOUR_F - ACC_F;
    localparam FULL_W    = ACC_W + ACC_DROP;
    // half_up(alpha * T) can be T only where T is no more than 1/2 / (1 - ALPHA_MAX), a number of so many bits
    localparam LOW_W     = $clog2((1 << (ALPHA_F - 1)) / ((1 << ALPHA_F) - ALPHA_MAX) + 1);
    localparam [POWER_W-1:0] CUT_P     = CUT[POWER_W-1:0];
    localparam [ALPHA_F-1:0] ALPHA_TOP = ALPHA_MAX[ALPHA_F-1:0];
    localparam [EXP_F:0]     ALPHA_HALF = 1 << (EXP_F - ALPHA_F - 1);
    localparam [T_W-1:0]     T_END     = T_STOP[T_W-1:0];

    generate
        if (SUBTILE != 8 || LANES != 16) begin : g_rule
            SUBTILE_must_be_8_and_LANES_16 bad ();
        end
        if (EXP_F <= ALPHA_F || ACC_DROP < 1) begin : g_narrow_rule
            EXP_F_must_be_above_ALPHA_F_and_ACC_F_below_T_F_and_COLOUR_F_together bad ();
        end
        if (LOW_W >= T_F) begin : g_low_rule
            T_F_must_hold_what_ALPHA_MAX_leaves bad ();
        end
    endgenerate

    // start_q[n]: the first beat of an operation stands at stage n. Beat k follows k cycles behind; registers that an
    // operation fills once are passed on in time for the next operation.
    reg  [14:1] start_q;
    wire        take = op_valid && op_ready;
    assign op_ready = !(start_q[1] || start_q[2] || start_q[3]);
    always @(posedge clk) start_q <= rst ? 14'd0 : {start_q[13:1], take};

    // S1 to S10
    wire [LANES*POWER_W-1:0] s10_ps;
    gs_power_unit #(
        .LANES(LANES), .MEAN_F(MEAN_F), .MEAN_W(MEAN_W), .CHOL_F(CHOL_F), .CHOL_W(CHOL_W), .OPACITY_F(OPACITY_F),
        .OPACITY_W(OPACITY_W), .STEP_F(STEP_F), .STEP_W(STEP_W), .DIST_F(DIST_F), .DIST_W(DIST_W), .POWER_F(POWER_F),
        .POWER_W(POWER_W)
    ) u_power (
        .clk       (clk),
        .rst       (rst),
        .in_valid  (take && !op_swap),
        .in_x0     (op_x0),
        .in_y0     (op_y0),
        .in_mean_x (op_mean_x),
        .in_mean_y (op_mean_y),
        .in_a      (op_a),
        .in_b      (op_b),
        .in_c      (op_c),
        .in_opacity(op_opacity),
        .out_p     (s10_ps)
    );

    reg               s12_blend;
    reg               s12_swap;
    reg               s12_store;
    reg               s12_fresh;
    reg [1:0]         s12_beat;
    reg [GROUP_W-1:0] s12_group;

    // What the later stages need of an operation: every register holds it for four cycles, then it is in the next one.
    wire [SWAP_W-1:0]    op_what = {op_swap, op_store, op_fresh, op_group, op_cols, op_rows};
    reg  [SWAP_W-1:0]    s1_what;
    reg  [SWAP_W-1:0]    s5_what;
    reg  [SWAP_W-1:0]    s8_what;
    reg  [SWAP_W-1:0]    s11_what;
    reg  [COLOURS_W-1:0] s1_colours;
    reg  [COLOURS_W-1:0] s5_colours;
    reg  [COLOURS_W-1:0] s8_colours;
    reg  [COLOURS_W-1:0] s11_colours;
    reg  [COLOURS_W-1:0] s14_colours;
    always @(posedge clk) begin
        if (take)        s1_what     <= op_what;
        if (start_q[4])  s5_what     <= s1_what;
        if (start_q[7])  s8_what     <= s5_what;
        if (start_q[10]) s11_what    <= s8_what;
        if (take)        s1_colours  <= {op_blue, op_green, op_red};
        if (start_q[4])  s5_colours  <= s1_colours;
        if (start_q[7])  s8_colours  <= s5_colours;
        if (start_q[10]) s11_colours <= s8_colours;
        if (start_q[13]) s14_colours <= s11_colours & {COLOURS_W{!s12_swap}};  // a swap's may be X
    end

    // S11, control: which beat, and what it is
    wire               s11_swap;
    wire               s11_store;
    wire               s11_fresh;
    wire [GROUP_W-1:0] s11_group;
    wire [3:0]         s11_cols;
    wire [3:0]         s11_rows;
    assign {s11_swap, s11_store, s11_fresh, s11_group, s11_cols, s11_rows} = s11_what;
    wire s11_valid = |start_q[14:11];
    wire [1:0] s11_beat = {start_q[14] || start_q[13], start_q[14] || start_q[12]};
    assign px_rd_en   = s11_valid && s11_swap && !s11_fresh;
    assign px_rd_addr = {s11_group, s11_beat};

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
    genvar k;
    generate
        for (l = 0; l < LANES; l = l + 1) begin : g_lane
            // S11, and alpha for S12
            wire [POWER_W-1:0] s10_p = s10_ps[l*POWER_W +: POWER_W];
            wire [EXP_F:0]     s11_y;     // UQ1.EXP_F
            wire [EXP_F:0]     s11_rounded = s11_y + ALPHA_HALF;
            wire [ALPHA_F:0]   s11_alpha   = s11_rounded[EXP_F:EXP_F-ALPHA_F];
            reg                s11_keep;
            reg                s12_keep;
            reg  [ALPHA_F-1:0] s12_alpha;  // UQ0.ALPHA_F
            gs_exp2_unit #(.POWER_F(POWER_F), .POWER_W(POWER_W), .EXP_F(EXP_F)) u_exp2 (
                .clk  (clk),
                .in_p (s10_p[POWER_W-2:0]),
                .out_y(s11_y)
            );
            always @(posedge clk) begin
                s11_keep  <= s10_p <= CUT_P;
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
            wire [PROD_W-1:0] s12_wt = {{T_W{1'b0}}, s12_alpha} * {{ALPHA_F{1'b0}}, s12_t}
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
            for (k = 0; k < 3; k = k + 1) begin : g_colour
                reg  [ACC_W-1:0]  s12_sum;
                reg  [ACC_W-1:0]  s13_sum;
                reg  [ACC_W-1:0]  s14_sum;
                reg  [ACC_W-1:0]  s15_sum;
                wire [FULL_W-1:0] s14_full = {{FULL_W-W_W{1'b0}}, s14_w}
                                           * {{FULL_W-COLOUR_W{1'b0}}, s14_colours[k*COLOUR_W +: COLOUR_W]}
                                           + {s14_sum, 1'b1, {ACC_DROP-1{1'b0}}};
                always @(posedge clk) if (s12_go) begin
                    s13_sum <= s12_swap ? s12_loaded[T_W + k*ACC_W +: ACC_W] : s12_sum;
                    s14_sum <= s13_sum;
                    s15_sum <= s14_full[FULL_W-1:ACC_DROP];
                    s12_sum <= s15_sum;
                end
                assign s12_acc[k*ACC_W +: ACC_W] = s12_sum;
                wire unused_colour_ok = &{1'b0, s14_full[ACC_DROP-1:0]};
            end

            assign px_wr_data[l*STATE_W +: STATE_W] = {s12_done, s12_acc, s12_t};
            wire unused_lane_ok = &{1'b0, s11_rounded[EXP_F-ALPHA_F-1:0], s12_wt[PROD_W-1], s12_wt[ALPHA_F-1:0]};
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
    reg  [GROUP_W-1:0] held_q;
    wire s12_last = s12_swap && s12_beat == 2'd3;
    always @(posedge clk) begin
        sat_valid <= s12_last && !rst;
        if (s12_swap) sat_all <= (sat_all || s12_beat == 2'd0) && &s12_dones;
        if (s12_last) begin
            sat_group  <= held_q;
            sat_stored <= s12_store;
            held_q     <= s12_group;
        end
        if (rst) held_q <= {GROUP_W{1'b0}};
    end
    assign px_wr_en   = s12_swap && s12_store;
    assign px_wr_addr = {held_q, s12_beat};

endmodule

`default_nettype wire
