// gs_batch_buffer: holds two batches of a table: one is loaded while the other is tested, blended and written back.
//
//   one entry a cycle in and out; feat_ready is always high; entry_ready and tile_ready are registers' functions only
//
//   A batch passes these marks, each a bit per bank: closed (its entries are known), loaded (its records are here),
//   issued (all its tests have begun), tested (all have ended), blended, written. All of them free the bank.

`default_nettype none
`include "gs_params.vh"

module gs_batch_buffer #(
    parameter CHUNK      = `GS_CHUNK,
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

    // tile: pixel origin
    input  wire                               tile_valid,
    output wire                               tile_ready,
    input  wire [PIXEL_W-1:0]                 tile_x,
    input  wire [PIXEL_W-1:0]                 tile_y,

    // entry: the tile's table, a list stream
    input  wire                               entry_valid,
    output wire                               entry_ready,
    input  wire                               entry_last,
    input  wire [ENTRY_W-1:0]                 entry_word,

    // feat: a record for each request, in order
    input  wire                               feat_valid,
    output wire                               feat_ready,
    input  wire [RECORD_W-1:0]                feat_record,

    // feat_req
    output wire                               feat_req_valid,
    input  wire                               feat_req_ready,
    output wire [INDEX_W-1:0]                 feat_req_index,

    // upd: the table again with fresh keys, a block stream whose blocks are the batches
    output wire                               upd_valid,
    input  wire                               upd_ready,
    output wire [ENTRY_W-1:0]                 upd_word,
    output wire [$clog2(CHUNK):0]             upd_len,
    output wire                               upd_last,

    // test: the batch to be tested holds until the pulse test_issued; geometry one cycle behind its slot
    output wire                               test_valid,
    output wire [$clog2(CHUNK):0]             test_n,
    output wire [PIXEL_W-1:0]                 test_x,
    output wire [PIXEL_W-1:0]                 test_y,
    input  wire                               test_issued,
    input  wire                               geometry_en,
    input  wire [$clog2(CHUNK)-1:0]           geometry_slot,
    output wire [GEOMETRY_W-1:0]              geometry,

    // hit: was the entry of this slot hit in this group? hit_first: first group; hit_last: last slot of the last group
    input  wire                               hit_valid,
    input  wire                               hit_any,
    input  wire                               hit_first,
    input  wire                               hit_last,
    input  wire [$clog2(CHUNK)-1:0]           hit_slot,

    // blend: the batch to be blended holds until the pulse blend_done; feature one cycle behind its slot
    output wire                               blend_valid,
    output wire [$clog2(CHUNK):0]             blend_n,
    output wire                               blend_last,  // the tile's last batch
    output wire [PIXEL_W-1:0]                 blend_x,
    output wire [PIXEL_W-1:0]                 blend_y,
    input  wire                               blend_done,
    input  wire                               feature_en,
    input  wire [$clog2(CHUNK)-1:0]           feature_slot,
    output wire [GEOMETRY_W+3*COLOUR_W-1:0]   feature
);

    localparam SLOT_W    = $clog2(CHUNK);
    localparam FEATURE_W = GEOMETRY_W + 3*COLOUR_W;
    localparam [SLOT_W-1:0] SLOT_MAX = {SLOT_W{1'b1}};

    generate
        if (1 << SLOT_W != CHUNK) begin : g_rule
            CHUNK_must_be_a_power_of_two bad ();
        end
    endgenerate

    reg [1:0] closed;
    reg [1:0] loaded;
    reg [1:0] issued;
    reg [1:0] tested;
    reg [1:0] blended;
    reg [1:0] written;

    // What the batch of each bank is.
    reg [SLOT_W:0]    bank_n    [0:1];
    reg [1:0]         bank_last;
    reg [PIXEL_W-1:0] bank_x    [0:1];
    reg [PIXEL_W-1:0] bank_y    [0:1];

    // Entries: taken into fill_bank, each with a request.
    reg               tile_held;
    reg [PIXEL_W-1:0] held_x;
    reg [PIXEL_W-1:0] held_y;
    reg               fill_bank;
    reg [SLOT_W-1:0]  fill_n;
    wire              req_room;
    wire              fill_go  = tile_held && !closed[fill_bank] && req_room;
    wire              take     = entry_valid && fill_go && !entry_last;
    wire              take_end = entry_valid && fill_go && entry_last;
    wire              close    = take_end || (take && fill_n == SLOT_MAX);
    assign tile_ready  = !tile_held;
    assign entry_ready = fill_go;

    gs_skid #(.WIDTH(INDEX_W)) req_skid (
        .clk(clk), .rst(rst),
        .in_valid(take), .in_ready(req_room), .in_data(entry_word[INDEX_W-1:0]),
        .out_valid(feat_req_valid), .out_ready(feat_req_ready), .out_data(feat_req_index)
    );

    always @(posedge clk) begin
        if (tile_valid && tile_ready) tile_held <= 1'b1;
        if (tile_valid && tile_ready) held_x <= tile_x;
        if (tile_valid && tile_ready) held_y <= tile_y;
        if (take_end) tile_held <= 1'b0;
        if (take)  fill_n <= fill_n + {{SLOT_W-1{1'b0}}, 1'b1};
        if (close) fill_n <= {SLOT_W{1'b0}};
        if (close) fill_bank <= !fill_bank;
        if (close) bank_n[fill_bank] <= take ? {1'b1, {SLOT_W{1'b0}}} : {1'b0, fill_n};
        if (close) bank_last[fill_bank] <= entry_last;
        if (close) bank_x[fill_bank] <= held_x;
        if (close) bank_y[fill_bank] <= held_y;
        if (rst) begin
            tile_held <= 1'b0;
            fill_bank <= 1'b0;
            fill_n    <= {SLOT_W{1'b0}};
        end
    end

    // Records: written in the order of the requests. When a batch is whole, this cycle's record is the next batch's.
    reg             record_bank;
    reg  [SLOT_W:0] record_n;
    wire            whole     = closed[record_bank] && !loaded[record_bank] && record_n == bank_n[record_bank];
    wire            to_bank   = record_bank ^ whole;
    wire [SLOT_W:0] to_slot   = record_n & {SLOT_W+1{!whole}};
    wire [SLOT_W:0] to_record = {to_bank, to_slot[SLOT_W-1:0]};
    assign feat_ready = 1'b1;
    always @(posedge clk) begin
        record_bank <= to_bank;
        record_n    <= to_slot + {{SLOT_W{1'b0}}, feat_valid};
        if (rst) begin
            record_bank <= 1'b0;
            record_n    <= {SLOT_W+1{1'b0}};
        end
    end

    reg test_bank;
    gs_ram #(.WIDTH(GEOMETRY_W), .DEPTH(2*CHUNK)) geometry_ram (
        .clk(clk),
        .wr_en(feat_valid), .wr_addr(to_record), .wr_data(feat_record[GEOMETRY_W-1:0]),
        .rd_en(geometry_en), .rd_addr({test_bank, geometry_slot}), .rd_data(geometry)
    );
    reg blend_bank;
    gs_ram #(.WIDTH(FEATURE_W), .DEPTH(2*CHUNK)) feature_ram (
        .clk(clk),
        .wr_en(feat_valid), .wr_addr(to_record), .wr_data(feat_record[FEATURE_W-1:0]),
        .rd_en(feature_en), .rd_addr({blend_bank, feature_slot}), .rd_data(feature)
    );

    // Tests: one bit an entry gathers the hits of all groups, read in the cycle of the hit and written in the next.
    reg               hit_bank;
    reg               s1_valid;
    reg               s1_any;
    reg               s1_first;
    reg               s1_last;
    reg  [SLOT_W-1:0] s1_slot;
    wire [1:0]        old_any;
    wire              s1_now = s1_any || (!s1_first && old_any[hit_bank]);
    wire              hits_end  = s1_valid && s1_last;
    wire              no_hits   = loaded[hit_bank] && !tested[hit_bank] && bank_n[hit_bank] == {SLOT_W+1{1'b0}};
    wire              hits_over = hits_end || no_hits;
    always @(posedge clk) begin
        s1_valid <= hit_valid && !rst;
        s1_any   <= hit_any;
        s1_first <= hit_first;
        s1_last  <= hit_last;
        s1_slot  <= hit_slot;
        if (test_issued) test_bank <= !test_bank;
        if (hits_over)   hit_bank <= !hit_bank;
        if (blend_done)  blend_bank <= !blend_bank;
        if (rst) begin
            test_bank  <= 1'b0;
            hit_bank   <= 1'b0;
            blend_bank <= 1'b0;
        end
    end
    assign test_valid  = loaded[test_bank] && !issued[test_bank];
    assign test_n      = bank_n[test_bank];
    assign test_x      = bank_x[test_bank];
    assign test_y      = bank_y[test_bank];
    assign blend_valid = loaded[blend_bank] && !blended[blend_bank];
    assign blend_n     = bank_n[blend_bank];
    assign blend_last  = bank_last[blend_bank];
    assign blend_x     = bank_x[blend_bank];
    assign blend_y     = bank_y[blend_bank];

    // Write-back: a tested batch is read one slot a cycle; an empty one, always a tile's last, is one beat.
    reg               out_bank;
    reg               out_all;  // every slot has been read
    reg  [SLOT_W-1:0] out_slot;
    wire              out_more = tested[out_bank] && !written[out_bank] && !out_all;
    wire [SLOT_W:0]   out_next = {1'b0, out_slot} + {{SLOT_W{1'b0}}, 1'b1};
    wire              out_end  = bank_n[out_bank] == {SLOT_W+1{1'b0}} || out_next == bank_n[out_bank];
    wire              w1_ready;
    reg               w1_valid;
    reg               w1_end;
    wire              w1_go    = w1_ready || !w1_valid;
    wire              out_over = w1_valid && w1_ready && w1_end;
    always @(posedge clk) begin
        if (w1_go) w1_valid <= out_more;
        if (w1_go) w1_end <= out_end;
        if (out_more && w1_go) out_slot <= out_end ? {SLOT_W{1'b0}} : out_next[SLOT_W-1:0];
        if (out_more && w1_go) out_all <= out_end;
        if (out_over) out_all <= 1'b0;
        if (out_over) out_bank <= !out_bank;
        if (rst) begin
            w1_valid <= 1'b0;
            out_all  <= 1'b0;
            out_bank <= 1'b0;
            out_slot <= {SLOT_W{1'b0}};
        end
    end

    wire [INDEX_W-1:0] w1_index;
    gs_ram #(.WIDTH(INDEX_W), .DEPTH(2*CHUNK)) index_ram (
        .clk(clk),
        .wr_en(take), .wr_addr({fill_bank, fill_n}), .wr_data(entry_word[INDEX_W-1:0]),
        .rd_en(w1_go), .rd_addr({out_bank, out_slot}), .rd_data(w1_index)
    );
    wire [KEY_W-1:0] w1_key;
    gs_ram #(.WIDTH(KEY_W), .DEPTH(2*CHUNK)) key_ram (
        .clk(clk),
        .wr_en(feat_valid), .wr_addr(to_record), .wr_data(feat_record[FEATURE_W +: KEY_W]),
        .rd_en(w1_go), .rd_addr({out_bank, out_slot}), .rd_data(w1_key)
    );
    genvar b;
    generate
        for (b = 0; b < 2; b = b + 1) begin : g_any
            // A bank is never tested and written back at the same time.
            wire at_out = tested[b];
            gs_ram #(.WIDTH(1), .DEPTH(CHUNK)) any_ram (
                .clk(clk),
                .wr_en(s1_valid && hit_bank == b[0]), .wr_addr(s1_slot), .wr_data(s1_now),
                .rd_en(at_out ? w1_go : hit_valid), .rd_addr(at_out ? out_slot : hit_slot), .rd_data(old_any[b])
            );
        end
    endgenerate

    wire [SLOT_W:0] w1_n    = bank_n[out_bank];
    wire            w1_last = bank_last[out_bank];
    gs_skid #(.WIDTH(ENTRY_W + SLOT_W + 2)) upd_skid (
        .clk(clk), .rst(rst),
        .in_valid(w1_valid), .in_ready(w1_ready), .in_data({w1_last, w1_n, !old_any[out_bank], w1_key, w1_index}),
        .out_valid(upd_valid), .out_ready(upd_ready), .out_data({upd_last, upd_len, upd_word})
    );

    // The marks
    wire [1:0] free = issued & blended & written;
    always @(posedge clk) begin
        if (close)       closed[fill_bank]   <= 1'b1;
        if (whole)       loaded[record_bank] <= 1'b1;
        if (test_issued) issued[test_bank]   <= 1'b1;
        if (hits_over)   tested[hit_bank]    <= 1'b1;
        if (blend_done)  blended[blend_bank] <= 1'b1;
        if (out_over)    written[out_bank]   <= 1'b1;
        if (rst || free[0]) {closed[0], loaded[0], issued[0], tested[0], blended[0], written[0]} <= 6'd0;
        if (rst || free[1]) {closed[1], loaded[1], issued[1], tested[1], blended[1], written[1]} <= 6'd0;
    end

    wire unused_ok = &{1'b0, entry_word[ENTRY_W-1:INDEX_W], feat_record, to_slot[SLOT_W]};

endmodule

`default_nettype wire
