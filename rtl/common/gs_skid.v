// gs_skid: cuts the ready path of a stream; two beats deep, one beat a cycle.
//
//   latency 1; in_ready is a register

`default_nettype none

module gs_skid #(
    parameter WIDTH = 48
) (
    input  wire             clk,
    input  wire             rst,

    // in
    input  wire             in_valid,
    output wire             in_ready,
    input  wire [WIDTH-1:0] in_data,

    // out: same order
    output wire             out_valid,
    input  wire             out_ready,
    output wire [WIDTH-1:0] out_data
);

    // head is what out shows; spare holds the beat that came while head could not move.
    reg             head_valid;
    reg [WIDTH-1:0] head_data;
    reg             spare_valid;
    reg [WIDTH-1:0] spare_data;
    wire            head_go = out_ready || !head_valid;

    assign in_ready  = !spare_valid;
    assign out_valid = head_valid;
    assign out_data  = head_data;

    always @(posedge clk) begin
        if (head_go) begin
            head_valid <= spare_valid || in_valid;
            head_data  <= spare_valid ? spare_data : in_data;
        end
        if (head_go) spare_valid <= 1'b0;
        else if (in_valid && in_ready) spare_valid <= 1'b1;
        if (in_ready) spare_data <= in_data;
        if (rst) begin
            head_valid  <= 1'b0;
            spare_valid <= 1'b0;
        end
    end

endmodule

`default_nettype wire
