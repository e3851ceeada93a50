// gs_ram for proofs: a read gives any word at all. What holds here holds for every content of the memory.

`default_nettype none

module gs_ram #(
    parameter WIDTH = 48,
    parameter DEPTH = 256
) (
    input  wire                     clk,
    input  wire                     wr_en,
    input  wire [$clog2(DEPTH)-1:0] wr_addr,
    input  wire [WIDTH-1:0]         wr_data,
    input  wire                     rd_en,
    input  wire [$clog2(DEPTH)-1:0] rd_addr,
    output reg  [WIDTH-1:0]         rd_data
);

    (* anyseq *) wire [WIDTH-1:0] anything;

    always @(posedge clk) if (rd_en) rd_data <= anything;

endmodule

`default_nettype wire
