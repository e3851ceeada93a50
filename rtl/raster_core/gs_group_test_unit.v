// gs_group_test_unit: which of a group's four subtiles does a Gaussian touch?
//
//   latency LATENCY = 9, one Gaussian a cycle, never stalls
//
//   S  set-up    gs_ellipse_setup at the group's first pixel    3 cycles
//   U  spread    u0 of each unit: U0 + 8*s*a, exact             1 cycle
//   T  test      4 x gs_intersection_test_unit                  5 cycles
//
//   A subtile that begins outside the picture is not touched.

`default_nettype none
`include "gs_params.vh"

module gs_group_test_unit #(
    parameter UNITS      = `GS_UNITS,
    parameter SUBTILE    = `GS_SUBTILE,
    parameter MEAN_W     = `GS_MEAN_W,
    parameter CHOL_W     = `GS_CHOL_W,
    parameter OPACITY_W  = `GS_OPACITY_W,
    parameter OPACITY_F  = `GS_OPACITY_F,
    parameter STEP_W     = `GS_STEP_W,
    parameter POWER_F    = `GS_POWER_F,
    parameter CUT        = `GS_CUT,
    parameter ITU_F      = `GS_ITU_F,
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

    localparam SETUP   = 3;  // latency of gs_ellipse_setup
    localparam LATENCY = 9;
    localparam BOUND_W = 1 + OPACITY_W - OPACITY_F + POWER_F;  // of the limit in front of its shift
    localparam LIMIT_W = BOUND_W + 2*ITU_F - POWER_F;
    localparam SPAN_W  = 2 + $clog2(SUBTILE);          // bits of a pixel column in a group
    localparam [BOUND_W-1:0] BOUND = CUT + ITU_MARGIN;

    generate
        if (UNITS != 4 || SUBTILE != 8) begin : g_rule
            UNITS_must_be_4_and_SUBTILE_8 bad ();
        end
        if (CUT + ITU_MARGIN >= (1 << (BOUND_W - 1))) begin : g_cut_rule
            CUT_must_be_below_the_largest_OPACITY bad ();
        end
    endgenerate

    wire [MEAN_W-1:0]    in_mean_x  = in_geometry[0 +: MEAN_W];
    wire [MEAN_W-1:0]    in_mean_y  = in_geometry[MEAN_W +: MEAN_W];
    wire [CHOL_W-1:0]    in_a       = in_geometry[2*MEAN_W +: CHOL_W];
    wire [CHOL_W:0]      in_b       = in_geometry[2*MEAN_W+CHOL_W +: CHOL_W+1];
    wire [CHOL_W-1:0]    in_c       = in_geometry[2*MEAN_W+2*CHOL_W+1 +: CHOL_W];
    wire [OPACITY_W-1:0] in_opacity = in_geometry[GEOMETRY_W-1 -: OPACITY_W];

    // S set-up. The footprint keeps pace with it.
    localparam FOOT_W = 3*CHOL_W + 1 + OPACITY_W;
    wire              s_valid;
    wire [STEP_W-1:0] s_u0;
    wire [STEP_W-1:0] s_v0;
    gs_ellipse_setup setup (
        .clk(clk), .rst(rst), .in_valid(in_valid),
        .in_a(in_a), .in_b(in_b), .in_c(in_c), .in_mean_x(in_mean_x), .in_mean_y(in_mean_y),
        .in_x0(in_x), .in_y0(in_y),
        .out_valid(s_valid), .out_u0(s_u0), .out_v0(s_v0)
    );
    reg [SETUP*FOOT_W-1:0] s_foot;  // newest on top
    always @(posedge clk) s_foot <= {{in_opacity, in_c, in_b, in_a}, s_foot[SETUP*FOOT_W-1:FOOT_W]};
    wire [CHOL_W-1:0]    s_a       = s_foot[0 +: CHOL_W];
    wire [CHOL_W:0]      s_b       = s_foot[CHOL_W +: CHOL_W+1];
    wire [CHOL_W-1:0]    s_c       = s_foot[2*CHOL_W+1 +: CHOL_W];
    wire [OPACITY_W-1:0] s_opacity = s_foot[FOOT_W-1 -: OPACITY_W];

    // U spread. The bound is that of the golden model.
    reg               u_valid;
    reg [STEP_W-1:0]  u_v0;
    reg [CHOL_W-1:0]  u_a;
    reg [CHOL_W:0]    u_b;
    reg [CHOL_W-1:0]  u_c;
    reg [BOUND_W-1:0] u_bound;
    always @(posedge clk) begin
        u_valid <= s_valid && !rst;
        u_v0    <= s_v0;
        u_a     <= s_a;
        u_b     <= s_b;
        u_c     <= s_c;
        u_bound <= BOUND - ({{BOUND_W-OPACITY_W{1'b0}}, s_opacity} << (POWER_F - OPACITY_F));
    end
    wire [LIMIT_W-1:0] u_limit = {u_bound, {2*ITU_F-POWER_F{1'b0}}};

    // T test
    wire [UNITS-1:0] t_valid;
    wire [UNITS-1:0] t_hits;
    genvar s;
    generate
        for (s = 0; s < UNITS; s = s + 1) begin : g_unit
            wire [1:0]      times = s;
            wire [STEP_W:0] wide_a = {{STEP_W+1-CHOL_W{1'b0}}, s_a} << $clog2(SUBTILE);
            wire [STEP_W:0] shift_a = (wide_a & {STEP_W+1{times[0]}}) + ((wide_a << 1) & {STEP_W+1{times[1]}});
            reg  [STEP_W:0] u_u0;  // SQ9.STEP_F
            always @(posedge clk) u_u0 <= {s_u0[STEP_W-1], s_u0} + shift_a;
            gs_intersection_test_unit unit (
                .clk(clk), .rst(rst), .in_valid(u_valid),
                .in_u0(u_u0), .in_v0(u_v0), .in_a(u_a), .in_b(u_b), .in_c(u_c), .in_limit(u_limit),
                .out_valid(t_valid[s]), .out_hit(t_hits[s])
            );
        end
    endgenerate

    // Which subtiles begin inside the picture travels beside.
    wire             row_in = in_y < cfg_height;
    wire [UNITS-1:0] live;
    generate
        for (s = 0; s < UNITS; s = s + 1) begin : g_live
            wire [1:0] column = s;
            assign live[s] = row_in && {in_x[PIXEL_W-1:SPAN_W], column, {SPAN_W-2{1'b0}}} < cfg_width;
        end
    endgenerate
    reg [LATENCY*UNITS-1:0] t_live;  // newest on top
    always @(posedge clk) t_live <= {live, t_live[LATENCY*UNITS-1:UNITS]};
    assign out_valid = t_valid[0];
    assign out_hits  = t_hits & t_live[UNITS-1:0];

    wire unused_ok = &{1'b0, t_valid[UNITS-1:1]};

endmodule

`default_nettype wire
