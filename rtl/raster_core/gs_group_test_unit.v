// gs_group_test_unit: which of a group's four subtiles does a Gaussian touch?
//
//   latency LATENCY = 9, one Gaussian a cycle, never stalls
//
//   S  set-up    gs_ellipse_setup at the group's first pixel              3 cycles for u, 2 for v
//   R  rows      8 x gs_row_reach, from v                                 4 cycles
//   F  span      gs_span_finder, over the rows                            2 cycles
//   T  test      the span's ends, and 4 x gs_intersection_test_unit       1 cycle
//
//   A subtile that begins outside the picture is not touched.

`default_nettype none
`include "gs_params.vh"

module gs_group_test_unit #(
    parameter UNITS      = `GS_UNITS,
    parameter SUBTILE    = `GS_SUBTILE,
    parameter MEAN_W     = `GS_MEAN_W,
    parameter CHOL_F     = `GS_CHOL_F,
    parameter CHOL_W     = `GS_CHOL_W,
    parameter OPACITY_W  = `GS_OPACITY_W,
    parameter OPACITY_F  = `GS_OPACITY_F,
    parameter POWER_F    = `GS_POWER_F,
    parameter CUT        = `GS_CUT,
    parameter ITU_F      = `GS_ITU_F,
    parameter EDGE_F     = `GS_EDGE_F,
    parameter ITU_MARGIN = `GS_ITU_MARGIN,
    parameter GEOMETRY_W = `GS_GEOMETRY_W,
    parameter PIXEL_W    = 13  // bits of a pixel coordinate
) (
    input  wire                  clk,
    input  wire                  rst,
    input  wire [PIXEL_W-1:0]    cfg_width,    // of the picture, pixels
    input  wire [PIXEL_W-1:0]    cfg_height,

    // in: a Gaussian, and the first pixel of the group
    input  wire                  in_valid,
    input  wire [PIXEL_W-1:0]    in_x,
    input  wire [PIXEL_W-1:0]    in_y,
    input  wire [GEOMETRY_W-1:0] in_geometry,

    // out: same order; bit s: subtile s of the group
    output wire                  out_valid,
    output wire [UNITS-1:0]      out_hits
);

    localparam LATENCY = 9;
    localparam SETUP   = 3;                            // latency of gs_ellipse_setup
    localparam ROWS    = 6;                            // cycles until gs_row_reach is done
    localparam SPAN    = 8;                            // and gs_span_finder
    localparam BOUND_W = 1 + OPACITY_W - OPACITY_F + POWER_F;  // of the limit as .POWER_F
    localparam FINE_W  = 2*ITU_F > POWER_F ? BOUND_W + 2*ITU_F - POWER_F : BOUND_W;
    localparam LIMIT_W = 2*ITU_F + 5;                  // SQ4.(2*ITU_F)
    localparam A_W     = EDGE_F + 4;                   // a without the bits below 8a
    localparam B_W     = EDGE_F + 2;                   // SQ1.EDGE_F
    localparam C_W     = EDGE_F + 4;                   // UQ1.(EDGE_F+3)
    localparam E_W     = EDGE_F + 9;                   // SQ8.EDGE_F: ends of the span
    localparam COLS_W  = 2 + $clog2(SUBTILE);          // bits of a pixel column in a group
    localparam [BOUND_W-1:0] BOUND = CUT + ITU_MARGIN;
    localparam [A_W-1:0]     SLACK = 13;               // codes of EDGE_F: docs/raster_core/group_test_unit.md

    generate
        if (UNITS != 4 || SUBTILE != 8) begin : g_rule
            UNITS_must_be_4_and_SUBTILE_8 bad ();
        end
        if (CUT + ITU_MARGIN >= (1 << (BOUND_W - 1)) || CUT + ITU_MARGIN >= (15 << POWER_F)) begin : g_cut_rule
            CUT_must_be_below_15_and_the_largest_OPACITY bad ();
        end
        if (CHOL_F < EDGE_F + 3 || EDGE_F < ITU_F + 1) begin : g_edge_rule
            EDGE_F_must_be_above_ITU_F_and_3_below_CHOL_F bad ();
        end
    endgenerate

    wire [MEAN_W-1:0]    in_mean_x  = in_geometry[0 +: MEAN_W];
    wire [MEAN_W-1:0]    in_mean_y  = in_geometry[MEAN_W +: MEAN_W];
    wire [CHOL_W-1:0]    in_a       = in_geometry[2*MEAN_W +: CHOL_W];
    wire [CHOL_W:0]      in_b       = in_geometry[2*MEAN_W+CHOL_W +: CHOL_W+1];
    wire [CHOL_W-1:0]    in_c       = in_geometry[2*MEAN_W+2*CHOL_W+1 +: CHOL_W];
    wire [OPACITY_W-1:0] in_opacity = in_geometry[GEOMETRY_W-1 -: OPACITY_W];

    // S set-up
    wire              s_valid;
    wire [EDGE_F+7:0] s_u0;
    wire [EDGE_F+8:0] s_v_high;
    wire [EDGE_F+5:0] s_v_low;
    wire              s_far;
    gs_ellipse_setup setup (
        .clk(clk), .rst(rst), .in_valid(in_valid),
        .in_a(in_a), .in_b(in_b), .in_c(in_c), .in_mean_x(in_mean_x), .in_mean_y(in_mean_y),
        .in_x0(in_x), .in_y0(in_y),
        .out_valid(s_valid), .out_u0(s_u0), .out_far(s_far), .out_v_high(s_v_high), .out_v_low(s_v_low)
    );

    // What is needed of a footprint behind the set-up, newest on top
    reg [(SPAN-1)*A_W-1:0]    a_line;
    reg [(ROWS-1)*B_W-1:0]    b_line;
    reg [(SPAN-SETUP)*(EDGE_F+8)-1:0] u_line;
    always @(posedge clk) begin
        a_line <= {in_a[CHOL_W-1 -: A_W], a_line[(SPAN-1)*A_W-1:A_W]};
        b_line <= {in_b[CHOL_W -: B_W], b_line[(ROWS-1)*B_W-1:B_W]};
        u_line <= {s_u0, u_line[(SPAN-SETUP)*(EDGE_F+8)-1:EDGE_F+8]};
    end

    // R rows: steps of c, their odd multiples in the cycle of the products
    reg [C_W-1:0]   s1_c;
    reg [C_W-1:0]   s2_c1;
    reg [C_W+1:0]   s2_c3;
    reg [C_W+2:0]   s2_c5;
    reg [C_W+2:0]   s2_c7;
    wire [C_W+2:0]  s1_c1 = {3'b000, s1_c};
    wire [C_W+1:0]  s1_c3 = s1_c1[C_W+1:0] + {1'b0, s1_c, 1'b0};
    always @(posedge clk) begin
        s1_c  <= in_c[CHOL_W-1 -: C_W];
        s2_c1 <= s1_c;
        s2_c3 <= s1_c3;
        s2_c5 <= s1_c1 + (s1_c1 << 2);
        s2_c7 <= (s1_c1 << 3) - s1_c1;
    end
    wire [C_W+2:0]     s2_c1_wide = {3'b000, s2_c1};
    wire [C_W+2:0]     s2_c3_wide = {1'b0, s2_c3};
    wire [8*(C_W+3)-1:0] s2_jc = {s2_c7, s2_c3_wide << 1, s2_c5, s2_c1_wide << 2,
                                  s2_c3_wide, s2_c1_wide << 1, s2_c1_wide, {C_W+3{1'b0}}};

    // The limit, floor, one cycle behind v
    reg [BOUND_W-1:0] s1_bound;
    reg [LIMIT_W-1:0] s2_limit;
    reg [LIMIT_W-1:0] s3_limit;
    wire [FINE_W-1:0] s1_fine;
    generate
        if (2*ITU_F > POWER_F) begin : g_fine
            assign s1_fine = {s1_bound, {2*ITU_F-POWER_F{1'b0}}};
        end
        else begin : g_fine
            assign s1_fine = s1_bound;
        end
    endgenerate
    localparam COARSE = POWER_F > 2*ITU_F ? POWER_F - 2*ITU_F : 0;
    always @(posedge clk) begin
        s1_bound <= BOUND - ({{BOUND_W-OPACITY_W{1'b0}}, in_opacity} << (POWER_F - OPACITY_F));
        s2_limit <= {{LIMIT_W-FINE_W+COARSE{s1_fine[FINE_W-1]}}, s1_fine[FINE_W-1:COARSE]};
        s3_limit <= s2_limit;
    end

    wire [SUBTILE-1:0]           r_empty;
    wire [SUBTILE*(ITU_F+2)-1:0] r_reach;
    genvar j;
    generate
        for (j = 0; j < SUBTILE; j = j + 1) begin : g_row
            gs_row_reach row (
                .clk(clk), .in_v_high(s_v_high), .in_v_low(s_v_low), .in_step(s2_jc[j*(C_W+3) +: C_W+3]),
                .in_limit(s3_limit),
                .out_empty(r_empty[j]), .out_reach(r_reach[j*(ITU_F+2) +: ITU_F+2])
            );
        end
    endgenerate

    // F span
    wire [EDGE_F+6:0] f_right;
    wire [EDGE_F+6:0] f_left;
    gs_span_finder finder (
        .clk(clk), .in_b(b_line[B_W-1:0]), .row_empty(r_empty), .row_reach(r_reach),
        .out_right(f_right), .out_left(f_left)
    );

    // T test: columns 8*s*a; seven pixels of a subtile reach further to the left.
    wire [A_W-1:0] a_last = a_line[A_W-1:0];
    reg  [A_W-1:0] f_a;       // 8a
    reg  [A_W+1:0] f_a3;      // 24a
    reg  [A_W:0]   f_margin;  // 7a + SLACK
    always @(posedge clk) begin
        f_a      <= a_last;
        f_a3     <= {2'b00, a_last} + {1'b0, a_last, 1'b0};
        f_margin <= {1'b0, a_last} - {4'b0000, a_last[A_W-1:3]} + {1'b0, SLACK};
    end
    wire [E_W-1:0] f_u    = {u_line[EDGE_F+7], u_line[EDGE_F+7:0]};
    wire [E_W-1:0] t_high = {{2{f_right[EDGE_F+6]}}, f_right} - f_u;
    wire [E_W-1:0] t_low  = {E_W{1'b0}} - {{2{f_left[EDGE_F+6]}}, f_left} - f_u - {{E_W-A_W-1{1'b0}}, f_margin};

    // Which subtiles begin inside the picture travels beside; none of what is far away is hit.
    wire             row_in = in_y < cfg_height;
    wire [UNITS-1:0] in_live;
    reg  [SETUP*UNITS-1:0]        s_live;  // newest on top
    reg  [(SPAN-SETUP)*UNITS-1:0] t_live;
    always @(posedge clk) begin
        s_live <= {in_live, s_live[SETUP*UNITS-1:UNITS]};
        t_live <= {s_live[UNITS-1:0] & {UNITS{!s_far}}, t_live[(SPAN-SETUP)*UNITS-1:UNITS]};
    end
    wire [4*(EDGE_F+6)-1:0] t_columns = {f_a3, {1'b0, f_a, 1'b0}, {2'b00, f_a}, {EDGE_F+6{1'b0}}};
    genvar s;
    generate
        for (s = 0; s < UNITS; s = s + 1) begin : g_unit
            wire [1:0] column = s;
            assign in_live[s] = row_in && {in_x[PIXEL_W-1:COLS_W], column, {COLS_W-2{1'b0}}} < cfg_width;
            gs_intersection_test_unit unit (
                .clk(clk), .in_column(t_columns[s*(EDGE_F+6) +: EDGE_F+6]), .in_low(t_low), .in_high(t_high),
                .in_live(t_live[s]), .out_hit(out_hits[s])
            );
        end
    endgenerate

    reg [LATENCY-SETUP-1:0] t_valid;
    always @(posedge clk) t_valid <= rst ? {LATENCY-SETUP{1'b0}} : {s_valid, t_valid[LATENCY-SETUP-1:1]};
    assign out_valid = t_valid[0];

    wire unused_ok = &{1'b0, in_geometry};

endmodule

`default_nettype wire
