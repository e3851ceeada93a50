// gs_axi_block_writer: packs a block stream into a table in memory.
//
//   One entry a cycle, also from list to list, as long as AW and W are ready. A block's AW follows its first entry by
//   one cycle (and two, across a 4 KB border); a W beat follows the entry that fills it by one cycle, a list's
//   last one by two when it is not full. done: two cycles after the last entry (none: after the block of
//   length 0), or one after the last B. A cmd is taken with the first beat of its list.
//   blk_ready sees m_axi_awready and m_axi_wready combinationally, cmd_ready also blk_valid.
//
//   Entries lie in memory in whole bytes, packed. Every block but the final one of a list holds a multiple of eight
//   entries (gs_block_buffer: always 256).

`default_nettype none
`include "gs_params.vh"

module gs_axi_block_writer #(
    parameter ENTRY_W = `GS_ENTRY_W,
    parameter ADDR_W  = 32,
    parameter N_W     = 24,
    parameter DONES   = 2               // lists that may wait for their B responses
) (
    input  wire               clk,
    input  wire               rst,

    // cmd: where the next list goes, a multiple of 8 bytes
    input  wire               cmd_valid,
    output wire               cmd_ready,
    input  wire [ADDR_W-1:0]  cmd_addr,

    // blk: blocks of up to 256 entries
    input  wire               blk_valid,
    output wire               blk_ready,
    input  wire [ENTRY_W-1:0] blk_entry,
    input  wire [8:0]         blk_len,
    input  wire               blk_last,

    // m_axi: one or two INCR bursts of 64-bit beats a block
    output wire               m_axi_awvalid,
    input  wire               m_axi_awready,
    output wire [ADDR_W-1:0]  m_axi_awaddr,
    output wire [7:0]         m_axi_awlen,
    output wire [2:0]         m_axi_awsize,
    output wire [1:0]         m_axi_awburst,
    output wire               m_axi_wvalid,
    input  wire               m_axi_wready,
    output wire [63:0]        m_axi_wdata,
    output wire [7:0]         m_axi_wstrb,
    output wire               m_axi_wlast,
    input  wire               m_axi_bvalid,
    output wire               m_axi_bready,
    input  wire [1:0]         m_axi_bresp,

    // done: the list is in memory; n entries
    output wire               done_valid,
    input  wire               done_ready,
    output wire [N_W-1:0]     done_n,

    // status: a burst was answered with SLVERR or DECERR; stays until rst
    output wire               error
);

    localparam LINE_W = ADDR_W - 3;             // an address in beats
    localparam BYTES  = (ENTRY_W + 7) / 8;      // of an entry in memory
    localparam [12:0] ENTRY_SIZE = BYTES;
    localparam [3:0]  ENTRY_STEP = BYTES[3:0];

    generate
        if (ENTRY_W > 64) begin : g_illegal
            ENTRY_W_must_be_64_at_most bad ();
        end
    endgenerate

    // A beat is taken when W moves and a list may end; a block's first also needs AW, a list's first its cmd
    reg        in_list;
    reg        in_block;
    reg  [7:0] block_left;                      // entries of the block behind the next one
    reg        flush;                           // the upper part of a list's last entry waits in rest
    reg        w_valid;
    wire       aw_free;
    wire       fin_ready;
    wire       w_go    = (m_axi_wready || !w_valid) && fin_ready;
    wire       empty   = blk_len == 9'd0;
    wire       open_go = aw_free && !(flush && empty);
    wire       take    = blk_valid && blk_ready;
    wire       open    = take && !in_block;     // a block begins
    wire       start   = open && !in_list;      // a list begins
    wire       entry   = take && !empty;
    wire       close   = in_block ? block_left == 8'd0 : blk_len[8:1] == 8'd0;  // 1 entry or none: the block ends

    assign blk_ready = w_go && (in_block || (open_go && (in_list || cmd_valid)));
    assign cmd_ready = w_go && !in_block && !in_list && open_go && blk_valid;

    always @(posedge clk) begin
        if (take) in_list    <= !(close && blk_last);
        if (take) in_block   <= !close;
        if (take) block_left <= in_block ? block_left - 8'd1 : blk_len[7:0] - 8'd2;    // 256 - 2 fits in 8 bits
        if (rst) in_list  <= 1'b0;
        if (rst) in_block <= 1'b0;
    end

    // W: rest holds the `have` bytes of entries that fill no beat yet, and zeros above them
    reg  [2:0]         have;
    reg  [55:0]        rest;
    reg  [63:0]        w_data;
    reg                w_last;
    reg  [8:0]         w_pos;                   // of the next beat in its 4 KB
    wire [3:0]         with_it  = {1'b0, have} + ENTRY_STEP;
    wire [119:0]       joined   = {64'd0, rest & {56{have != 3'd0}}}
                                | ({{120-ENTRY_W{1'b0}}, blk_entry} << {have, 3'd0});
    wire               even     = with_it[2:0] == 3'd0;         // the entry ends with a beat
    wire               w_put    = flush || (entry && with_it[3]);
    wire               w_last_d = flush || (close && even) || (&w_pos);

    assign m_axi_wvalid = w_valid;
    assign m_axi_wdata  = w_data;
    assign m_axi_wstrb  = 8'hff;
    assign m_axi_wlast  = w_last;

    always @(posedge clk) begin
        if (entry) begin
            have <= close ? 3'd0 : with_it[2:0];
            rest <= with_it[3] ? joined[119:64] : joined[55:0];
        end
        if (w_go) begin
            w_valid <= w_put;
            w_last  <= w_last_d;
            w_data  <= flush ? {8'd0, rest} : joined[63:0];
            flush   <= entry && close && !even;
        end else if (m_axi_wready) begin
            w_valid <= 1'b0;
        end
        if (start) w_pos <= cmd_addr[11:3];
        else if (w_go && w_put) w_pos <= w_pos + 9'd1;
        if (rst) begin
            have    <= 3'd0;
            w_valid <= 1'b0;
            flush   <= 1'b0;
        end
    end

    // AW: aw_left beats from aw_line; behind a block aw_line is where the next one goes
    reg               aw_valid;
    reg  [LINE_W-1:0] aw_line;
    reg  [8:0]        aw_left;
    wire [9:0]        aw_room  = 10'd512 - {1'b0, aw_line[8:0]};
    wire              aw_final = {1'b0, aw_left} <= aw_room;
    wire [8:0]        aw_beats = aw_final ? aw_left : aw_room[8:0];
    wire [8:0]        aw_len   = aw_beats - 9'd1;
    wire [LINE_W-1:0] aw_next  = aw_line + {{LINE_W-9{1'b0}}, aw_beats};
    wire [12:0]       bytes    = {4'd0, blk_len} * ENTRY_SIZE + 13'd7;  // rounded up to beats

    assign aw_free       = !aw_valid || (m_axi_awready && aw_final);
    assign m_axi_awvalid = aw_valid;
    assign m_axi_awaddr  = {aw_line, 3'd0};
    assign m_axi_awlen   = aw_len[7:0];
    assign m_axi_awsize  = 3'd3;
    assign m_axi_awburst = 2'b01;

    always @(posedge clk) begin
        if (aw_valid && m_axi_awready) begin
            aw_valid <= !aw_final;
            aw_line  <= aw_next;
            aw_left  <= aw_left - aw_beats;
        end
        if (open && !empty) begin
            aw_valid <= 1'b1;
            aw_left  <= bytes[11:3];
        end
        if (start) aw_line <= cmd_addr[ADDR_W-1:3];
        if (rst) aw_valid <= 1'b0;
    end

    // The list's end goes to the answers with its last W beat, or alone behind a block of length 0
    reg  [N_W-1:0] count;
    wire [N_W-1:0] count_d = (start ? {N_W{1'b0}} : count) + {{N_W-1{1'b0}}, entry};
    wire           fin_now = take && close && blk_last && (empty || even);

    always @(posedge clk) if (take) count <= count_d;

    gs_axi_answers #(
        .N_W(N_W),
        .CNT_W(N_W - 4),
        .DONES(DONES)
    ) u_answers (
        .clk(clk),
        .rst(rst),
        .burst(w_go && w_put && w_last_d),
        .fin_valid(fin_now || (flush && w_go)),
        .fin_ready(fin_ready),
        .fin_n(flush ? count : count_d),
        .m_axi_bvalid(m_axi_bvalid),
        .m_axi_bready(m_axi_bready),
        .m_axi_bresp(m_axi_bresp),
        .done_valid(done_valid),
        .done_ready(done_ready),
        .done_n(done_n),
        .error(error)
    );

    wire unused_ok = &{1'b0, cmd_addr[2:0], bytes, aw_room[9], aw_len[8]};

endmodule

`default_nettype wire
