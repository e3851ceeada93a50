// gs_late_core: a tile's nearly sorted table to its pixels, and to its table in the fresh order with its valid bits.
//
//   sorts a batch by the fresh depths while the one before it is blended, tests one candidate a cycle against four
//   subtiles, blends four entries every 4 cycles; cycles: docs/raster_core/late_core.md
//
//   gs_late_buffer       takes tiles and entries, fetches features, sorts, keeps three batches, writes entries back
//   gs_candidate_tester  finds the hits of a group's four subtiles among the entries that may have some
//   gs_queue_blender     queues the hits of each subtile and blends them
//   gs_pixel_resolver    puts the tile over the background
//
//   cfg_* hold while a tile is inside. A tile's origin lies inside the picture, and its entries are valid ones. Records
//   come at most every third cycle.

`default_nettype none
`include "gs_params.vh"

module gs_late_core #(
    parameter CHUNK    = `GS_CHUNK,
    parameter UNITS    = `GS_UNITS,
    parameter GROUPS   = `GS_GROUPS,
    parameter QUEUE    = `GS_QUEUE,
    parameter MARKS    = `GS_MARKS,
    parameter LANES    = `GS_LANES,
    parameter INDEX_W  = `GS_INDEX_W,
    parameter ENTRY_W  = `GS_ENTRY_W,
    parameter RECORD_W = `GS_RECORD_W,
    parameter COLOUR_W = `GS_COLOUR_W,
    parameter T_F      = `GS_T_F,
    parameter ACC_W    = `GS_ACC_W,
    parameter PIXEL_W  = 13  // bits of a pixel coordinate
) (
    input  wire                      clk,
    input  wire                      rst,
    input  wire [PIXEL_W-1:0]        cfg_width,       // of the picture, pixels
    input  wire [PIXEL_W-1:0]        cfg_height,
    input  wire [COLOUR_W-1:0]       cfg_bg_red,      // UQ3.COLOUR_F
    input  wire [COLOUR_W-1:0]       cfg_bg_green,
    input  wire [COLOUR_W-1:0]       cfg_bg_blue,
    input  wire [$clog2(CHUNK):0]    cfg_first,       // entries in a tile's first batch, 1..CHUNK

    // tile: pixel origin, multiples of the tile's side
    input  wire                      tile_valid,
    output wire                      tile_ready,
    input  wire [PIXEL_W-1:0]        tile_x,
    input  wire [PIXEL_W-1:0]        tile_y,

    // entry: the tile's table, a list stream
    input  wire                      entry_valid,
    output wire                      entry_ready,
    input  wire                      entry_last,
    input  wire [ENTRY_W-1:0]        entry_word,

    // feat: a record for each request, in order
    input  wire                      feat_valid,
    output wire                      feat_ready,
    input  wire [RECORD_W-1:0]       feat_record,

    // feat_req
    output wire                      feat_req_valid,
    input  wire                      feat_req_ready,
    output wire [INDEX_W-1:0]        feat_req_index,

    // upd: the table to be written back, a block stream whose blocks are the batches, each in its fresh order
    output wire                      upd_valid,
    input  wire                      upd_ready,
    output wire [ENTRY_W-1:0]        upd_word,
    output wire [$clog2(CHUNK):0]    upd_len,
    output wire                      upd_last,

    // px: 4 pixels RGBX, row by row
    output wire                      px_valid,
    input  wire                      px_ready,
    output wire [127:0]              px_data,
    output wire [15:0]               px_strb,
    output wire                      px_last,         // of the tile

    // trace: may be left open
    output wire                      trace_itu_valid, // one test
    output wire [$clog2(GROUPS)-1:0] trace_itu_group,
    output wire [$clog2(CHUNK)-1:0]  trace_itu_slot,  // in the order of arrival
    output wire [UNITS-1:0]          trace_itu_hits,
    output wire [12*ACC_W-1:0]       trace_px_rgb,    // beside px: values before their narrowing, UQ3.ACC_F
    output wire [UNITS-1:0]          trace_blend_valid,
    output wire [UNITS*LANES-1:0]    trace_blend,     // pixels that blend in this cycle, LANES bits a unit
    output wire                      trace_tile_done  // the tile's last pixels leave
);

    localparam SLOT_W     = $clog2(CHUNK);
    localparam GROUP_W    = $clog2(GROUPS);
    localparam GEOMETRY_W = `GS_GEOMETRY_W;
    localparam FEATURE_W  = GEOMETRY_W + 3*COLOUR_W;
    localparam WORD_W     = LANES*(T_F + 3*ACC_W);

    wire                           test_valid;
    wire [SLOT_W:0]                test_n;
    wire                           test_last;
    wire [PIXEL_W-1:0]             test_x;
    wire [PIXEL_W-1:0]             test_y;
    wire                           test_issued;
    wire                           cand_en;
    wire [GROUP_W-1:0]             cand_group;
    wire [SLOT_W-5:0]              cand_block;
    wire [15:0]                    cand_bits;
    wire                           geometry_en;
    wire [SLOT_W-1:0]              geometry_pos;
    wire [GEOMETRY_W-1:0]          geometry;
    wire [SLOT_W-1:0]              geometry_slot;
    wire                           hit_valid;
    wire [UNITS-1:0]               hit_units;
    wire [GROUP_W-1:0]             hit_group;
    wire [SLOT_W-1:0]              hit_slot;
    wire                           hits_over;
    wire                           close;
    wire                           close_void;
    wire                           close_end;
    wire [UNITS*($clog2(QUEUE)+1)-1:0] slot_used;
    wire [UNITS*($clog2(MARKS)+1)-1:0] mark_used;
    wire [PIXEL_W-1:0]             blend_x;
    wire [PIXEL_W-1:0]             blend_y;
    wire                           blend_done;
    wire                           feature_en;
    wire [1:0]                     feature_bank;
    wire [SLOT_W-1:0]              feature_slot;
    wire [FEATURE_W-1:0]           feature;
    wire                           resolve_start;
    wire [PIXEL_W-1:0]             resolve_x;
    wire [PIXEL_W-1:0]             resolve_y;
    wire                           resolve_done;
    wire                           pixel_en;
    wire [GROUP_W+1:0]             pixel_addr;
    wire [UNITS*WORD_W-1:0]        pixel_words;
    wire [UNITS*GROUPS-1:0]        touched;

    gs_late_buffer #(.CHUNK(CHUNK)) late_buffer (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height), .cfg_first(cfg_first),
        .tile_valid(tile_valid), .tile_ready(tile_ready), .tile_x(tile_x), .tile_y(tile_y),
        .entry_valid(entry_valid), .entry_ready(entry_ready), .entry_last(entry_last), .entry_word(entry_word),
        .feat_valid(feat_valid), .feat_ready(feat_ready), .feat_record(feat_record),
        .feat_req_valid(feat_req_valid), .feat_req_ready(feat_req_ready), .feat_req_index(feat_req_index),
        .upd_valid(upd_valid), .upd_ready(upd_ready), .upd_word(upd_word), .upd_len(upd_len), .upd_last(upd_last),
        .test_valid(test_valid), .test_n(test_n), .test_last(test_last), .test_x(test_x), .test_y(test_y),
        .test_issued(test_issued),
        .cand_en(cand_en), .cand_group(cand_group), .cand_block(cand_block), .cand_bits(cand_bits),
        .geometry_en(geometry_en), .geometry_pos(geometry_pos), .geometry(geometry), .geometry_slot(geometry_slot),
        .hit_valid(hit_valid), .hit_any(|hit_units), .hit_slot(hit_slot), .hits_over(hits_over),
        .blend_x(blend_x), .blend_y(blend_y), .blend_done(blend_done),
        .feature_en(feature_en), .feature_bank(feature_bank), .feature_slot(feature_slot), .feature(feature)
    );

    gs_candidate_tester #(.CHUNK(CHUNK), .QUEUE(QUEUE), .MARKS(MARKS)) candidate_tester (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height),
        .test_valid(test_valid), .test_n(test_n), .test_last(test_last), .test_x(test_x), .test_y(test_y),
        .test_issued(test_issued),
        .cand_en(cand_en), .cand_group(cand_group), .cand_block(cand_block), .cand_bits(cand_bits),
        .geometry_en(geometry_en), .geometry_pos(geometry_pos), .geometry(geometry), .geometry_slot(geometry_slot),
        .hit_valid(hit_valid), .hit_units(hit_units), .hit_group(hit_group), .hit_slot(hit_slot),
        .hits_over(hits_over), .close(close), .close_void(close_void), .close_end(close_end),
        .slot_used(slot_used), .mark_used(mark_used)
    );

    gs_queue_blender #(.CHUNK(CHUNK), .QUEUE(QUEUE), .MARKS(MARKS)) queue_blender (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height),
        .push_valid(hit_units), .push_slot(hit_slot), .close(close), .close_void(close_void), .close_end(close_end),
        .slot_used(slot_used), .mark_used(mark_used), .blend_x(blend_x), .blend_y(blend_y), .blend_done(blend_done),
        .feature_en(feature_en), .feature_bank(feature_bank), .feature_slot(feature_slot), .feature(feature),
        .resolve_start(resolve_start), .resolve_x(resolve_x), .resolve_y(resolve_y), .resolve_done(resolve_done),
        .pixel_en(pixel_en), .pixel_addr(pixel_addr), .pixel_words(pixel_words), .touched(touched),
        .trace_valid(trace_blend_valid), .trace_blend(trace_blend)
    );

    gs_pixel_resolver pixel_resolver (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height),
        .cfg_bg_red(cfg_bg_red), .cfg_bg_green(cfg_bg_green), .cfg_bg_blue(cfg_bg_blue),
        .resolve_start(resolve_start), .resolve_x(resolve_x), .resolve_y(resolve_y), .resolve_done(resolve_done),
        .pixel_en(pixel_en), .pixel_addr(pixel_addr), .pixel_words(pixel_words), .touched(touched),
        .px_valid(px_valid), .px_ready(px_ready), .px_data(px_data), .px_strb(px_strb), .px_last(px_last),
        .px_rgb(trace_px_rgb)
    );

    assign trace_itu_valid = hit_valid;
    assign trace_itu_group = hit_group;
    assign trace_itu_slot  = hit_slot;
    assign trace_itu_hits  = hit_units;
    assign trace_tile_done = px_valid && px_ready && px_last;

endmodule

`default_nettype wire
