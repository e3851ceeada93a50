// gs_raster_core: a tile's sorted table to its pixels, its entries' fresh depths and their valid bits.
//
//   tests one entry a cycle against four subtiles, blends four entries every 4 cycles; cycles: docs/raster_core/raster_core.md
//
//   gs_batch_buffer     takes tiles and entries, fetches features, keeps two batches, writes entries back
//   gs_group_tester     finds the hits of a group's four subtiles
//   gs_subtile_blender  blends them
//   gs_pixel_resolver   puts the tile over the background
//
//   cfg_* hold while a tile is inside. A tile's origin lies inside the picture, and its entries are valid ones.

`default_nettype none
`include "gs_params.vh"

module gs_raster_core #(
    parameter CHUNK    = `GS_CHUNK,
    parameter UNITS    = `GS_UNITS,
    parameter GROUPS   = `GS_GROUPS,
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

    // upd: the table to be written back, a block stream
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
    output wire [$clog2(CHUNK)-1:0]  trace_itu_slot,
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

    wire                        test_valid;
    wire [SLOT_W:0]             test_n;
    wire [PIXEL_W-1:0]          test_x;
    wire [PIXEL_W-1:0]          test_y;
    wire                        test_issued;
    wire                        geometry_en;
    wire [SLOT_W-1:0]           geometry_slot;
    wire [GEOMETRY_W-1:0]       geometry;
    wire                        hit_valid;
    wire [UNITS-1:0]            hit_units;
    wire                        hit_first;
    wire                        hit_last;
    wire [GROUP_W-1:0]          hit_group;
    wire [SLOT_W-1:0]           hit_slot;
    wire                        list_valid;
    wire [UNITS*(SLOT_W+1)-1:0] list_count;
    wire                        list_done;
    wire [UNITS-1:0]            list_en;
    wire [UNITS*SLOT_W-1:0]     list_pos;
    wire [UNITS*SLOT_W-1:0]     list_slot;
    wire                        blend_valid;
    wire [SLOT_W:0]             blend_n;
    wire                        blend_last;
    wire [PIXEL_W-1:0]          blend_x;
    wire [PIXEL_W-1:0]          blend_y;
    wire                        blend_done;
    wire                        feature_en;
    wire [SLOT_W-1:0]           feature_slot;
    wire [FEATURE_W-1:0]        feature;
    wire                        resolve_start;
    wire [PIXEL_W-1:0]          resolve_x;
    wire [PIXEL_W-1:0]          resolve_y;
    wire                        resolve_done;
    wire                        pixel_en;
    wire [GROUP_W+1:0]          pixel_addr;
    wire [UNITS*WORD_W-1:0]     pixel_words;
    wire [UNITS*GROUPS-1:0]     touched;

    gs_batch_buffer #(.CHUNK(CHUNK)) batch_buffer (
        .clk(clk), .rst(rst),
        .tile_valid(tile_valid), .tile_ready(tile_ready), .tile_x(tile_x), .tile_y(tile_y),
        .entry_valid(entry_valid), .entry_ready(entry_ready), .entry_last(entry_last), .entry_word(entry_word),
        .feat_valid(feat_valid), .feat_ready(feat_ready), .feat_record(feat_record),
        .feat_req_valid(feat_req_valid), .feat_req_ready(feat_req_ready), .feat_req_index(feat_req_index),
        .upd_valid(upd_valid), .upd_ready(upd_ready), .upd_word(upd_word), .upd_len(upd_len), .upd_last(upd_last),
        .test_valid(test_valid), .test_n(test_n), .test_x(test_x), .test_y(test_y), .test_issued(test_issued),
        .geometry_en(geometry_en), .geometry_slot(geometry_slot), .geometry(geometry),
        .hit_valid(hit_valid), .hit_any(|hit_units), .hit_first(hit_first), .hit_last(hit_last), .hit_slot(hit_slot),
        .blend_valid(blend_valid), .blend_n(blend_n), .blend_last(blend_last), .blend_x(blend_x), .blend_y(blend_y),
        .blend_done(blend_done), .feature_en(feature_en), .feature_slot(feature_slot), .feature(feature)
    );

    gs_group_tester #(.CHUNK(CHUNK)) group_tester (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height),
        .test_valid(test_valid), .test_n(test_n), .test_x(test_x), .test_y(test_y), .test_issued(test_issued),
        .geometry_en(geometry_en), .geometry_slot(geometry_slot), .geometry(geometry),
        .hit_valid(hit_valid), .hit_units(hit_units), .hit_first(hit_first), .hit_last(hit_last),
        .hit_group(hit_group), .hit_slot(hit_slot),
        .list_valid(list_valid), .list_count(list_count), .list_done(list_done),
        .list_en(list_en), .list_pos(list_pos), .list_slot(list_slot)
    );

    gs_subtile_blender #(.CHUNK(CHUNK)) subtile_blender (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height),
        .blend_valid(blend_valid), .blend_n(blend_n), .blend_last(blend_last), .blend_x(blend_x), .blend_y(blend_y),
        .blend_done(blend_done), .feature_en(feature_en), .feature_slot(feature_slot), .feature(feature),
        .list_valid(list_valid), .list_count(list_count), .list_done(list_done),
        .list_en(list_en), .list_pos(list_pos), .list_slot(list_slot),
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
