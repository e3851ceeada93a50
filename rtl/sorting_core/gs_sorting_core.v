// gs_sorting_core: repairs one table chunk by chunk and merges it with a sorted list, or merges two sorted lists.
//
//   a gs_chunk_sorter, which has the commands and their cycles, and a gs_block_buffer behind it
//   one command is one output list; cmd_ready is high again when the list has left for the block buffer
//   a_ready and b_ready see both heads and the fill of the block buffer combinationally

`default_nettype none
`include "gs_params.vh"

module gs_sorting_core #(
    parameter CHUNK   = `GS_CHUNK,    // entries in a chunk and in an output block; a power of two, at least 4 * SORT_N
    parameter SORT_N  = `GS_SORT_N,
    parameter ENTRY_W = `GS_ENTRY_W,
    parameter NETWORK = 0             // of the BSU
) (
    input  wire                   clk,
    input  wire                   rst,

    // cmd: one output list
    input  wire                   cmd_valid,
    output wire                   cmd_ready,
    input  wire                   cmd_merge,  // 1 MERGE, 0 SORT
    input  wire [$clog2(CHUNK):0] cmd_first,  // SORT: entries in the first chunk, 1..CHUNK

    // a, b: list streams; b sorted, in MERGE a too
    input  wire                   a_valid,
    output wire                   a_ready,
    input  wire [ENTRY_W-1:0]     a_entry,
    input  wire                   a_last,
    input  wire                   b_valid,
    output wire                   b_ready,
    input  wire [ENTRY_W-1:0]     b_entry,
    input  wire                   b_last,

    // out: block stream
    output wire                   out_valid,
    input  wire                   out_ready,
    output wire [ENTRY_W-1:0]     out_entry,
    output wire [$clog2(CHUNK):0] out_len,
    output wire                   out_last
);

    // A command waits until the block buffer has room.
    wire               sort_ready;
    wire               list_valid;
    wire               list_ready;
    wire [ENTRY_W-1:0] list_entry;
    wire               list_last;
    assign cmd_ready = sort_ready && list_ready;

    gs_chunk_sorter #(.CHUNK(CHUNK), .SORT_N(SORT_N), .ENTRY_W(ENTRY_W), .NETWORK(NETWORK)) chunk_sorter (
        .clk(clk), .rst(rst),
        .cmd_valid(cmd_valid && list_ready), .cmd_ready(sort_ready), .cmd_merge(cmd_merge), .cmd_first(cmd_first),
        .a_valid(a_valid), .a_ready(a_ready), .a_entry(a_entry), .a_last(a_last),
        .b_valid(b_valid), .b_ready(b_ready), .b_entry(b_entry), .b_last(b_last),
        .out_valid(list_valid), .out_ready(list_ready), .out_entry(list_entry), .out_last(list_last)
    );

    gs_block_buffer #(.WIDTH(ENTRY_W), .DEPTH(CHUNK)) blocks (
        .clk(clk), .rst(rst),
        .in_valid(list_valid), .in_ready(list_ready), .in_data(list_entry), .in_last(list_last),
        .out_valid(out_valid), .out_ready(out_ready), .out_data(out_entry), .out_len(out_len), .out_last(out_last)
    );

endmodule

`default_nettype wire
