// gs_exp2_unit: 2^-p by a table of straight lines, for the opacity of a Gaussian at one pixel.
//
//   latency 1, one result per cycle, free running: whoever uses it keeps the valid bit; out_y leaves through logic
//
//   S1 drop    slope * offset >> OFFSET_W                      floor
//   S2 shift   (base - drop) >> whole                          half_up, cannot overflow (combinational)

`default_nettype none
`include "gs_params.vh"

module gs_exp2_unit #(
    parameter POWER_F  = `GS_POWER_F,       // fraction bits of p
    parameter POWER_W  = `GS_POWER_W,       // bits of p, and one that is not needed here
    parameter EXP_F    = `GS_EXP_F,         // fraction bits of the result
    parameter SEGMENTS = `GS_EXP_SEGMENTS,  // lines over p's fraction, a power of two
    parameter BASE_W   = `GS_EXP_BASE_W,
    parameter SLOPE_W  = `GS_EXP_SLOPE_W,
    parameter [SEGMENTS*BASE_W-1:0]  BASE  = `GS_EXP_BASE,  // value where a segment starts, UQ1.EXP_F
    parameter [SEGMENTS*SLOPE_W-1:0] SLOPE = `GS_EXP_SLOPE  // what it falls to its end, UQ0.EXP_F
) (
    input  wire               clk,

    // in
    input  wire [POWER_W-2:0] in_p,  // UQ.POWER_F

    // out
    output wire [EXP_F:0]     out_y  // UQ1.EXP_F
);

    localparam SEGMENT_W = $clog2(SEGMENTS);
    localparam OFFSET_W  = POWER_F - SEGMENT_W;
    localparam PROD_W    = SLOPE_W + OFFSET_W;
    localparam WHOLE_W   = POWER_W - 1 - POWER_F;
    localparam [EXP_F+1:0] ONE = 1;

    generate
        if (SEGMENT_W < 1 || OFFSET_W < 1 || SEGMENTS != (1 << SEGMENT_W)) begin : g_segments_rule
            SEGMENTS_must_be_a_power_of_two_below_that_of_POWER_F bad ();
        end
        if ((1 << WHOLE_W) > EXP_F + 1) begin : g_whole_rule
            EXP_F_must_be_the_largest_shift_at_least bad ();
        end
    endgenerate

    // S1 drop
    wire [SEGMENT_W-1:0] in_segment = in_p[POWER_F-1:OFFSET_W];
    wire [OFFSET_W-1:0]  in_offset  = in_p[OFFSET_W-1:0];
    wire [SLOPE_W-1:0]   in_slope   = SLOPE[in_segment*SLOPE_W +: SLOPE_W];
    wire [PROD_W-1:0]    in_prod    = {{OFFSET_W{1'b0}}, in_slope} * {{SLOPE_W{1'b0}}, in_offset};
    reg  [SEGMENT_W-1:0] s1_segment;
    reg  [SLOPE_W-1:0]   s1_drop;    // UQ0.EXP_F
    reg  [WHOLE_W-1:0]   s1_whole;
    always @(posedge clk) begin
        s1_segment <= in_segment;
        s1_drop    <= in_prod[PROD_W-1:OFFSET_W];
        s1_whole   <= in_p[POWER_W-2:POWER_F];
    end

    // S2 shift: half of the last place is added in front of the shift, so one sum does
    wire [BASE_W-1:0] s1_base = BASE[s1_segment*BASE_W +: BASE_W];
    wire [EXP_F+1:0]  s1_half = ONE << s1_whole;
    wire [EXP_F:0]    s2_sum  = {{EXP_F+1-BASE_W{1'b0}}, s1_base} - {{EXP_F+1-SLOPE_W{1'b0}}, s1_drop}
                              + s1_half[EXP_F+1:1];
    assign out_y = s2_sum >> s1_whole;

    wire unused_ok = &{1'b0, in_prod[OFFSET_W-1:0], s1_half[0]};

endmodule

`default_nettype wire
