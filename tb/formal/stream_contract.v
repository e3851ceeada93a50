// stream_contract: rule 2 of a stream: once valid is high, valid and the fields hold until the beat moves.
//
//   ASSUME 0 asserts it (the module under proof drives the stream), ASSUME 1 assumes it (its neighbour does).

`default_nettype none

module stream_contract #(
    parameter WIDTH  = 1,
    parameter ASSUME = 0
) (
    input  wire             clk,
    input  wire             rst,
    input  wire             valid,
    input  wire             ready,
    input  wire [WIDTH-1:0] data
);

    reg             waiting = 1'b0;
    reg [WIDTH-1:0] held;

    always @(posedge clk) begin
        waiting <= valid && !ready && !rst;
        held    <= data;
    end

    wire kept = !waiting || rst || (valid && data == held);

    generate
        if (ASSUME) begin : assumed
            always @(*) assume (kept);
        end else begin : proved
            always @(*) assert (kept);
        end
    endgenerate

endmodule

`default_nettype wire
