// gs_candidate_tester: tests the candidates of a batch group by group against four subtiles at once; hits go to four queues.
//
//   one candidate a cycle, one cycle for a word without any; first test 2 cycles behind test_valid; a hit arrives
//   LATENCY = 11 cycles behind the read of its geometry
//
//   W  words     of candidates, read ahead of the tests         2 cycles
//   R  read      geometry of the position                       2 cycles
//   T  test      gs_group_test_unit                             9 cycles
//
//   A test begins when each queue has room for its hit, a list is closed when each queue has room for its mark. A test
//   counts as a slot of each queue until its list is closed.

`default_nettype none
`include "gs_params.vh"

module gs_candidate_tester #(
    parameter CHUNK      = `GS_CHUNK,
    parameter UNITS      = `GS_UNITS,
    parameter GROUPS     = `GS_GROUPS,
    parameter SUBTILE    = `GS_SUBTILE,
    parameter QUEUE      = `GS_QUEUE,
    parameter MARKS      = `GS_MARKS,
    parameter GEOMETRY_W = `GS_GEOMETRY_W,
    parameter PIXEL_W    = 13  // bits of a pixel coordinate
) (
    input  wire                             clk,
    input  wire                             rst,
    input  wire [PIXEL_W-1:0]               cfg_width,   // of the picture, pixels
    input  wire [PIXEL_W-1:0]               cfg_height,

    // test: the batch holds until the pulse test_issued
    input  wire                             test_valid,
    input  wire [$clog2(CHUNK):0]           test_n,
    input  wire                             test_last,   // of its tile
    input  wire [PIXEL_W-1:0]               test_x,
    input  wire [PIXEL_W-1:0]               test_y,
    output wire                             test_issued,

    // cand: word of a group, bit i is entry 16*block + i; one cycle behind its address, holds until the next
    output wire                             cand_en,
    output wire [$clog2(GROUPS)-1:0]        cand_group,
    output wire [$clog2(CHUNK)-5:0]         cand_block,
    input  wire [15:0]                      cand_bits,

    // geometry: and the slot of a position, two cycles behind it
    output wire                             geometry_en,
    output wire [$clog2(CHUNK)-1:0]         geometry_pos,
    input  wire [GEOMETRY_W-1:0]            geometry,
    input  wire [$clog2(CHUNK)-1:0]         geometry_slot,

    // hit: result of each test; hits_over: with or behind the last one of a batch
    output wire                             hit_valid,
    output wire [UNITS-1:0]                 hit_units,   // 0 while hit_valid is low: each queue's push_valid
    output wire [$clog2(GROUPS)-1:0]        hit_group,
    output wire [$clog2(CHUNK)-1:0]         hit_slot,
    output wire                             hits_over,

    // close: a group's four lists, with the last hit or behind it; a batch without entries closes one void list
    output wire                             close,
    output wire                             close_void,
    output wire                             close_end,   // the tile's last one

    // used: of each queue, its complete lists
    input  wire [UNITS*($clog2(QUEUE)+1)-1:0] slot_used,
    input  wire [UNITS*($clog2(MARKS)+1)-1:0] mark_used
);

    localparam SLOT_W  = $clog2(CHUNK);
    localparam GROUP_W = $clog2(GROUPS);
    localparam BLOCK_W = SLOT_W - 4;
    localparam QUEUE_W = $clog2(QUEUE) + 1;
    localparam MARK_W  = $clog2(MARKS) + 1;
    localparam TEST    = 9;  // latency of gs_group_test_unit
    localparam LATENCY = 11;
    localparam SPAN_W  = 2 + $clog2(SUBTILE);  // bits of a pixel column in a group

    generate
        if (UNITS != 4 || GROUPS != 16 || SUBTILE != 8) begin : g_rule
            UNITS_must_be_4_and_GROUPS_16_and_SUBTILE_8 bad ();
        end
        if (CHUNK < 32 || CHUNK != (1 << SLOT_W)) begin : g_chunk_rule
            CHUNK_must_be_a_power_of_two_from_32_on bad ();
        end
        if (QUEUE < CHUNK || QUEUE != (1 << (QUEUE_W - 1)) || MARKS != (1 << (MARK_W - 1))) begin : g_queue_rule
            QUEUE_and_MARKS_must_be_powers_of_two_and_QUEUE_hold_a_CHUNK bad ();
        end
    endgenerate

    wire                empty = test_n == {SLOT_W+1{1'b0}};
    wire [SLOT_W:0]     top   = test_n - {{SLOT_W{1'b0}}, 1'b1};
    wire [BLOCK_W-1:0]  last_block = top[SLOT_W-1:4];

    // W words: `fetched` tells that cand_bits is the word behind `word`.
    reg                 fetched;
    reg                 walked;  // all words of the batch have been read
    reg  [GROUP_W-1:0]  walk_group;
    reg  [BLOCK_W-1:0]  walk_block;
    wire                load;
    wire                walk_end = walk_block == last_block;
    assign cand_en    = test_valid && !empty && !walked && (!fetched || load);
    assign cand_group = walk_group;
    assign cand_block = walk_block;
    always @(posedge clk) begin
        fetched <= cand_en || (fetched && !load);
        if (cand_en) walk_block <= walk_end ? {BLOCK_W{1'b0}} : walk_block + {{BLOCK_W-1{1'b0}}, 1'b1};
        if (cand_en && walk_end) walk_group <= walk_group + {{GROUP_W-1{1'b0}}, 1'b1};
        if (cand_en && walk_end && walk_group == {GROUP_W{1'b1}}) walked <= 1'b1;
        if (test_issued) walked <= 1'b0;
        if (rst) begin
            fetched    <= 1'b0;
            walked     <= 1'b0;
            walk_group <= {GROUP_W{1'b0}};
            walk_block <= {BLOCK_W{1'b0}};
        end
    end

    // Issue: the lowest candidate of the word that is left
    reg                 word_valid;
    reg  [15:0]         word;
    reg  [GROUP_W-1:0]  group;
    reg  [BLOCK_W-1:0]  block;
    wire                slot_room;
    wire                mark_room;
    wire [15:0]         rest      = word & (word - 16'd1);
    wire [15:0]         first     = word & ~rest;
    wire                any       = |word;
    wire                word_end  = rest == 16'd0;
    wire                group_end = word_end && block == last_block;
    wire                go        = word_valid && (slot_room || !any) && (mark_room || !group_end);
    wire                go_test   = go && any;
    wire                go_void   = test_valid && empty && mark_room;
    wire                go_batch  = go && group_end && group == {GROUP_W{1'b1}};
    wire                go_close  = (go && group_end) || go_void;
    assign load         = fetched && (!word_valid || (go && word_end));
    assign test_issued  = go_batch || go_void;
    assign geometry_en  = go_test;
    assign geometry_pos = {block, |(first & 16'hff00), |(first & 16'hf0f0), |(first & 16'hcccc), |(first & 16'haaaa)};
    always @(posedge clk) begin
        word_valid <= load || (word_valid && !(go && word_end));
        if (go)   word <= rest;
        if (load) word <= cand_bits;
        if (go && word_end)  block <= group_end ? {BLOCK_W{1'b0}} : block + {{BLOCK_W-1{1'b0}}, 1'b1};
        if (go && group_end) group <= group + {{GROUP_W-1{1'b0}}, 1'b1};
        if (rst) begin
            word_valid <= 1'b0;
            group      <= {GROUP_W{1'b0}};
            block      <= {BLOCK_W{1'b0}};
        end
    end

    // R read
    wire [PIXEL_W-1:0] group_x = {test_x[PIXEL_W-1:SPAN_W+1], group[0], {SPAN_W{1'b0}}};
    wire [PIXEL_W-1:0] group_y = {test_y[PIXEL_W-1:SPAN_W+1], group[GROUP_W-1:1], {SPAN_W-2{1'b0}}};
    reg                r1_valid;
    reg  [PIXEL_W-1:0] r1_x;
    reg  [PIXEL_W-1:0] r1_y;
    reg                r2_valid;
    reg  [PIXEL_W-1:0] r2_x;
    reg  [PIXEL_W-1:0] r2_y;
    always @(posedge clk) begin
        r1_valid <= go_test && !rst;
        r1_x     <= group_x;
        r1_y     <= group_y;
        r2_valid <= r1_valid && !rst;
        r2_x     <= r1_x;
        r2_y     <= r1_y;
    end

    // T test
    wire [UNITS-1:0] test_hits;
    gs_group_test_unit test_unit (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height),
        .in_valid(r2_valid), .in_x(r2_x), .in_y(r2_y), .in_geometry(geometry),
        .out_valid(hit_valid), .out_hits(test_hits)
    );
    reg [TEST*SLOT_W-1:0] slots;  // newest on top
    reg [LATENCY*4-1:0]   closes;
    reg [GROUP_W-1:0]     t_group;
    always @(posedge clk) begin
        slots  <= {geometry_slot, slots[TEST*SLOT_W-1:SLOT_W]};
        closes <= {go_void, (go_batch && test_last) || go_void, test_issued, go_close, closes[LATENCY*4-1:4]};
        if (close && !close_void) t_group <= t_group + {{GROUP_W-1{1'b0}}, 1'b1};
        if (rst) begin
            closes  <= {LATENCY*4{1'b0}};
            t_group <= {GROUP_W{1'b0}};
        end
    end
    assign hit_units = test_hits & {UNITS{hit_valid}};
    assign hit_group = t_group;
    assign hit_slot  = slots[SLOT_W-1:0];
    assign {close_void, close_end, hits_over, close} = closes[3:0];

    // Room: what has been begun and is not yet counted as used
    reg  [QUEUE_W-1:0] open_tests;  // tests of lists that are not closed
    reg  [MARK_W-1:0]  open_marks;  // marks under way
    reg  [QUEUE_W-1:0] results;     // of the oldest of these lists
    wire [QUEUE_W-1:0] results_now = results + {{QUEUE_W-1{1'b0}}, hit_valid};
    wire [QUEUE_W-1:0] closed      = close ? results_now : {QUEUE_W{1'b0}};
    always @(posedge clk) begin
        results    <= close ? {QUEUE_W{1'b0}} : results_now;
        open_tests <= open_tests + {{QUEUE_W-1{1'b0}}, go_test} - closed;
        open_marks <= open_marks + {{MARK_W-1{1'b0}}, go_close} - {{MARK_W-1{1'b0}}, close};
        if (rst) begin
            results    <= {QUEUE_W{1'b0}};
            open_tests <= {QUEUE_W{1'b0}};
            open_marks <= {MARK_W{1'b0}};
        end
    end
    wire [UNITS-1:0] slots_full;
    wire [UNITS-1:0] marks_full;
    genvar s;
    generate
        for (s = 0; s < UNITS; s = s + 1) begin : g_room
            wire [QUEUE_W-1:0] slot_sum = open_tests + slot_used[s*QUEUE_W +: QUEUE_W];
            wire [MARK_W-1:0]  mark_sum = open_marks + mark_used[s*MARK_W +: MARK_W];
            assign slots_full[s] = slot_sum[QUEUE_W-1];
            assign marks_full[s] = mark_sum[MARK_W-1];
            wire unused_sum_ok = &{1'b0, slot_sum[QUEUE_W-2:0], mark_sum[MARK_W-2:0]};
        end
    endgenerate
    assign slot_room = !(|slots_full);
    assign mark_room = !(|marks_full);

    wire unused_ok = &{1'b0, top[SLOT_W], top[3:0], test_x[SPAN_W:0], test_y[SPAN_W:0]};

endmodule

`default_nettype wire
