// gs_exp2_unit: alpha = min(0.99, 2^-p) by a table of straight lines, for the opacity of a Gaussian at one pixel.
//
//   latency 1, one result per cycle, free running: whoever uses it keeps the valid bit
//
//   S1 line, shift   base - (slope * offset >> OFFSET_W), >> whole -> UQ0.ALPHA_F     floor, half_up twice; clamped
//
//   All roundings are one addend of the line's sum: halves of the places that the shifts drop, and ones below the line's
//   last place, with which the floor of the drop is the floor of the sum.

`default_nettype none
`include "gs_params.vh"

module gs_exp2_unit #(
    parameter POWER_F   = `GS_POWER_F,       // fraction bits of p
    parameter POWER_W   = `GS_POWER_W,       // bits of p, and one that is not needed here
    parameter EXP_F     = `GS_EXP_F,         // fraction bits of 2^-p
    parameter ALPHA_F   = `GS_ALPHA_F,       // fraction bits of the result
    parameter ALPHA_MAX = `GS_ALPHA_MAX,
    parameter CLAMP     = `GS_EXP_CLAMP,     // below it the result is ALPHA_MAX
    parameter SEGMENTS  = `GS_EXP_SEGMENTS,  // lines over p's fraction, a power of two
    parameter BASE_W    = `GS_EXP_BASE_W,
    parameter SLOPE_W   = `GS_EXP_SLOPE_W,
    parameter [SEGMENTS*BASE_W-1:0]  BASE  = `GS_EXP_BASE,  // value where a segment starts, UQ1.EXP_F
    parameter [SEGMENTS*SLOPE_W-1:0] SLOPE = `GS_EXP_SLOPE  // what it falls to its end, UQ0.EXP_F
) (
    input  wire               clk,

    // in
    input  wire [POWER_W-2:0] in_p,      // UQ.POWER_F

    // out
    output wire [ALPHA_F-1:0] out_alpha  // UQ0.ALPHA_F
);

    localparam SEGMENT_W = $clog2(SEGMENTS);
    localparam OFFSET_W  = POWER_F - SEGMENT_W;
    localparam WHOLE_W   = POWER_W - 1 - POWER_F;
    localparam DROP      = EXP_F - ALPHA_F;
    localparam SUM_W     = EXP_F + 1 + OFFSET_W;
    localparam [EXP_F:0]     ONE       = 1;
    localparam [POWER_W-2:0] CLAMP_P   = CLAMP[POWER_W-2:0];
    localparam [ALPHA_F-1:0] ALPHA_TOP = ALPHA_MAX[ALPHA_F-1:0];

    generate
        if (SEGMENT_W < 1 || OFFSET_W < 1 || SEGMENTS != (1 << SEGMENT_W)) begin : g_segments_rule
            SEGMENTS_must_be_a_power_of_two_below_that_of_POWER_F bad ();
        end
        if ((1 << WHOLE_W) > EXP_F + 1) begin : g_whole_rule
            EXP_F_must_be_the_largest_shift_at_least bad ();
        end
        if (DROP < 1) begin : g_narrow_rule
            EXP_F_must_be_above_ALPHA_F bad ();
        end
    endgenerate

    wire [SEGMENT_W-1:0] in_segment = in_p[POWER_F-1:OFFSET_W];
    wire [OFFSET_W-1:0]  in_offset  = in_p[OFFSET_W-1:0];
    wire [WHOLE_W-1:0]   in_whole   = in_p[POWER_W-2:POWER_F];
    wire [BASE_W-1:0]    in_base    = BASE[in_segment*BASE_W +: BASE_W];
    wire [SLOPE_W-1:0]   in_slope   = SLOPE[in_segment*SLOPE_W +: SLOPE_W];

    // Halves: of the last place that the shift by whole leaves, and of the last place of alpha
    wire [EXP_F:0]       in_place   = ONE << in_whole;
    wire [EXP_F:0]       in_halves  = (in_place >> 1) | (in_place << (DROP - 1));

    wire [SUM_W-1:0]     in_sum     = {{EXP_F+1-BASE_W{1'b0}}, in_base, {OFFSET_W{1'b1}}}
                                    + {in_halves, {OFFSET_W{1'b0}}}
                                    - {{SUM_W-SLOPE_W{1'b0}}, in_slope} * {{SUM_W-OFFSET_W{1'b0}}, in_offset};
    wire [ALPHA_F:0]     in_shifted = in_sum[SUM_W-1:OFFSET_W+DROP] >> in_whole;

    reg  [ALPHA_F-1:0]   s1_alpha;
    always @(posedge clk) s1_alpha <= in_p < CLAMP_P ? ALPHA_TOP : in_shifted[ALPHA_F-1:0];
    assign out_alpha = s1_alpha;

    wire unused_ok = &{1'b0, in_sum[OFFSET_W+DROP-1:0], in_shifted[ALPHA_F]};

endmodule

`default_nettype wire
