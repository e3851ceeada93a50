// gs_subtile_compute_unit: blends Gaussians, one after the other, on the 64 pixels of one 8x8 subtile.
//
//   one operation (blend a Gaussian, or change the subtile) every BEATS = 4 cycles, 16 pixels a cycle, no backpressure
//   inside; op_ready depends on registers only; LATENCY = 16 from taking a swap to sat_valid
//
//   S1 to S10    p (gs_power_unit)
//   S11          alpha = min(0.99, 2^-p) and p <= CUT (gs_pixel_blender, one a lane); pixel buffer read
//   S12          alpha * T -> w; swap: state out, state in
//   S13          T - w
//   S14          acc + w * colour
//   S15          back to S12
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

    // px: pixel buffer; word {group, beat} holds lane l at bit l * (T_F + 3*ACC_W): {blue, green, red, T - 1}; outside the
    //     picture T is 1
    output wire                               px_rd_en,
    output wire [$clog2(GROUPS)+1:0]          px_rd_addr,
    input  wire [LANES*(T_F+3*ACC_W)-1:0]   px_rd_data,  // one cycle after its address
    output wire                               px_wr_en,
    output wire [$clog2(GROUPS)+1:0]          px_wr_addr,
    output wire [LANES*(T_F+3*ACC_W)-1:0]   px_wr_data,

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
    localparam SWAP_W    = 2 + GROUP_W + 8;
    localparam STATE_W   = T_F + 3*ACC_W;

    generate
        if (SUBTILE != 8 || LANES != 16) begin : g_rule
            SUBTILE_must_be_8_and_LANES_16 bad ();
        end
    endgenerate

    // start_q[n]: the first beat of an operation stands at stage n. Beat k follows k cycles behind; registers that an
    // operation fills once are passed on in time for the next operation.
    reg  [14:1] start_q;
    wire        take = op_valid && op_ready;
    assign op_ready = !(start_q[1] || start_q[2] || start_q[3]);
    always @(posedge clk) start_q <= rst ? 14'd0 : {start_q[13:1], take};

    // S1 to S10
    wire [LANES*POWER_W-1:0] s11_ps;
    gs_power_unit #(
        .LANES(LANES), .MEAN_F(MEAN_F), .MEAN_W(MEAN_W), .CHOL_F(CHOL_F), .CHOL_W(CHOL_W), .OPACITY_F(OPACITY_F),
        .OPACITY_W(OPACITY_W), .STEP_F(STEP_F), .DIST_F(DIST_F), .DIST_W(DIST_W), .POWER_F(POWER_F), .POWER_W(POWER_W)
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
        .out_p     (s11_ps)
    );

    // What the later stages need of an operation, a swap's or the colours: a register holds it for four cycles, then it
    // is in the next one.
    wire [COLOURS_W-1:0] op_change  = {{COLOURS_W-SWAP_W{1'b0}}, op_store, op_fresh, op_group, op_cols, op_rows};
    wire [COLOURS_W-1:0] op_colours = {op_blue, op_green, op_red};
    reg  [COLOURS_W:0]   s1_what;
    reg  [COLOURS_W:0]   s5_what;
    reg  [COLOURS_W:0]   s9_what;
    reg  [SWAP_W:0]      s11_what;
    always @(posedge clk) begin
        if (take)        s1_what  <= {op_swap, op_swap ? op_change : op_colours};
        if (start_q[4])  s5_what  <= s1_what;
        if (start_q[8])  s9_what  <= s5_what;
        if (start_q[10]) s11_what <= {s9_what[COLOURS_W], s9_what[SWAP_W-1:0]};
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

    reg               s12_blend;
    reg               s12_swap;
    reg               s12_load;
    reg               s12_store;
    reg [1:0]         s12_beat;
    reg [GROUP_W-1:0] s12_group;
    always @(posedge clk) begin
        s12_blend <= s11_valid && !s11_swap && !rst;
        s12_swap  <= s11_valid && s11_swap && !rst;
        s12_load  <= s11_swap && !s11_fresh;
        s12_store <= s11_store;
        s12_beat  <= s11_beat;
        s12_group <= s11_group;
    end

    // S14: the colours and three times them
    wire [3*(COLOUR_W+2)-1:0] s14_triples;
    reg  [COLOURS_W-1:0]      s13_colours;
    reg  [COLOURS_W-1:0]      s14_colours;
    always @(posedge clk) begin
        if (start_q[12]) s13_colours <= s9_what[COLOURS_W-1:0];
        if (start_q[13]) s14_colours <= s13_colours;
    end

    wire [LANES-1:0] s12_opens;
    genvar l;
    genvar k;
    generate
        for (k = 0; k < 3; k = k + 1) begin : g_triple
            wire [COLOUR_W+1:0] s13_colour = {2'b00, s13_colours[k*COLOUR_W +: COLOUR_W]};
            reg  [COLOUR_W+1:0] s14_triple;
            always @(posedge clk) if (start_q[13]) s14_triple <= s13_colour + (s13_colour << 1);
            assign s14_triples[k*(COLOUR_W+2) +: COLOUR_W+2] = s14_triple;
        end

        for (l = 0; l < LANES; l = l + 1) begin : g_lane
            reg s12_inside;  // fresh pixels: inside the picture
            always @(posedge clk) begin
                s12_inside <= s11_fresh && {1'b0, l[2:0]} < s11_cols && {1'b0, s11_beat, l[3]} < s11_rows;
            end
            gs_pixel_blender #(
                .COLOUR_F(COLOUR_F), .COLOUR_W(COLOUR_W), .POWER_F(POWER_F), .POWER_W(POWER_W), .CUT(CUT),
                .EXP_F(EXP_F), .ALPHA_F(ALPHA_F), .ALPHA_MAX(ALPHA_MAX), .T_F(T_F), .T_STOP(T_STOP), .ACC_F(ACC_F),
                .ACC_W(ACC_W)
            ) blender (
                .clk        (clk),
                .in_p       (s11_ps[l*POWER_W +: POWER_W]),
                .in_blend   (s12_blend),
                .in_swap    (s12_swap),
                .in_load    (s12_load),
                .in_open    (s12_inside),
                .in_state   (px_rd_data[l*STATE_W +: STATE_W]),
                .in_colours (s14_colours),
                .in_triples (s14_triples),
                .out_state  (px_wr_data[l*STATE_W +: STATE_W]),
                .out_open   (s12_opens[l]),
                .trace_blend(trace_blend[l])
            );
        end
    endgenerate

    assign trace_valid = s12_blend;

    // A swap passes: the held group goes out, the next one is held from then on.
    reg  [GROUP_W-1:0] held_q;
    wire s12_last = s12_swap && s12_beat == 2'd3;
    always @(posedge clk) begin
        sat_valid <= s12_last && !rst;
        if (s12_swap) sat_all <= (sat_all || s12_beat == 2'd0) && !(|s12_opens);
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
