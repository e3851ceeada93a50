// gs_subtile_blender: four SCUs that blend a tile group by group from the testers' lists, and their pixel buffers.
//
//   one operation of each SCU every 4 cycles; SCU s issues in the cycles in which a free-running counter mod 4 equals s,
//   so that the four share one read port of the features
//
//   A0 issue     read the list of the SCU           A1  read the feature of that slot
//   A2 operate   the SCU takes the operation
//
//   A phase is one group. An SCU whose list is empty, or whose subtile it knows to be done, sits it out; one that holds
//   another group's subtile changes it first. The phase ends when all has been issued and every change has gone through.
//   Behind a tile's last phase the held subtiles are stored and the pixel buffers are given to the resolver.

`default_nettype none
`include "gs_params.vh"

module gs_subtile_blender #(
    parameter CHUNK      = `GS_CHUNK,
    parameter UNITS      = `GS_UNITS,
    parameter GROUPS     = `GS_GROUPS,
    parameter SUBTILE    = `GS_SUBTILE,
    parameter LANES      = `GS_LANES,
    parameter T_F        = `GS_T_F,
    parameter ACC_W      = `GS_ACC_W,
    parameter MEAN_W     = `GS_MEAN_W,
    parameter CHOL_W     = `GS_CHOL_W,
    parameter OPACITY_W  = `GS_OPACITY_W,
    parameter COLOUR_W   = `GS_COLOUR_W,
    parameter GEOMETRY_W = `GS_GEOMETRY_W,
    parameter PIXEL_W    = 13  // bits of a pixel coordinate
) (
    input  wire                               clk,
    input  wire                               rst,
    input  wire [PIXEL_W-1:0]                 cfg_width,   // of the picture, pixels
    input  wire [PIXEL_W-1:0]                 cfg_height,

    // blend: the batch, as gs_batch_buffer gives it
    input  wire                               blend_valid,
    input  wire [$clog2(CHUNK):0]             blend_n,
    input  wire                               blend_last,
    input  wire [PIXEL_W-1:0]                 blend_x,
    input  wire [PIXEL_W-1:0]                 blend_y,
    output wire                               blend_done,
    output wire                               feature_en,
    output wire [$clog2(CHUNK)-1:0]           feature_slot,
    input  wire [GEOMETRY_W+3*COLOUR_W-1:0]   feature,

    // list: as gs_group_tester gives them
    input  wire                               list_valid,
    input  wire [UNITS*($clog2(CHUNK)+1)-1:0] list_count,
    output wire                               list_done,
    output wire [UNITS-1:0]                   list_en,
    output wire [UNITS*$clog2(CHUNK)-1:0]     list_pos,
    input  wire [UNITS*$clog2(CHUNK)-1:0]     list_slot,

    // resolve: from the pulse resolve_start to the pulse resolve_done the pixel buffers are the resolver's;
    // word {group, beat} of every unit, one cycle behind its address; touched: was the subtile ever loaded?
    output wire                               resolve_start,
    output wire [PIXEL_W-1:0]                 resolve_x,
    output wire [PIXEL_W-1:0]                 resolve_y,
    input  wire                               resolve_done,
    input  wire                               pixel_en,
    input  wire [$clog2(GROUPS)+1:0]          pixel_addr,
    output wire [UNITS*LANES*(T_F+3*ACC_W)-1:0] pixel_words,
    output wire [UNITS*GROUPS-1:0]            touched,     // bit unit * GROUPS + group

    // trace
    output wire [UNITS-1:0]                   trace_valid,
    output wire [UNITS*LANES-1:0]             trace_blend
);

    localparam SLOT_W    = $clog2(CHUNK);
    localparam GROUP_W   = $clog2(GROUPS);
    localparam SIDE_W    = $clog2(SUBTILE);
    localparam FEATURE_W = GEOMETRY_W + 3*COLOUR_W;
    localparam WORD_W    = LANES*(T_F + 3*ACC_W);
    localparam [1:0] WAIT    = 2'd0;  // for a group's lists
    localparam [1:0] PHASE   = 2'd1;
    localparam [1:0] STORE   = 2'd2;
    localparam [1:0] RESOLVE = 2'd3;

    generate
        if (UNITS != 4) begin : g_rule
            UNITS_must_be_4 bad ();
        end
    endgenerate

    // Phases
    reg  [1:0]         state;
    reg  [1:0]         turn;       // the SCU that may issue
    reg  [GROUP_W-1:0] group;
    reg  [PIXEL_W-1:0] tile_x;     // of the tile being stored and resolved
    reg  [PIXEL_W-1:0] tile_y;
    wire [UNITS-1:0]   unit_done;
    wire all_done    = &unit_done;
    wire no_entries  = state == WAIT && blend_valid && blend_n == {SLOT_W+1{1'b0}};  // always a tile's last batch
    wire phase_start = state == WAIT && blend_valid && blend_n != {SLOT_W+1{1'b0}} && list_valid;
    wire batch_end   = list_done && group == {GROUP_W{1'b1}};
    wire store_start = (batch_end && blend_last) || no_entries;
    assign list_done     = state == PHASE && all_done;
    assign blend_done    = batch_end || no_entries;
    assign resolve_start = state == STORE && all_done;
    assign resolve_x     = tile_x;
    assign resolve_y     = tile_y;
    always @(posedge clk) begin
        turn <= turn + 2'd1;
        if (list_done)     group <= group + {{GROUP_W-1{1'b0}}, 1'b1};
        if (phase_start)   state <= PHASE;
        if (list_done)     state <= WAIT;
        if (store_start)   state <= STORE;
        if (resolve_start) state <= RESOLVE;
        if (resolve_done)  state <= WAIT;
        if (store_start) tile_x <= blend_x;
        if (store_start) tile_y <= blend_y;
        if (rst) begin
            state <= WAIT;
            turn  <= 2'd0;
            group <= {GROUP_W{1'b0}};
        end
    end

    // Of the operation at A2: its subtile, for all SCUs together
    reg [GROUP_W-1:0] a1_group;
    reg [GROUP_W-1:0] a2_group;
    reg [PIXEL_W-1:0] a1_x;
    reg [PIXEL_W-1:0] a2_x;
    reg [PIXEL_W-1:0] a1_y;
    reg [PIXEL_W-1:0] a2_y;
    reg [PIXEL_W-1:0] a2_rest_y;  // live rows from here on, 0 or less: none
    always @(posedge clk) begin
        a1_group  <= group;
        a1_x      <= {blend_x[PIXEL_W-1:SIDE_W+3], group[0], {SIDE_W+2{1'b0}}};
        a1_y      <= {blend_y[PIXEL_W-1:SIDE_W+3], group[GROUP_W-1:1], {SIDE_W{1'b0}}};
        a2_group  <= a1_group;
        a2_x      <= a1_x;
        a2_y      <= a1_y;
        a2_rest_y <= cfg_height - a1_y;
    end

    // Pixels from a coordinate to the picture's end, at most SUBTILE. A subtile that is hit begins inside.
    function [SIDE_W:0] live;
        input [PIXEL_W-1:0] rest;
        begin
            live = (|rest[PIXEL_W-1:SIDE_W]) ? {1'b1, {SIDE_W{1'b0}}} : {1'b0, rest[SIDE_W-1:0]};
        end
    endfunction

    // One read port for all: the slot of the SCU that is at A1
    wire [UNITS-1:0]        unit_read;
    wire [UNITS*SLOT_W-1:0] unit_slot;
    wire [SLOT_W-1:0]       slot_01 = unit_slot[0 +: SLOT_W] | unit_slot[SLOT_W +: SLOT_W];
    wire [SLOT_W-1:0]       slot_23 = unit_slot[2*SLOT_W +: SLOT_W] | unit_slot[3*SLOT_W +: SLOT_W];
    assign feature_en   = |unit_read;
    assign feature_slot = slot_01 | slot_23;

    genvar s;
    generate
        for (s = 0; s < UNITS; s = s + 1) begin : g_unit
            localparam [1:0] ME = s;

            // A0 issue
            reg                change;      // to be issued in front of the rest
            reg                changing;    // issued, not yet through
            reg  [SLOT_W:0]    left;        // list positions to be issued
            reg  [SLOT_W-1:0]  pos;
            reg                holds;
            reg  [GROUP_W-1:0] held;        // by the operations issued so far
            reg  [GROUPS-1:0]  known_done;
            reg  [GROUPS-1:0]  loaded;      // subtiles of which the pixel buffer or the ring holds a state
            wire [SLOT_W:0]    count     = list_count[s*(SLOT_W+1) +: SLOT_W+1];
            wire               active    = count != {SLOT_W+1{1'b0}} && !known_done[group];
            wire               my_turn   = (state == PHASE || state == STORE) && turn == ME;
            wire               go_change = my_turn && change;
            wire               go_blend  = my_turn && !change && left != {SLOT_W+1{1'b0}};
            wire               sat_valid;
            wire [GROUP_W-1:0] sat_group;
            wire               sat_stored;
            wire               sat_all;
            assign unit_done[s]                   = !change && !changing && left == {SLOT_W+1{1'b0}};
            assign list_en[s]                     = go_blend;
            assign list_pos[s*SLOT_W +: SLOT_W]   = pos;
            assign touched[s*GROUPS +: GROUPS]    = loaded;
            always @(posedge clk) begin
                if (phase_start) change <= active && !(holds && held == group);
                if (phase_start) left   <= active ? count : {SLOT_W+1{1'b0}};
                if (phase_start) pos    <= {SLOT_W{1'b0}};
                if (store_start) change <= holds;
                if (go_change) change        <= 1'b0;
                if (go_change) changing      <= 1'b1;
                if (go_change) holds         <= state == PHASE;
                if (go_change) held          <= group;
                if (go_change && state == PHASE) loaded[group] <= 1'b1;
                if (go_blend)  left          <= left - {{SLOT_W{1'b0}}, 1'b1};
                if (go_blend)  pos           <= pos + {{SLOT_W-1{1'b0}}, 1'b1};
                if (sat_valid) changing      <= 1'b0;
                if (sat_valid && sat_stored) known_done[sat_group] <= sat_all;
                if (rst || resolve_done) known_done <= {GROUPS{1'b0}};
                if (rst || resolve_done) loaded     <= {GROUPS{1'b0}};
                if (rst) begin
                    change   <= 1'b0;
                    changing <= 1'b0;
                    left     <= {SLOT_W+1{1'b0}};
                    holds    <= 1'b0;
                end
            end

            // A1, A2
            reg a1_change;
            reg a1_blend;
            reg a1_store;
            reg a1_fresh;
            reg a2_change;
            reg a2_blend;
            reg a2_store;
            reg a2_fresh;
            always @(posedge clk) begin
                a1_change <= go_change && !rst;
                a1_blend  <= go_blend && !rst;
                a1_store  <= holds;
                a1_fresh  <= state == STORE || !loaded[group];
                a2_change <= a1_change && !rst;
                a2_blend  <= a1_blend && !rst;
                a2_store  <= a1_store;
                a2_fresh  <= a1_fresh;
            end
            assign unit_read[s] = a1_blend;
            assign unit_slot[s*SLOT_W +: SLOT_W] = list_slot[s*SLOT_W +: SLOT_W] & {SLOT_W{a1_blend}};

            wire [PIXEL_W-1:0] a2_my_x  = {a2_x[PIXEL_W-1:SIDE_W+2], ME, a2_x[SIDE_W-1:0]};
            wire [PIXEL_W-1:0] a2_right = cfg_width - a2_my_x;
            wire               rd_en;
            wire [GROUP_W+1:0] rd_addr;
            wire [WORD_W-1:0]  rd_data;
            wire               wr_en;
            wire [GROUP_W+1:0] wr_addr;
            wire [WORD_W-1:0]  wr_data;
            wire               op_ready;
            gs_subtile_compute_unit scu (
                .clk(clk), .rst(rst),
                .op_valid(a2_change || a2_blend), .op_ready(op_ready),
                .op_swap(a2_change), .op_store(a2_store), .op_fresh(a2_fresh), .op_group(a2_group),
                .op_cols(live(a2_right)), .op_rows(live(a2_rest_y)),
                .op_x0(a2_my_x), .op_y0(a2_y),
                .op_mean_x(feature[0 +: MEAN_W]), .op_mean_y(feature[MEAN_W +: MEAN_W]),
                .op_a(feature[2*MEAN_W +: CHOL_W]), .op_b(feature[2*MEAN_W+CHOL_W +: CHOL_W+1]),
                .op_c(feature[2*MEAN_W+2*CHOL_W+1 +: CHOL_W]),
                .op_opacity(feature[GEOMETRY_W-1 -: OPACITY_W]),
                .op_red(feature[GEOMETRY_W +: COLOUR_W]), .op_green(feature[GEOMETRY_W+COLOUR_W +: COLOUR_W]),
                .op_blue(feature[FEATURE_W-1 -: COLOUR_W]),
                .px_rd_en(rd_en), .px_rd_addr(rd_addr), .px_rd_data(rd_data),
                .px_wr_en(wr_en), .px_wr_addr(wr_addr), .px_wr_data(wr_data),
                .sat_valid(sat_valid), .sat_group(sat_group), .sat_stored(sat_stored), .sat_all(sat_all),
                .trace_valid(trace_valid[s]), .trace_blend(trace_blend[s*LANES +: LANES])
            );
            gs_ram #(.WIDTH(WORD_W), .DEPTH(4*GROUPS)) pixel_ram (
                .clk(clk), .wr_en(wr_en), .wr_addr(wr_addr), .wr_data(wr_data),
                .rd_en(rd_en || pixel_en), .rd_addr(state == RESOLVE ? pixel_addr : rd_addr), .rd_data(rd_data)
            );
            assign pixel_words[s*WORD_W +: WORD_W] = rd_data;
            wire unused_unit_ok = &{1'b0, op_ready, a2_x[SIDE_W+1:SIDE_W]};
        end
    endgenerate

    wire unused_ok = &{1'b0, blend_x[SIDE_W+2:0], blend_y[SIDE_W+2:0]};

endmodule

`default_nettype wire
