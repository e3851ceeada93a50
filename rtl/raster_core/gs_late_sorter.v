// gs_late_sorter: keeps the words {key, index} of three batches and puts each in order when its fresh keys are there.
//
//   takes an index and a key a cycle, gives a sorted entry a cycle; never stalls
//   cycles: golden/raster_core/late_sorter.py
//
//   A bank's memories hold its words as they come until the sorter has been given all of them (fed), then, from
//   position 0 on, in order: the sorter takes all of a batch before it gives the first.

`default_nettype none
`include "gs_params.vh"

module gs_late_sorter #(
    parameter CHUNK   = `GS_CHUNK,
    parameter INDEX_W = `GS_INDEX_W,
    parameter KEY_W   = `GS_KEY_W
) (
    input  wire                           clk,
    input  wire                           rst,
    input  wire [$clog2(CHUNK):0]         cfg_first,    // entries in a tile's first batch; holds over a tile

    // index, key: of each entry; a batch's keys come slot by slot and behind their indices, batches in turn
    input  wire                           index_valid,
    input  wire [1:0]                     index_bank,
    input  wire [$clog2(CHUNK)-1:0]       index_slot,
    input  wire [INDEX_W-1:0]             index,
    input  wire                           key_valid,
    input  wire [1:0]                     key_bank,
    input  wire [$clog2(CHUNK)-1:0]       key_slot,
    input  wire [KEY_W-1:0]               key,

    // batch of each bank: known (n holds), its entries, whether it is its tile's last; free: forget it
    input  wire [2:0]                     batch_known,
    input  wire [3*($clog2(CHUNK)+1)-1:0] batch_n,
    input  wire [2:0]                     batch_last,
    input  wire [2:0]                     batch_free,

    // order: the slots of a batch in the order of {key, index}
    output wire                           order_valid,
    output wire [1:0]                     order_bank,
    output wire [$clog2(CHUNK)-1:0]       order_slot,
    output wire                           order_last,   // of the batch

    // test, out: a sorted batch by position, one cycle behind it and until the next; at the same time of two banks only
    input  wire                           test_en,
    input  wire [1:0]                     test_bank,
    input  wire [$clog2(CHUNK)-1:0]       test_pos,
    output wire [$clog2(CHUNK)-1:0]       test_slot,
    input  wire                           out_en,
    input  wire [1:0]                     out_bank,
    input  wire [$clog2(CHUNK)-1:0]       out_pos,
    output wire [KEY_W+INDEX_W-1:0]       out_word,
    output wire [$clog2(CHUNK)-1:0]       out_slot
);

    localparam SLOT_W = $clog2(CHUNK);
    localparam WORD_W = KEY_W + INDEX_W;
    localparam SORT_W = 1 + WORD_W + SLOT_W;
    localparam WAIT_W = SLOT_W + 2;
    localparam [SLOT_W:0] ONE  = 1;
    localparam [SLOT_W:0] NONE = 0;

    function [1:0] behind;  // the bank that is used next
        input [1:0] bank;
        begin
            behind = bank[1] ? 2'd0 : bank + 2'd1;
        end
    endfunction

    reg  [2:0]         fed;
    reg  [2:0]         sorted;
    wire [WORD_W-1:0]  bank_word [0:2];
    wire [SLOT_W-1:0]  bank_slot [0:2];

    // To the sorter: the next word, or an end beat behind a tile's last one, waits in the memories' output registers.
    // The first of a tile asks for a command.
    reg  [WAIT_W-1:0]  waiting;    // keys whose words have not been read
    reg  [1:0]         feed_bank;
    reg  [SLOT_W:0]    feed_slot;
    reg                feed_open;  // a word of the tile has been read
    reg                cmd_valid;
    wire               cmd_ready;
    reg                head_valid;
    wire               head_ready;
    reg                head_last;
    reg  [1:0]         head_bank;
    reg  [SLOT_W-1:0]  head_slot;
    wire               head_go   = head_ready || !head_valid;
    wire [SLOT_W:0]    feed_next = feed_slot + ONE;
    wire [SLOT_W:0]    feed_n    = batch_n[feed_bank*(SLOT_W+1) +: SLOT_W+1];
    wire               feed_here = batch_known[feed_bank] && !fed[feed_bank];
    wire               feed_end  = feed_here && feed_n == feed_slot;  // behind a full batch's last word it has moved on
    wire               feed_full = feed_here && !batch_last[feed_bank] && feed_n == feed_next;
    wire               feed_some = feed_end || waiting != {WAIT_W{1'b0}};
    wire               feed_read = head_go && feed_some && !feed_end;
    wire               feed_over = head_go && (feed_end || (feed_some && feed_full));
    always @(posedge clk) begin
        waiting <= waiting + {{WAIT_W-1{1'b0}}, key_valid} - {{WAIT_W-1{1'b0}}, feed_read};
        if (head_go) head_valid <= feed_some;
        if (head_go) head_last  <= feed_end;
        if (head_go) head_bank  <= feed_bank;
        if (head_go) head_slot  <= feed_slot[SLOT_W-1:0];
        if (feed_read) feed_slot <= feed_next;
        if (feed_over) feed_slot <= NONE;
        if (feed_over) feed_bank <= behind(feed_bank);
        if (cmd_ready) cmd_valid <= 1'b0;
        if (head_go && feed_some) feed_open <= !feed_end;
        if (head_go && feed_some && !feed_open) cmd_valid <= 1'b1;
        if (rst) begin
            waiting    <= {WAIT_W{1'b0}};
            feed_bank  <= 2'd0;
            feed_slot  <= NONE;
            feed_open  <= 1'b0;
            cmd_valid  <= 1'b0;
            head_valid <= 1'b0;
        end
    end

    wire               none_ready;
    wire               sort_valid;
    wire               sort_last;
    wire [SORT_W-1:0]  sort_entry;
    gs_chunk_sorter #(.CHUNK(CHUNK), .ENTRY_W(SORT_W)) chunk_sorter (
        .clk(clk), .rst(rst),
        .cmd_valid(cmd_valid), .cmd_ready(cmd_ready), .cmd_merge(1'b0), .cmd_first(cfg_first),
        .a_valid(head_valid), .a_ready(head_ready), .a_last(head_last),
        .a_entry({1'b0, bank_word[head_bank], head_slot}),
        .b_valid(1'b1), .b_ready(none_ready), .b_last(1'b1), .b_entry({SORT_W{1'b0}}),
        .out_valid(sort_valid), .out_ready(1'b1), .out_last(sort_last), .out_entry(sort_entry)
    );

    // From the sorter. An empty batch is passed over.
    reg  [1:0]         sort_bank;
    reg  [SLOT_W:0]    sort_pos;
    wire [SLOT_W:0]    sort_next = sort_pos + ONE;
    wire [SLOT_W:0]    sort_n    = batch_n[sort_bank*(SLOT_W+1) +: SLOT_W+1];
    wire               sort_void = batch_known[sort_bank] && !sorted[sort_bank] && sort_n == NONE;
    wire               sort_over = order_last || sort_void;
    assign order_valid = sort_valid && !sort_last;
    assign order_bank  = sort_bank;
    assign order_slot  = sort_entry[SLOT_W-1:0];
    assign order_last  = order_valid && sort_next == sort_n;
    always @(posedge clk) begin
        if (order_valid) sort_pos <= sort_next;
        if (sort_over) sort_pos <= NONE;
        if (sort_over) sort_bank <= behind(sort_bank);
        if (feed_over) fed[feed_bank] <= 1'b1;
        if (sort_over) sorted[sort_bank] <= 1'b1;
        if (batch_free[0]) {fed[0], sorted[0]} <= 2'b00;
        if (batch_free[1]) {fed[1], sorted[1]} <= 2'b00;
        if (batch_free[2]) {fed[2], sorted[2]} <= 2'b00;
        if (rst) begin
            sort_pos  <= NONE;
            sort_bank <= 2'd0;
            fed       <= 3'b000;
            sorted    <= 3'b000;
        end
    end

    reg [1:0] s1_test_bank;
    reg [1:0] s1_out_bank;
    always @(posedge clk) begin
        if (test_en) s1_test_bank <= test_bank;
        if (out_en)  s1_out_bank  <= out_bank;
    end
    assign test_slot = bank_slot[s1_test_bank];
    assign out_word  = bank_word[s1_out_bank];
    assign out_slot  = bank_slot[s1_out_bank];

    genvar b;
    generate
        for (b = 0; b < 3; b = b + 1) begin : g_bank
            wire              sorts = order_valid && sort_bank == b;
            wire              outs  = out_en && out_bank == b;
            wire              feeds = feed_read && feed_bank == b;
            wire [SLOT_W-1:0] pos   = outs ? out_pos : feed_slot[SLOT_W-1:0];
            gs_ram #(.WIDTH(INDEX_W), .DEPTH(CHUNK)) index_ram (
                .clk(clk),
                .wr_en(sorts || (index_valid && index_bank == b)),
                .wr_addr(sorts ? sort_pos[SLOT_W-1:0] : index_slot),
                .wr_data(sorts ? sort_entry[SLOT_W +: INDEX_W] : index),
                .rd_en(outs || feeds), .rd_addr(pos), .rd_data(bank_word[b][INDEX_W-1:0])
            );
            gs_ram #(.WIDTH(KEY_W), .DEPTH(CHUNK)) key_ram (
                .clk(clk),
                .wr_en(sorts || (key_valid && key_bank == b)),
                .wr_addr(sorts ? sort_pos[SLOT_W-1:0] : key_slot),
                .wr_data(sorts ? sort_entry[SLOT_W+INDEX_W +: KEY_W] : key),
                .rd_en(outs || feeds), .rd_addr(pos), .rd_data(bank_word[b][WORD_W-1:INDEX_W])
            );
            gs_ram #(.WIDTH(SLOT_W), .DEPTH(CHUNK)) slot_ram (
                .clk(clk),
                .wr_en(sorts), .wr_addr(sort_pos[SLOT_W-1:0]), .wr_data(sort_entry[SLOT_W-1:0]),
                .rd_en(outs || (test_en && test_bank == b)), .rd_addr(outs ? out_pos : test_pos), .rd_data(bank_slot[b])
            );
        end
    endgenerate

    wire unused_ok = &{1'b0, none_ready, sort_entry[SORT_W-1]};

endmodule

`default_nettype wire
