// gs_block_buffer: cuts a list stream into blocks and shows the length of a block at its first beat.
//
//   1 entry a cycle on both sides; the beat that closes a block is taken at t, the block's first beat leaves at t + 1
//   in_ready is registers only; out_ready reaches the memory's read enable
//
//   The memory is one ring of DEPTH words: while a block leaves, the next one takes the words it frees. So an entry a
//   cycle flows without a second bank, as long as the sink takes one.

`default_nettype none
`include "gs_params.vh"

module gs_block_buffer #(
    parameter WIDTH = `GS_ENTRY_W,
    parameter DEPTH = `GS_CHUNK      // entries in a block; a power of two, at least 2
) (
    input  wire                   clk,
    input  wire                   rst,

    // in: list stream, entry beats and one end beat without an entry
    input  wire                   in_valid,
    output wire                   in_ready,
    input  wire [WIDTH-1:0]       in_data,
    input  wire                   in_last,

    // out: block stream, len and last are constant over a block; len 0 is one beat without an entry
    output wire                   out_valid,
    input  wire                   out_ready,
    output wire [WIDTH-1:0]       out_data,
    output wire [$clog2(DEPTH):0] out_len,
    output wire                   out_last
);

    localparam ADDR_W = $clog2(DEPTH);
    localparam [ADDR_W:0] ONE = 1;

    generate
        if (DEPTH < 2 || DEPTH != (1 << ADDR_W)) begin : g_depth
            DEPTH_must_be_a_power_of_two_of_at_least_2 bad ();
        end
    endgenerate

    // Memory words [rd_addr, wr_addr) hold entries; the wrap bits tell full from empty. The oldest entry waits in the
    // memory's output register, which therefore counts as one word more; a block that leaves always finds one there.
    reg  [ADDR_W:0] wr_addr;
    reg  [ADDR_W:0] rd_addr;
    reg             head_valid;
    wire            full = (wr_addr[ADDR_W-1:0] == rd_addr[ADDR_W-1:0]) && (wr_addr[ADDR_W] != rd_addr[ADDR_W]);

    // The block that fills, and the block that leaves. A closed block waits while the one before it leaves.
    reg  [ADDR_W:0] fill_len;
    reg             closed;
    reg             closed_last;
    reg             leaving;
    reg  [ADDR_W:0] len;
    reg             last;
    reg  [ADDR_W:0] left;            // beats of the leaving block behind this one

    wire            in_go = in_valid && in_ready;
    wire            write = in_go && !in_last;
    wire [ADDR_W:0] fill_next = write ? fill_len + ONE : fill_len;
    wire            close = in_go && (in_last || fill_next[ADDR_W]);
    wire            out_go = out_valid && out_ready;
    wire            next_go = (closed || close) && (!leaving || (out_go && left == 0));
    wire            read = (wr_addr != rd_addr) && (!head_valid || (out_go && len != 0));

    assign in_ready  = !closed && !full;
    assign out_valid = leaving;
    assign out_len   = len;
    assign out_last  = last;

    always @(posedge clk) begin
        if (write) wr_addr <= wr_addr + ONE;
        if (read) rd_addr <= rd_addr + ONE;
        if (read) head_valid <= 1'b1;
        else if (out_go && len != 0) head_valid <= 1'b0;

        fill_len <= next_go ? {ADDR_W + 1{1'b0}} : fill_next;
        closed   <= (closed || close) && !next_go;
        if (close) closed_last <= in_last;

        if (next_go) leaving <= 1'b1;
        else if (out_go && left == 0) leaving <= 1'b0;
        if (next_go) len <= fill_next;
        if (next_go) last <= closed ? closed_last : in_last;
        if (next_go) left <= (fill_next == 0) ? {ADDR_W + 1{1'b0}} : fill_next - ONE;
        else if (out_go) left <= left - ONE;

        if (rst) begin
            wr_addr    <= {ADDR_W + 1{1'b0}};
            rd_addr    <= {ADDR_W + 1{1'b0}};
            head_valid <= 1'b0;
            fill_len   <= {ADDR_W + 1{1'b0}};
            closed     <= 1'b0;
            leaving    <= 1'b0;
        end
    end

    gs_ram #(
        .WIDTH(WIDTH),
        .DEPTH(DEPTH)
    ) ram (
        .clk(clk),
        .wr_en(write),
        .wr_addr(wr_addr[ADDR_W-1:0]),
        .wr_data(in_data),
        .rd_en(read),
        .rd_addr(rd_addr[ADDR_W-1:0]),
        .rd_data(out_data)
    );

endmodule

`default_nettype wire
