// gs_pixel_blender: a lane of gs_subtile_compute_unit: blends Gaussians on four pixels, one after the other.
//
//   one beat a cycle, gaps of any length; four beats later the same pixel is at S12 again
//
//   S11              alpha = min(0.99, 2^-p) (gs_exp2_unit) and p <= CUT
//   S12 weigh        alpha * T -> w, where T >= T_STOP; swap: state out, state in     half_up
//   S13 attenuate    w = min(w, T - 1), T - w                                         exact
//   S14 accumulate   acc + w * colour                                                 half_up, cannot overflow
//   S15              back to S12; 3 * (T - 1)                                         exact
//
//   S12 to S15 are a ring that moves only when a beat is at S12. T is from 1 to 1.0, and t = T - 1 is what is kept.
//   Products go by digits of two bits: 0 to 3 times the other factor.
//   Flip-flops of a cell library invert: where a value moves on as it is, a register holds its complement (_n).

`default_nettype none
`include "gs_params.vh"

module gs_pixel_blender #(
    parameter COLOUR_F  = `GS_COLOUR_F,
    parameter COLOUR_W  = `GS_COLOUR_W,
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
    input  wire                      clk,

    // in: p a cycle ahead of the beat; blend or swap: a beat is at S12; colours of the beat at S14 and three times them
    input  wire [POWER_W-1:0]        in_p,        // UQ.POWER_F
    input  wire                      in_blend,
    input  wire                      in_swap,     // the pixel changes: to in_state,
    input  wire                      in_load,
    input  wire                      in_open,     // without load, to a fresh one: T = 1.0, or T = 1 when not open
    input  wire [T_F+3*ACC_W-1:0]    in_state,    // {blue, green, red, t}
    input  wire [3*COLOUR_W-1:0]     in_colours,  // {blue, green, red}, UQ3.COLOUR_F
    input  wire [3*(COLOUR_W+2)-1:0] in_triples,  // UQ5.COLOUR_F

    // out: the pixel at S12
    output wire [T_F+3*ACC_W-1:0]    out_state,
    output wire                      out_open,    // T >= T_STOP

    // trace: it blends
    output wire                      trace_blend
);

    localparam ALPHA_D  = (ALPHA_F + 1) / 2;  // digits of alpha
    localparam WEIGHT_D = (T_F + 1) / 2;      // of a weight, which is below 1
    localparam PROD_W   = ALPHA_F + T_F;
    localparam ACC_DROP = T_F + COLOUR_F - ACC_F;
    localparam FULL_W   = ACC_W + ACC_DROP;
    // half_up(alpha * T) can be T only where T is no more than 1/2 / (1 - ALPHA_MAX), a number of so many bits
    localparam LOW_W    = $clog2((1 << (ALPHA_F - 1)) / ((1 << ALPHA_F) - ALPHA_MAX) + 1);
    localparam T_END    = T_STOP - 1;
    localparam [POWER_W-1:0] CUT_P = CUT[POWER_W-1:0];
    localparam [PROD_W-1:0]  HALF  = 1 << (ALPHA_F - 1);

    generate
        if (ACC_DROP < 1) begin : g_narrow_rule
            ACC_F_must_be_below_T_F_and_COLOUR_F_together bad ();
        end
        if (LOW_W >= T_F) begin : g_low_rule
            T_F_must_hold_what_ALPHA_MAX_leaves bad ();
        end
    endgenerate

    // digit * t, digit * x: of 0 to 3, where three times is there
    function [T_F+1:0] times_t;
        input [1:0]     digit;
        input [T_F-1:0] t;
        input [T_F+1:0] t3;
        times_t = ({T_F+2{digit == 2'd1}} & {2'b00, t}) | ({T_F+2{digit == 2'd2}} & {1'b0, t, 1'b0})
                | ({T_F+2{digit == 2'd3}} & t3);
    endfunction

    function [COLOUR_W+1:0] times_x;
        input [1:0]          digit;
        input [COLOUR_W-1:0] x;
        input [COLOUR_W+1:0] x3;
        times_x = ({COLOUR_W+2{digit == 2'd1}} & {2'b00, x}) | ({COLOUR_W+2{digit == 2'd2}} & {1'b0, x, 1'b0})
                | ({COLOUR_W+2{digit == 2'd3}} & x3);
    endfunction

    // alpha * (t + 1) + 1/2
    function [PROD_W-1:0] weigh;
        input [ALPHA_F-1:0]   alpha;
        input [2*ALPHA_D-1:0] digits;  // of alpha
        input [T_F-1:0]       t;
        input [T_F+1:0]       t3;
        integer i;
        begin
            weigh = HALF + {{T_F{1'b0}}, alpha};
            for (i = 0; i < 2*ALPHA_D; i = i + 2) begin
                weigh = weigh + ({{ALPHA_F-2{1'b0}}, times_t(digits[i +: 2], t, t3)} << i);
            end
        end
    endfunction

    // acc + w * x + 1/2
    function [FULL_W-1:0] accumulate;
        input [ACC_W-1:0]      acc;
        input [2*WEIGHT_D-1:0] w;
        input [COLOUR_W-1:0]   x;
        input [COLOUR_W+1:0]   x3;
        integer i;
        begin
            accumulate = {acc, 1'b1, {ACC_DROP-1{1'b0}}};
            for (i = 0; i < 2*WEIGHT_D; i = i + 2) begin
                accumulate = accumulate + ({{FULL_W-COLOUR_W-2{1'b0}}, times_x(w[i +: 2], x, x3)} << i);
            end
        end
    endfunction

    // S11
    wire [ALPHA_F-1:0] s12_alpha;  // UQ0.ALPHA_F
    reg                s12_keep;
    gs_exp2_unit #(
        .POWER_F(POWER_F), .POWER_W(POWER_W), .EXP_F(EXP_F), .ALPHA_F(ALPHA_F), .ALPHA_MAX(ALPHA_MAX)
    ) u_exp2 (
        .clk      (clk),
        .in_p     (in_p[POWER_W-2:0]),
        .out_alpha(s12_alpha)
    );
    always @(posedge clk) s12_keep <= in_p <= CUT_P;

    // The ring
    wire           go = in_blend || in_swap;
    reg  [T_F-1:0] s12_t_n;   // T - 1, UQ0.T_F
    reg  [T_F-1:0] s13_t_n;
    reg  [T_F-1:0] s14_t_n;
    reg  [T_F-1:0] s15_t;
    reg  [T_F+1:0] s12_t3;    // 3 * (T - 1)
    reg            s12_open;  // T >= T_STOP
    wire [T_F+1:0] s15_wide = {2'b00, s15_t};

    // S12 weigh
    reg  [T_F-1:0]       s13_w;      // UQ0.T_F
    reg  [ALPHA_F-1:0]   s13_below;  // bits below it
    wire [T_F-1:0]       s12_t      = ~s12_t_n;
    wire                 s12_live   = s12_keep && in_blend && s12_open;
    wire [ALPHA_F-1:0]   s12_seen   = s12_alpha & {ALPHA_F{s12_live}};
    wire [2*ALPHA_D-1:0] s12_digits = {{2*ALPHA_D-ALPHA_F{1'b0}}, s12_seen};
    wire [T_F-1:0]       s12_t_in   = (in_state[T_F-1:0] & {T_F{in_load}}) | {T_F{in_open}};
    assign trace_blend = s12_live;

    // S13 attenuate. T never reaches 0: where w would be T, it is t.
    reg  [T_F-1:0] s14_w;
    wire [T_F-1:0] s13_t   = ~s13_t_n;
    wire           s13_all = s13_t[T_F-1:LOW_W] == {T_F-LOW_W{1'b0}} && s13_w[LOW_W-1:0] > s13_t[LOW_W-1:0];
    wire [T_F-1:0] s13_weight = {s13_w[T_F-1:LOW_W], s13_all ? s13_t[LOW_W-1:0] : s13_w[LOW_W-1:0]};

    always @(posedge clk) if (go) begin
        {s13_w, s13_below} <= weigh(s12_seen, s12_digits, s12_t, s12_t3);
        s13_t_n  <= ~(in_swap ? s12_t_in : s12_t);
        s14_w    <= s13_weight;
        s14_t_n  <= ~(s13_t - s13_weight);
        s15_t    <= ~s14_t_n;
        s12_t_n  <= ~s15_t;
        s12_t3   <= s15_wide + (s15_wide << 1);
        s12_open <= s15_t >= T_END[T_F-1:0];
    end

    // S14 accumulate
    genvar k;
    generate
        for (k = 0; k < 3; k = k + 1) begin : g_colour
            reg  [ACC_W-1:0]  s12_sum_n;
            reg  [ACC_W-1:0]  s13_sum_n;
            reg  [ACC_W-1:0]  s14_sum;
            reg  [ACC_W-1:0]  s15_sum;
            reg  [ACC_DROP-1:0] s15_below;
            wire [ACC_W-1:0]  s12_sum    = ~s12_sum_n;
            wire [ACC_W-1:0]  s12_before = in_state[T_F + k*ACC_W +: ACC_W] & {ACC_W{in_load}};
            always @(posedge clk) if (go) begin
                s13_sum_n <= ~(in_swap ? s12_before : s12_sum);
                s14_sum   <= ~s13_sum_n;
                {s15_sum, s15_below} <= accumulate(s14_sum, {{2*WEIGHT_D-T_F{1'b0}}, s14_w},
                                                   in_colours[k*COLOUR_W +: COLOUR_W],
                                                   in_triples[k*(COLOUR_W+2) +: COLOUR_W+2]);
                s12_sum_n <= ~s15_sum;
            end
            wire unused_colour_ok = &{1'b0, s15_below};
        end
    endgenerate

    assign out_state = {g_colour[2].s12_sum, g_colour[1].s12_sum, g_colour[0].s12_sum, s12_t};
    assign out_open  = s12_open;
    wire unused_ok = &{1'b0, s13_below};

endmodule

`default_nettype wire
