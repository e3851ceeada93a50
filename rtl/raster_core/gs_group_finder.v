// gs_group_finder: the groups of a tile (32 x 8 pixels each) that a footprint may hit; never misses one.
//
//   latency LATENCY = 10; at most one record in any three cycles, which in_valid keeps to; never stalls
//
//   S1 offset    dx, dy = centre of the first group - mean                           exact
//   S2 multiply  a*dx, b*dy, c*dy in turn, the offset's two halves side by side      exact
//   S3 centre    halves joined; u = a*dx + b*dy, v = c*dy -> SQ8.MID_F               floor, sat
//   S4 step      to the centres of all groups: rows 0-2, 3-5, 6-7 in three cycles    exact
//   S5 distance  |u|, |v| less half of the group -> UQ2.NEAR_F                       floor, sat
//   S6 square    limit - dv^2, du^2                                                  exact
//   S7 compare   du^2 <= limit - dv^2
//
//   SLACK covers all that floor() takes away on the way: docs/raster_core/group_finder.md

`default_nettype none
`include "gs_params.vh"

module gs_group_finder #(
    parameter TILE       = `GS_TILE,
    parameter GROUPS     = `GS_GROUPS,
    parameter SUBTILE    = `GS_SUBTILE,
    parameter MEAN_F     = `GS_MEAN_F,
    parameter MEAN_W     = `GS_MEAN_W,
    parameter CHOL_F     = `GS_CHOL_F,
    parameter CHOL_W     = `GS_CHOL_W,
    parameter OPACITY_F  = `GS_OPACITY_F,
    parameter OPACITY_W  = `GS_OPACITY_W,
    parameter POWER_F    = `GS_POWER_F,
    parameter CUT        = `GS_CUT,
    parameter ITU_MARGIN = `GS_ITU_MARGIN,
    parameter GEOMETRY_W = `GS_GEOMETRY_W,
    parameter PIXEL_W    = 13  // bits of a pixel coordinate
) (
    input  wire                  clk,
    input  wire                  rst,
    input  wire [PIXEL_W-1:0]    cfg_width,    // of the picture, pixels
    input  wire [PIXEL_W-1:0]    cfg_height,

    // in: a record's geometry, and the tile's origin
    input  wire                  in_valid,
    input  wire [GEOMETRY_W-1:0] in_geometry,
    input  wire [PIXEL_W-1:0]    in_x0,
    input  wire [PIXEL_W-1:0]    in_y0,

    // out: same order
    output wire                  out_valid,
    output wire [GROUPS-1:0]     out_mask      // bit g: row g >> 1, left or right half g & 1
);

    localparam LATENCY = 10;
    localparam ROWS    = 3;                     // of groups, stepped to in one cycle
    localparam TILE_W  = $clog2(TILE);
    localparam MID_F   = 8;
    localparam MID_W   = MID_F + 9;             // SQ8.MID_F
    localparam STEP_W  = MID_W + 1;             // SQ9.MID_F: a tile away from the first centre
    localparam NEAR_F  = 4;
    localparam NEAR_W  = NEAR_F + 2;
    localparam OFF_W   = MEAN_W + 1;            // SQ14.MEAN_F
    localparam PROD_W  = CHOL_W + 1 + OFF_W;
    localparam LOW_W   = OFF_W / 2;             // bits in the low half of an offset
    localparam SUM_W   = PROD_W + 1;
    localparam DROP    = CHOL_F + MEAN_F - MID_F;
    localparam A_DROP   = CHOL_F - MID_F - 5;  // of 32a
    localparam BC_DROP  = CHOL_F - MID_F - 3;  // of 8b, 8c
    localparam EXTENT_W = CHOL_W + 6;          // 31a + 7|b|
    localparam HALF_W   = EXTENT_W - 1 - (CHOL_F - MID_F);
    localparam LIMIT_W  = 2*NEAR_F + 1 + OPACITY_W - OPACITY_F;  // .(2*NEAR_F), signed
    localparam BOUND_W  = LIMIT_W + POWER_F - 2*NEAR_F;
    localparam [HALF_W-1:0]  SLACK = 13;       // units of MID_F
    localparam [BOUND_W-1:0] BOUND = CUT + ITU_MARGIN;
    localparam [OFF_W-1:0]   RIGHT = TILE/4 << MEAN_F;     // of the tile's corner: centre of the first group
    localparam [OFF_W-1:0]   BELOW = SUBTILE/2 << MEAN_F;

    generate
        if (TILE != 64 || SUBTILE != 8 || GROUPS != 16) begin : g_rule
            TILE_must_be_64_and_SUBTILE_8_and_GROUPS_16 bad ();
        end
        if (A_DROP < 0 || POWER_F < 2*NEAR_F) begin : g_fraction_rule
            CHOL_F_must_be_13_at_least_and_POWER_F_8 bad ();
        end
        if (LIMIT_W < 2*NEAR_W || CUT + ITU_MARGIN >= (15 << POWER_F)) begin : g_cut_rule
            CUT_must_be_below_15_and_OPACITY_have_3_integer_bits bad ();
        end
    endgenerate

    // .(CHOL_F+MEAN_F) to SQ8.MID_F: floor, sat
    function [MID_W-1:0] narrow;
        input [SUM_W-DROP-1:0] x;  // the bits below are gone
        begin
            if (x[SUM_W-DROP-1:MID_W-1] == {SUM_W-DROP-MID_W+1{x[SUM_W-DROP-1]}}) narrow = x[MID_W-1:0];
            else narrow = {x[SUM_W-DROP-1], {MID_W-1{!x[SUM_W-DROP-1]}}};
        end
    endfunction

    // |x| less half of the group, UQ2.NEAR_F: floor, sat; beyond every limit when the group is not in the picture.
    // ~x is |x| - 1, which SLACK allows for.
    function [NEAR_W-1:0] near;
        input [STEP_W-1:0] x;
        input [HALF_W-1:0] half;
        input              outside;
        reg   [STEP_W-1:0] d;
        begin
            d = (x ^ {STEP_W{x[STEP_W-1]}}) - {{STEP_W-HALF_W{1'b0}}, half};
            near = (d[MID_F-NEAR_F +: NEAR_W] & {NEAR_W{!d[STEP_W-1]}})
                | {NEAR_W{outside || (!d[STEP_W-1] && |d[STEP_W-2:MID_F-NEAR_F+NEAR_W])}};
        end
    endfunction

    function [LIMIT_W-1:0] square;
        input [NEAR_W-1:0] x;
        begin
            square = {{LIMIT_W-NEAR_W{1'b0}}, x} * {{LIMIT_W-NEAR_W{1'b0}}, x};
        end
    endfunction

    reg [LATENCY:1] go;  // go[k]: a record came in k cycles ago
    always @(posedge clk) go <= {go[LATENCY-1:1], in_valid} & {LATENCY{!rst}};
    assign out_valid = go[LATENCY];

    // Groups that begin inside the picture; a tile's origin is a multiple of its side.
    wire       rows_some = in_y0[PIXEL_W-1:TILE_W] == cfg_height[PIXEL_W-1:TILE_W];
    wire       rows_all  = in_y0[PIXEL_W-1:TILE_W] < cfg_height[PIXEL_W-1:TILE_W];
    wire       cols_some = in_x0[PIXEL_W-1:TILE_W] == cfg_width[PIXEL_W-1:TILE_W];
    wire       cols_all  = in_x0[PIXEL_W-1:TILE_W] < cfg_width[PIXEL_W-1:TILE_W];
    wire [8:0] in_rows;  // one more than there are, so that three times three can be taken
    wire [1:0] in_halves;
    assign in_rows[8]   = 1'b0;
    assign in_halves[0] = cols_all || (cols_some && cfg_width[TILE_W-1:0] != {TILE_W{1'b0}});
    assign in_halves[1] = cols_all || (cols_some && cfg_width[TILE_W-1:0] > {1'b1, {TILE_W-1{1'b0}}});
    genvar r;
    generate
        for (r = 0; r < 8; r = r + 1) begin : g_in_row
            wire [2:0] row = r;
            assign in_rows[r] = rows_all || (rows_some && cfg_height[TILE_W-1:0] > {row, {TILE_W-3{1'b0}}});
        end
    endgenerate

    // S1 offset
    wire [MEAN_W-1:0] in_mean_x = in_geometry[0 +: MEAN_W];
    wire [MEAN_W-1:0] in_mean_y = in_geometry[MEAN_W +: MEAN_W];
    wire [OFF_W-1:0]  in_corner_x = {{OFF_W-MEAN_F-PIXEL_W{1'b0}}, in_x0[PIXEL_W-1:TILE_W], {MEAN_F+TILE_W{1'b0}}};
    wire [OFF_W-1:0]  in_corner_y = {{OFF_W-MEAN_F-PIXEL_W{1'b0}}, in_y0[PIXEL_W-1:TILE_W], {MEAN_F+TILE_W{1'b0}}};
    // a, b and c turn past the multiplier, a first, and so do dx, dy, dy; behind three turns they are where they were.
    reg signed [OFF_W-1:0]  s1_offset;
    reg        [OFF_W-1:0]  s1_dy;
    reg signed [CHOL_W:0]   s1_factor;   // a, b, c: UQ1, SQ1, UQ1.CHOL_F
    reg        [CHOL_W:0]   s1_next;     // b, c, a
    reg        [CHOL_W:0]   s1_other;    // c, a, b
    reg [OPACITY_W-1:0]     s1_opacity;
    reg [8:0]               s1_rows;
    reg [1:0]               s1_halves;
    always @(posedge clk) begin
        s1_offset <= in_valid ? (in_corner_x | RIGHT) - {in_mean_x[MEAN_W-1], in_mean_x} : s1_dy;
        s1_factor <= in_valid ? {1'b0, in_geometry[2*MEAN_W +: CHOL_W]} : s1_next;
        s1_next   <= in_valid ? in_geometry[2*MEAN_W+CHOL_W +: CHOL_W+1] : s1_other;
        s1_other  <= in_valid ? {1'b0, in_geometry[2*MEAN_W+2*CHOL_W+1 +: CHOL_W]} : s1_factor;
        if (in_valid) begin
            s1_dy      <= (in_corner_y | BELOW) - {in_mean_y[MEAN_W-1], in_mean_y};
            s1_opacity <= in_geometry[GEOMETRY_W-1 -: OPACITY_W];
            s1_rows    <= in_rows;
            s1_halves  <= in_halves;
        end
    end

    // S2 multiply: .(CHOL_F+MEAN_F)
    wire signed [OFF_W-1:LOW_W] s1_high = s1_offset[OFF_W-1:LOW_W];
    wire signed [LOW_W:0]       s1_low  = {1'b0, s1_offset[LOW_W-1:0]};
    reg signed [PROD_W-1:LOW_W] s2_high;
    reg        [CHOL_W+LOW_W:0] s2_low;
    wire signed [PROD_W-1:0] s2_prod = {s2_high, {LOW_W{1'b0}}}
                                     + {{PROD_W-1-CHOL_W-LOW_W{s2_low[CHOL_W+LOW_W]}}, s2_low};
    reg signed [PROD_W-1:0] s2_before;
    always @(posedge clk) begin
        s2_high   <= s1_factor * s1_high;
        s2_low    <= s1_factor * s1_low;
        s2_before <= s2_prod;
    end

    // S3 centre, and what is needed of the footprint from here on
    wire [SUM_W-1:0] s2_sum = {s2_before[PROD_W-1], s2_before} + {s2_prod[PROD_W-1], s2_prod};
    wire [MID_W-1:0] s2_v   = narrow({s2_prod[PROD_W-1], s2_prod[PROD_W-1:DROP]});
    reg [MID_W-1:0]     s3_u;
    reg [CHOL_W-1:0]    s3_a;
    reg [CHOL_W:0]      s3_b;
    reg [CHOL_W-1:0]    s3_c;
    reg [OPACITY_W-1:0] s3_opacity;
    reg [8:0]           s3_rows;
    reg [1:0]           s3_halves;
    always @(posedge clk) begin
        s3_u <= narrow(s2_sum[SUM_W-1:DROP]);
        if (go[3]) begin
            s3_a       <= s1_next[CHOL_W-1:0];
            s3_b       <= s1_other;
            s3_c       <= s1_factor[CHOL_W-1:0];
            s3_opacity <= s1_opacity;
            s3_rows    <= s1_rows;
            s3_halves  <= s1_halves;
        end
    end
    wire [STEP_W-1:0] s3_a32 = {{STEP_W-CHOL_W+A_DROP{1'b0}}, s3_a[CHOL_W-1:A_DROP]};         // SQ9.MID_F: floor
    wire [STEP_W-1:0] s3_b8  = {{STEP_W-CHOL_W-1+BC_DROP{s3_b[CHOL_W]}}, s3_b[CHOL_W:BC_DROP]};
    wire [STEP_W-1:0] s3_c8  = {{STEP_W-CHOL_W+BC_DROP{1'b0}}, s3_c[CHOL_W-1:BC_DROP]};
    wire [STEP_W-1:0] s3_b24 = s3_b8 + (s3_b8 << 1);
    wire [STEP_W-1:0] s3_c24 = s3_c8 + (s3_c8 << 1);

    // S4 step. Half of a group's extent, rounded up, with SLACK.
    wire [CHOL_W:0]     s3_b_abs  = (s3_b ^ {CHOL_W+1{s3_b[CHOL_W]}}) + {{CHOL_W{1'b0}}, s3_b[CHOL_W]};
    wire [EXTENT_W-1:0] s3_a1     = {{EXTENT_W-CHOL_W{1'b0}}, s3_a};
    wire [EXTENT_W-1:0] s3_b1     = {{EXTENT_W-CHOL_W-1{1'b0}}, s3_b_abs};
    wire [EXTENT_W-1:0] s3_c1     = {{EXTENT_W-CHOL_W{1'b0}}, s3_c};
    wire [EXTENT_W-1:0] s3_wide   = (s3_a1 << 5) - s3_a1 + (s3_b1 << 3) - s3_b1;
    wire [EXTENT_W-1:0] s3_high   = (s3_c1 << 3) - s3_c1;
    reg [HALF_W-1:0] s4_half_u;
    reg [HALF_W-1:0] s4_half_v;
    reg [8:0]        s4_rows;
    reg [1:0]        s4_halves;
    always @(posedge clk) begin
        s4_rows <= s4_rows >> ROWS;
        if (go[4]) begin
            s4_half_u <= s3_wide[EXTENT_W-1 -: HALF_W] + SLACK;
            s4_half_v <= s3_high[EXTENT_W-1 -: HALF_W] + SLACK;
            s4_rows   <= s3_rows;
            s4_halves <= s3_halves;
        end
    end

    reg [LIMIT_W-1:0] s5_limit;
    wire [BOUND_W-1:0] s3_bound = BOUND - ({{BOUND_W-OPACITY_W{1'b0}}, s3_opacity} << (POWER_F - OPACITY_F));
    always @(posedge clk) if (go[5]) s5_limit <= s3_bound[BOUND_W-1 -: LIMIT_W];

    wire [2*ROWS-1:0] s6_hit;
    genvar h;
    generate
        for (r = 0; r < ROWS; r = r + 1) begin : g_row
            wire [1:0]        times   = r;
            wire [STEP_W-1:0] b_first = (s3_b8 & {STEP_W{times[0]}}) + ((s3_b8 << 1) & {STEP_W{times[1]}});
            wire [STEP_W-1:0] c_first = (s3_c8 & {STEP_W{times[0]}}) + ((s3_c8 << 1) & {STEP_W{times[1]}});
            reg [STEP_W-1:0]    s4_v;
            reg [NEAR_W-1:0]    s5_dv;
            reg signed [LIMIT_W:0] s6_rest;
            always @(posedge clk) begin
                s4_v    <= go[4] ? {s2_v[MID_W-1], s2_v} + c_first : s4_v + s3_c24;
                s5_dv   <= near(s4_v, s4_half_v, !s4_rows[r]);
                s6_rest <= {s5_limit[LIMIT_W-1], s5_limit} - {1'b0, square(s5_dv)};
            end
            for (h = 0; h < 2; h = h + 1) begin : g_half
                wire [0:0]           right   = h;
                wire [STEP_W-1:0]    u_first = b_first + (s3_a32 & {STEP_W{right}});
                reg [STEP_W-1:0]     s4_u;
                reg [NEAR_W-1:0]     s5_du;
                reg signed [LIMIT_W:0] s6_du2;
                always @(posedge clk) begin
                    s4_u   <= go[4] ? {s3_u[MID_W-1], s3_u} + u_first : s4_u + s3_b24;
                    s5_du  <= near(s4_u, s4_half_u, !s4_halves[h]);
                    s6_du2 <= {1'b0, square(s5_du)};
                end
                assign s6_hit[2*r+h] = s6_du2 <= s6_rest;
            end
        end
    endgenerate

    // S7 compare: the first rows wait for the last ones.
    reg [6*ROWS-1:0] s7_hits;
    always @(posedge clk) s7_hits <= {s6_hit, s7_hits[6*ROWS-1:2*ROWS]};
    assign out_mask = s7_hits[GROUPS-1:0];

    wire unused_sum_ok  = &{1'b0, s2_sum[DROP-1:0], s3_bound};
    wire unused_half_ok = &{1'b0, s3_wide[EXTENT_W-HALF_W-1:0], s3_high[EXTENT_W-HALF_W-1:0]};
    wire unused_ok      = &{1'b0, in_x0[TILE_W-1:0], in_y0[TILE_W-1:0], s7_hits[6*ROWS-1:GROUPS]};

endmodule

`default_nettype wire
