// gs_ram: memory with one write port and one read port; the word is there one cycle after its address.
//
//   Reading and writing one address in one cycle gives the old word. No reset: contents start unknown.

`default_nettype none

module gs_ram #(
    parameter WIDTH = 48,
    parameter DEPTH = 256
) (
    input  wire                     clk,

    // wr
    input  wire                     wr_en,
    input  wire [$clog2(DEPTH)-1:0] wr_addr,
    input  wire [WIDTH-1:0]         wr_data,

    // rd: data holds while rd_en is low
    input  wire                     rd_en,
    input  wire [$clog2(DEPTH)-1:0] rd_addr,
    output reg  [WIDTH-1:0]         rd_data
);

    reg [WIDTH-1:0] mem [0:DEPTH-1];

    always @(posedge clk) begin
        if (wr_en) mem[wr_addr] <= wr_data;
        if (rd_en) rd_data <= mem[rd_addr];
    end

endmodule

`default_nettype wire
