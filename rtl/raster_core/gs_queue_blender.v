// gs_queue_blender: four SCUs that blend a tile's groups, each from a queue of hits of its own, and their pixel buffers.
//
//   one operation of each SCU every 4 cycles; SCU s issues in the cycles in which a free-running counter mod 4 equals s,
//   so that the four share one read port of the features
//
//   A0 issue     read the queue of the SCU          A1  read the feature of that slot
//   A2 operate   the SCU takes the operation
//
//   A unit takes a group's mark from its queue and goes on alone. A list that is empty, or whose subtile the unit knows to
//   be done, is dropped in a cycle; a unit that holds another subtile changes it first. Behind a tile's last list a unit
//   stores what it holds; when all have, the pixel buffers are given to the resolver.

`default_nettype none
`include "gs_params.vh"

module gs_queue_blender #(
    parameter CHUNK      = `GS_CHUNK,
    parameter UNITS      = `GS_UNITS,
    parameter GROUPS     = `GS_GROUPS,
    parameter QUEUE      = `GS_QUEUE,
    parameter MARKS      = `GS_MARKS,
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

    // push, close, used: of the queues, as gs_candidate_tester drives and sees them
    input  wire [UNITS-1:0]                   push_valid,
    input  wire [$clog2(CHUNK)-1:0]           push_slot,
    input  wire                               close,
    input  wire                               close_void,
    input  wire                               close_end,
    output wire [UNITS*($clog2(QUEUE)+1)-1:0] slot_used,
    output wire [UNITS*($clog2(MARKS)+1)-1:0] mark_used,

    // blend: origin of the oldest batch that is not blended; blend_done: now it is
    input  wire [PIXEL_W-1:0]                 blend_x,
    input  wire [PIXEL_W-1:0]                 blend_y,
    output wire                               blend_done,
    output wire                               feature_en,
    output wire [1:0]                         feature_bank,
    output wire [$clog2(CHUNK)-1:0]           feature_slot,
    input  wire [GEOMETRY_W+3*COLOUR_W-1:0]   feature,     // one cycle behind its slot

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
    localparam QUEUE_W   = $clog2(QUEUE) + 1;
    localparam MARK_W    = $clog2(MARKS) + 1;
    localparam WORD_W    = LANES*(T_F + 3*ACC_W);
    localparam [1:0] WAIT  = 2'd0;  // for a list
    localparam [1:0] LIST  = 2'd1;
    localparam [1:0] STORE = 2'd2;  // and for the other units

    generate
        if (UNITS != 4) begin : g_rule
            UNITS_must_be_4 bad ();
        end
    endgenerate

    reg  [1:0]         turn;       // the SCU that may issue
    reg                resolving;
    reg  [PIXEL_W-1:0] tile_x;
    reg  [PIXEL_W-1:0] tile_y;
    wire [UNITS-1:0]   unit_take;
    wire [UNITS-1:0]   unit_stored;
    wire [UNITS-1:0]   unit_ahead;  // has finished a batch that others have not
    assign blend_done    = &unit_ahead;
    assign resolve_start = &unit_stored && !resolving;
    assign resolve_x     = tile_x;
    assign resolve_y     = tile_y;
    always @(posedge clk) begin
        turn <= turn + 2'd1;
        if (resolve_start) resolving <= 1'b1;
        if (resolve_done)  resolving <= 1'b0;
        if (|unit_take) tile_x <= blend_x;
        if (|unit_take) tile_y <= blend_y;
        if (rst) begin
            turn      <= 2'd0;
            resolving <= 1'b0;
        end
    end

    // A0: what the SCU whose turn it is does
    wire [UNITS-1:0]         unit_change;
    wire [UNITS-1:0]         unit_blend;
    wire [UNITS-1:0]         unit_store;
    wire [UNITS-1:0]         unit_fresh;
    wire [UNITS*GROUP_W-1:0] unit_group;
    wire [UNITS*2-1:0]       unit_bank;
    wire [GROUP_W-1:0]       a0_group = unit_group[turn*GROUP_W +: GROUP_W];

    // A1, A2
    reg  [UNITS-1:0]   a1_change;
    reg  [UNITS-1:0]   a2_change;
    reg  [UNITS-1:0]   a1_blend;
    reg  [UNITS-1:0]   a2_blend;
    reg                a1_store;
    reg                a2_store;
    reg                a1_fresh;
    reg                a2_fresh;
    reg  [1:0]         a1_bank;
    reg  [1:0]         a1_unit;
    reg  [GROUP_W-1:0] a1_group;
    reg  [GROUP_W-1:0] a2_group;
    wire [PIXEL_W-1:0] a1_x = {tile_x[PIXEL_W-1:SIDE_W+3], a1_group[0], a1_unit, {SIDE_W{1'b0}}};
    wire [PIXEL_W-1:0] a1_y = {tile_y[PIXEL_W-1:SIDE_W+3], a1_group[GROUP_W-1:1], {SIDE_W{1'b0}}};
    reg  [PIXEL_W-1:0] a2_x;
    reg  [PIXEL_W-1:0] a2_y;
    reg  [PIXEL_W-1:0] a2_rest_x;  // live columns and rows from here on, 0 or less: none
    reg  [PIXEL_W-1:0] a2_rest_y;
    always @(posedge clk) begin
        a1_change <= unit_change & {UNITS{!rst}};
        a1_blend  <= unit_blend & {UNITS{!rst}};
        a1_store  <= unit_store[turn];
        a1_fresh  <= unit_fresh[turn];
        a1_bank   <= unit_bank[turn*2 +: 2];
        a1_unit   <= turn;
        a1_group  <= a0_group;
        a2_change <= a1_change & {UNITS{!rst}};
        a2_blend  <= a1_blend & {UNITS{!rst}};
        a2_store  <= a1_store;
        a2_fresh  <= a1_fresh;
        a2_group  <= a1_group;
        a2_x      <= a1_x;
        a2_y      <= a1_y;
        a2_rest_x <= cfg_width - a1_x;
        a2_rest_y <= cfg_height - a1_y;
    end
    wire [UNITS*SLOT_W-1:0] unit_slot;
    assign feature_en   = |a1_blend;
    assign feature_bank = a1_bank;
    assign feature_slot = unit_slot[a1_unit*SLOT_W +: SLOT_W];

    // Pixels from a coordinate to the picture's end, at most SUBTILE. A subtile that is hit begins inside.
    function [SIDE_W:0] live;
        input [PIXEL_W-1:0] rest;
        begin
            live = (|rest[PIXEL_W-1:SIDE_W]) ? {1'b1, {SIDE_W{1'b0}}} : {1'b0, rest[SIDE_W-1:0]};
        end
    endfunction

    genvar s;
    generate
        for (s = 0; s < UNITS; s = s + 1) begin : g_unit
            localparam [1:0] ME = s;

            // Lists
            wire               mark_valid;
            wire               mark_void;
            wire               mark_end;
            wire [SLOT_W:0]    mark_count;
            reg  [1:0]         state;
            reg  [1:0]         bank;
            reg  [GROUP_W-1:0] group;
            reg                last;        // the list is the tile's last
            reg                change;      // to be issued in front of the rest
            reg  [SLOT_W:0]    left;        // hits to be issued
            reg                holds;
            reg  [GROUP_W-1:0] held;        // by the operations issued so far
            reg  [GROUPS-1:0]  leaving;     // subtiles on their way into the pixel buffer
            reg  [GROUPS-1:0]  known_done;
            reg  [GROUPS-1:0]  loaded;      // subtiles of which the pixel buffer or the ring holds a state
            reg  [1:0]         ahead;       // batches finished by this unit and not by all
            wire               none      = mark_count == {SLOT_W+1{1'b0}};
            wire               take      = state == WAIT && mark_valid && (none || !leaving[group]);
            wire               drop      = take && (none || known_done[group]);
            wire               begins    = take && !drop;
            wire               my_turn   = turn == ME;
            wire               go_change = my_turn && change;
            wire               go_blend  = my_turn && !change && left != {SLOT_W+1{1'b0}};
            wire               over      = drop || (go_blend && left == {{SLOT_W{1'b0}}, 1'b1});
            wire               no_batch  = take && mark_void;
            wire               batch_end = no_batch || (over && group == {GROUP_W{1'b1}});
            wire               tile_end  = over && (take ? mark_end : last);
            gs_hit_queue #(.CHUNK(CHUNK), .QUEUE(QUEUE), .MARKS(MARKS)) queue (
                .clk(clk), .rst(rst),
                .push_valid(push_valid[s]), .push_slot(push_slot),
                .close(close), .close_void(close_void), .close_end(close_end),
                .mark_valid(mark_valid), .mark_ready(take), .mark_skip(drop),
                .mark_void(mark_void), .mark_end(mark_end), .mark_count(mark_count),
                .slot_en(go_blend), .slot(unit_slot[s*SLOT_W +: SLOT_W]),
                .slot_used(slot_used[s*QUEUE_W +: QUEUE_W]), .mark_used(mark_used[s*MARK_W +: MARK_W])
            );
            wire               sat_valid;
            wire [GROUP_W-1:0] sat_group;
            wire               sat_stored;
            wire               sat_all;
            assign unit_take[s]   = take;
            assign unit_change[s] = go_change;
            assign unit_blend[s]  = go_blend;
            assign unit_store[s]  = holds;
            assign unit_fresh[s]  = state == STORE || !loaded[group];
            assign unit_group[s*GROUP_W +: GROUP_W] = group;
            assign unit_bank[s*2 +: 2]              = bank;
            assign unit_stored[s] = state == STORE && !holds && leaving == {GROUPS{1'b0}};
            assign unit_ahead[s]  = ahead != 2'd0;
            assign touched[s*GROUPS +: GROUPS] = loaded;
            always @(posedge clk) begin
                if (begins)       state <= LIST;
                if (over)         state <= WAIT;
                if (tile_end)     state <= STORE;
                if (resolve_done) state <= WAIT;
                if (begins)    last   <= mark_end;
                if (begins)    left   <= mark_count;
                if (begins)    change <= !(holds && held == group);
                if (go_blend)  left   <= left - {{SLOT_W{1'b0}}, 1'b1};
                if (tile_end)  change <= holds;
                if (over && !no_batch) group <= group + {{GROUP_W-1{1'b0}}, 1'b1};
                if (batch_end) bank   <= bank == 2'd2 ? 2'd0 : bank + 2'd1;
                ahead <= ahead + {1'b0, batch_end} - {1'b0, blend_done};
                if (go_change) begin
                    change <= 1'b0;
                    holds  <= state == LIST;
                    held   <= group;
                end
                if (go_change && holds)            leaving[held]         <= 1'b1;
                if (sat_valid && sat_stored)       leaving[sat_group]    <= 1'b0;
                if (sat_valid && sat_stored)       known_done[sat_group] <= sat_all;
                if (go_change && state == LIST)    loaded[group]         <= 1'b1;
                if (rst || resolve_done) known_done <= {GROUPS{1'b0}};
                if (rst || resolve_done) loaded     <= {GROUPS{1'b0}};
                if (rst) begin
                    state   <= WAIT;
                    bank    <= 2'd0;
                    group   <= {GROUP_W{1'b0}};
                    change  <= 1'b0;
                    left    <= {SLOT_W+1{1'b0}};
                    holds   <= 1'b0;
                    leaving <= {GROUPS{1'b0}};
                    ahead   <= 2'd0;
                end
            end

            // The SCU and its pixels
            wire               rd_en;
            wire [GROUP_W+1:0] rd_addr;
            wire [WORD_W-1:0]  rd_data;
            wire               wr_en;
            wire [GROUP_W+1:0] wr_addr;
            wire [WORD_W-1:0]  wr_data;
            wire               op_ready;
            gs_subtile_compute_unit scu (
                .clk(clk), .rst(rst),
                .op_valid(a2_change[s] || a2_blend[s]), .op_ready(op_ready),
                .op_swap(a2_change[s]), .op_store(a2_store), .op_fresh(a2_fresh), .op_group(a2_group),
                .op_cols(live(a2_rest_x)), .op_rows(live(a2_rest_y)), .op_x0(a2_x), .op_y0(a2_y),
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
                .rd_en(rd_en || pixel_en), .rd_addr(resolving ? pixel_addr : rd_addr), .rd_data(rd_data)
            );
            assign pixel_words[s*WORD_W +: WORD_W] = rd_data;
            wire unused_unit_ok = &{1'b0, op_ready};
        end
    endgenerate

    wire unused_ok = &{1'b0, tile_x[SIDE_W+2:0], tile_y[SIDE_W+2:0]};

endmodule

`default_nettype wire
