// gs_late_buffer: three batches of a table: their records are fetched, sorted, lent to tester and blender, written back
//
//   an entry a cycle in and out, a record every three cycles; entry_ready, tile_ready and feat_ready see registers only
//
//   A batch passes these marks, each a bit per bank: closed (its entries are known), loaded (its records are here),
//   ready (in order, its candidates can be read), issued (all its tests have begun), over (all have ended), blended,
//   written. The last two free the bank. Each user has a bank number of its own.

`default_nettype none
`include "gs_params.vh"

module gs_late_buffer #(
    parameter CHUNK      = `GS_CHUNK,
    parameter GROUPS     = `GS_GROUPS,
    parameter INDEX_W    = `GS_INDEX_W,
    parameter KEY_W      = `GS_KEY_W,
    parameter ENTRY_W    = `GS_ENTRY_W,
    parameter RECORD_W   = `GS_RECORD_W,
    parameter GEOMETRY_W = `GS_GEOMETRY_W,
    parameter COLOUR_W   = `GS_COLOUR_W,
    parameter PIXEL_W    = 13  // bits of a pixel coordinate
) (
    input  wire                               clk,
    input  wire                               rst,
    input  wire [PIXEL_W-1:0]                 cfg_width,  // of the picture, pixels
    input  wire [PIXEL_W-1:0]                 cfg_height,
    input  wire [$clog2(CHUNK):0]             cfg_first,  // most entries of a tile's first batch; holds over a tile

    // tile: pixel origin; entry: its table, a list stream
    input  wire                               tile_valid,
    output wire                               tile_ready,
    input  wire [PIXEL_W-1:0]                 tile_x,
    input  wire [PIXEL_W-1:0]                 tile_y,
    input  wire                               entry_valid,
    output wire                               entry_ready,
    input  wire                               entry_last,
    input  wire [ENTRY_W-1:0]                 entry_word,

    // feat_req, feat: a record for each request, in order
    input  wire                               feat_valid,
    output wire                               feat_ready,
    input  wire [RECORD_W-1:0]                feat_record,
    output wire                               feat_req_valid,
    input  wire                               feat_req_ready,
    output wire [INDEX_W-1:0]                 feat_req_index,

    // upd: the table in order of the fresh keys, a block stream whose blocks are the batches
    output wire                               upd_valid,
    input  wire                               upd_ready,
    output wire [ENTRY_W-1:0]                 upd_word,
    output wire [$clog2(CHUNK):0]             upd_len,
    output wire                               upd_last,

    // test: the batch to be tested holds until the pulse test_issued
    output wire                               test_valid,
    output wire [$clog2(CHUNK):0]             test_n,
    output wire                               test_last,  // the tile's last batch
    output wire [PIXEL_W-1:0]                 test_x,
    output wire [PIXEL_W-1:0]                 test_y,
    input  wire                               test_issued,

    // cand: of the batch to be tested, as gs_candidate_matrix gives them
    input  wire                               cand_en,
    input  wire [$clog2(GROUPS)-1:0]          cand_group,
    input  wire [$clog2(CHUNK)-5:0]           cand_block,
    output wire [15:0]                        cand_bits,

    // geometry: and the slot of a position in the order of keys, two cycles behind it
    input  wire                               geometry_en,
    input  wire [$clog2(CHUNK)-1:0]           geometry_pos,
    output wire [GEOMETRY_W-1:0]              geometry,
    output reg  [$clog2(CHUNK)-1:0]           geometry_slot,

    // hit: result of a test; hits_over: with the last one of a batch or behind it
    input  wire                               hit_valid,
    input  wire                               hit_any,
    input  wire [$clog2(CHUNK)-1:0]           hit_slot,
    input  wire                               hits_over,

    // blend: origin of the oldest batch that is not blended; blend_done: now it is; feature one cycle behind its slot
    output wire [PIXEL_W-1:0]                 blend_x,
    output wire [PIXEL_W-1:0]                 blend_y,
    input  wire                               blend_done,
    input  wire                               feature_en,
    input  wire [1:0]                         feature_bank,
    input  wire [$clog2(CHUNK)-1:0]           feature_slot,
    output wire [GEOMETRY_W+3*COLOUR_W-1:0]   feature
);

    localparam SLOT_W    = $clog2(CHUNK);
    localparam FEATURE_W = GEOMETRY_W + 3*COLOUR_W;
    localparam WORD_W    = KEY_W + INDEX_W;
    localparam FIND      = 10;  // latency of gs_group_finder
    localparam [SLOT_W:0] ONE  = 1;
    localparam [SLOT_W:0] NONE = 0;
    localparam [SLOT_W:0] FULL = CHUNK;

    function [1:0] behind;  // the bank that is used next
        input [1:0] bank;
        begin
            behind = bank[1] ? 2'd0 : bank + 2'd1;
        end
    endfunction

    reg [2:0] closed;
    reg [2:0] loaded;
    reg [2:0] ready;
    reg [2:0] issued;
    reg [2:0] over;
    reg [2:0] blended;
    reg [2:0] written;
    wire [2:0] free = blended & written;

    // What the batch of each bank is.
    reg [SLOT_W:0]      bank_n  [0:2];
    reg [2:0]           bank_last;
    reg [2*PIXEL_W-1:0] bank_xy [0:2];  // {x, y}

    // Entries: taken into fill_bank, each with a request.
    reg                 tile_held;
    reg [2*PIXEL_W-1:0] held_xy;
    reg                 held_first;  // no batch of the tile has been closed
    reg [1:0]           fill_bank;
    reg [SLOT_W:0]      fill_n;
    wire                req_room;
    wire                fill_go   = tile_held && !closed[fill_bank] && req_room;
    wire                take      = entry_valid && fill_go && !entry_last;
    wire                take_end  = entry_valid && fill_go && entry_last;
    wire [SLOT_W:0]     fill_next = fill_n + ONE;
    wire                close     = take_end || (take && fill_next == (held_first ? cfg_first : FULL));
    assign tile_ready  = !tile_held;
    assign entry_ready = fill_go;

    gs_skid #(.WIDTH(INDEX_W)) req_skid (
        .clk(clk), .rst(rst),
        .in_valid(take), .in_ready(req_room), .in_data(entry_word[INDEX_W-1:0]),
        .out_valid(feat_req_valid), .out_ready(feat_req_ready), .out_data(feat_req_index)
    );

    always @(posedge clk) begin
        if (tile_valid && tile_ready) {tile_held, held_first, held_xy} <= {2'b11, tile_x, tile_y};
        if (take_end) tile_held <= 1'b0;
        if (take) fill_n <= fill_next;
        if (take || close) bank_xy[fill_bank] <= held_xy;
        if (close) begin
            held_first <= 1'b0;
            fill_n     <= NONE;
            fill_bank  <= behind(fill_bank);
            bank_n[fill_bank]    <= take ? fill_next : fill_n;
            bank_last[fill_bank] <= entry_last;
        end
        if (rst) {tile_held, fill_bank, fill_n} <= {3'b000, NONE};
    end

    // Records: written in the order of the requests. When a batch is whole, this cycle's record is the next batch's.
    reg  [1:0]        feat_gap;  // records of the last two cycles
    reg  [1:0]        record_bank;
    reg  [SLOT_W:0]   record_n;
    wire              feat_go   = feat_valid && feat_ready;
    wire              whole     = closed[record_bank] && !loaded[record_bank] && record_n == bank_n[record_bank];
    wire [1:0]        to_bank   = whole ? behind(record_bank) : record_bank;
    wire [SLOT_W:0]   to_slot   = record_n & {SLOT_W+1{!whole}};
    wire [SLOT_W+1:0] to_record = {to_bank, to_slot[SLOT_W-1:0]};
    assign feat_ready = feat_gap == 2'b00;
    always @(posedge clk) begin
        feat_gap    <= {feat_gap[0], feat_go};
        record_bank <= to_bank;
        record_n    <= to_slot + {{SLOT_W{1'b0}}, feat_go};
        if (rst) {feat_gap, record_bank, record_n} <= {4'b0000, NONE};
    end

    wire [PIXEL_W-1:0] find_x;
    wire [PIXEL_W-1:0] find_y;
    wire               find_valid;
    wire [GROUPS-1:0]  find_mask;
    assign {find_x, find_y} = bank_xy[to_bank];
    gs_group_finder group_finder (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height),
        .in_valid(feat_go), .in_geometry(feat_record[GEOMETRY_W-1:0]), .in_x0(find_x), .in_y0(find_y),
        .out_valid(find_valid), .out_mask(find_mask)
    );
    reg [FIND*(SLOT_W+2)-1:0] find_at;  // where the masks belong, newest on top
    always @(posedge clk) find_at <= {to_record, find_at[FIND*(SLOT_W+2)-1:SLOT_W+2]};

    // In order: to the candidates, to the tester, and back
    wire              order_valid;
    wire [1:0]        order_bank;
    wire [SLOT_W-1:0] order_slot;
    wire              order_last;
    reg  [1:0]        test_bank;
    wire [SLOT_W-1:0] test_slot;
    wire              out_read;
    reg  [1:0]        out_bank;
    reg  [SLOT_W:0]   out_pos;
    wire [WORD_W-1:0] out_word;
    wire [SLOT_W-1:0] out_slot;
    gs_late_sorter #(.CHUNK(CHUNK)) late_sorter (
        .clk(clk), .rst(rst), .cfg_first(cfg_first),
        .index_valid(take), .index_bank(fill_bank), .index_slot(fill_n[SLOT_W-1:0]), .index(entry_word[INDEX_W-1:0]),
        .key_valid(feat_go), .key_bank(to_bank), .key_slot(to_slot[SLOT_W-1:0]), .key(feat_record[FEATURE_W +: KEY_W]),
        .batch_known(closed), .batch_n({bank_n[2], bank_n[1], bank_n[0]}), .batch_last(bank_last), .batch_free(free),
        .order_valid(order_valid), .order_bank(order_bank), .order_slot(order_slot), .order_last(order_last),
        .test_en(geometry_en), .test_bank(test_bank), .test_pos(geometry_pos), .test_slot(test_slot),
        .out_en(out_read), .out_bank(out_bank), .out_pos(out_pos[SLOT_W-1:0]), .out_word(out_word), .out_slot(out_slot)
    );

    // Candidates, in order. Two batches are at least two cycles apart, so that mask_bank holds for done.
    reg               mask_valid;
    reg               mask_last;
    reg  [1:0]        mask_bank;
    wire [GROUPS-1:0] mask_bits;
    wire              mask_done;
    always @(posedge clk) begin
        mask_valid <= order_valid && !rst;
        mask_last  <= order_last;
        if (order_valid) mask_bank <= order_bank;
    end
    gs_ram #(.WIDTH(GROUPS), .DEPTH(3*CHUNK)) mask_ram (
        .clk(clk), .wr_en(find_valid), .wr_addr(find_at[SLOT_W+1:0]), .wr_data(find_mask),
        .rd_en(order_valid), .rd_addr({order_bank, order_slot}), .rd_data(mask_bits)
    );
    gs_candidate_matrix #(.CHUNK(CHUNK), .GROUPS(GROUPS)) candidate_matrix (
        .clk(clk), .rst(rst),
        .mask_valid(mask_valid), .mask_bits(mask_bits), .mask_bank(mask_bank), .mask_last(mask_last),
        .cand_en(cand_en), .cand_bank(test_bank), .cand_group(cand_group), .cand_block(cand_block),
        .cand_bits(cand_bits), .done(mask_done)
    );

    // What tester and blender read
    reg               g1_en;
    reg  [1:0]        g1_bank;
    reg  [1:0]        hit_bank;
    reg  [1:0]        blend_bank;
    always @(posedge clk) begin
        g1_en   <= geometry_en;
        g1_bank <= test_bank;
        if (g1_en)       geometry_slot <= test_slot;
        if (test_issued) test_bank  <= behind(test_bank);
        if (hits_over)   hit_bank   <= behind(hit_bank);
        if (blend_done)  blend_bank <= behind(blend_bank);
        if (rst) {test_bank, hit_bank, blend_bank} <= 6'd0;
    end
    gs_ram #(.WIDTH(GEOMETRY_W), .DEPTH(3*CHUNK)) geometry_ram (
        .clk(clk), .wr_en(feat_go), .wr_addr(to_record), .wr_data(feat_record[GEOMETRY_W-1:0]),
        .rd_en(g1_en), .rd_addr({g1_bank, test_slot}), .rd_data(geometry)
    );
    gs_ram #(.WIDTH(FEATURE_W), .DEPTH(3*CHUNK)) feature_ram (
        .clk(clk), .wr_en(feat_go), .wr_addr(to_record), .wr_data(feat_record[FEATURE_W-1:0]),
        .rd_en(feature_en), .rd_addr({feature_bank, feature_slot}), .rd_data(feature)
    );
    assign test_valid = ready[test_bank] && !issued[test_bank];
    assign test_n     = bank_n[test_bank];
    assign test_last  = bank_last[test_bank];
    assign {test_x, test_y}   = bank_xy[test_bank];
    assign {blend_x, blend_y} = bank_xy[blend_bank];

    // Write-back: a tested batch is read one position a cycle, then the slot's hits; an empty batch is one beat.
    reg               out_all;  // every position has been read
    reg               w1_valid;
    reg               w1_end;
    reg               w2_valid;
    reg               w2_end;
    reg  [WORD_W-1:0] w2_word;
    wire              w2_ready;
    wire [2:0]        any;
    wire              out_go   = w2_ready || !w2_valid;
    wire              out_more = over[out_bank] && !written[out_bank] && !out_all;
    wire [SLOT_W:0]   out_next = out_pos + ONE;
    wire [SLOT_W:0]   out_n    = bank_n[out_bank];
    assign            out_read = out_more && out_go;
    wire              out_end  = out_n == NONE || out_next == out_n;
    wire              out_over = w2_valid && w2_ready && w2_end;
    always @(posedge clk) begin
        if (out_go) {w1_valid, w1_end} <= {out_more, out_end};
        if (out_go) {w2_valid, w2_end, w2_word} <= {w1_valid, w1_end, out_word};
        if (out_read) {out_all, out_pos} <= {out_end, out_end ? NONE : out_next};
        if (out_over) {out_all, out_bank} <= {1'b0, behind(out_bank)};
        if (rst) {w1_valid, w2_valid, out_all, out_bank, out_pos} <= {5'd0, NONE};
    end
    gs_skid #(.WIDTH(ENTRY_W + SLOT_W + 2)) upd_skid (
        .clk(clk), .rst(rst),
        .in_valid(w2_valid), .in_ready(w2_ready), .in_data({bank_last[out_bank], out_n, !any[out_bank], w2_word}),
        .out_valid(upd_valid), .out_ready(upd_ready), .out_data({upd_last, upd_len, upd_word})
    );

    // Hits, cleared with the entry
    genvar b;
    generate
        for (b = 0; b < 3; b = b + 1) begin : g_bank
            wire fills = take && fill_bank == b;
            wire hits  = hit_valid && hit_any && hit_bank == b;
            gs_ram #(.WIDTH(1), .DEPTH(CHUNK)) any_ram (
                .clk(clk), .wr_en(fills || hits), .wr_addr(hits ? hit_slot : fill_n[SLOT_W-1:0]), .wr_data(hits),
                .rd_en(out_go && out_bank == b), .rd_addr(out_slot), .rd_data(any[b])
            );
        end
    endgenerate

    // The marks
    always @(posedge clk) begin
        if (close)       closed[fill_bank]    <= 1'b1;
        if (whole)       loaded[record_bank]  <= 1'b1;
        if (mask_done)   ready[mask_bank]     <= 1'b1;
        if (take_end && fill_n == NONE) ready[fill_bank] <= 1'b1;
        if (test_issued) issued[test_bank]    <= 1'b1;
        if (hits_over)   over[hit_bank]       <= 1'b1;
        if (blend_done)  blended[blend_bank]  <= 1'b1;
        if (out_over)    written[out_bank]    <= 1'b1;
        if (rst || free[0]) {closed[0], loaded[0], ready[0], issued[0], over[0], blended[0], written[0]} <= 7'd0;
        if (rst || free[1]) {closed[1], loaded[1], ready[1], issued[1], over[1], blended[1], written[1]} <= 7'd0;
        if (rst || free[2]) {closed[2], loaded[2], ready[2], issued[2], over[2], blended[2], written[2]} <= 7'd0;
    end

    wire unused_ok = &{1'b0, entry_word[ENTRY_W-1:INDEX_W], feat_record, to_slot[SLOT_W]};

endmodule

`default_nettype wire
