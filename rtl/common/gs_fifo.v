// gs_fifo: queue in a gs_ram; its head is shown while it waits.
//
//   latency 2, one beat a cycle; holds DEPTH beats and one more at the head; in_ready looks at registers only

`default_nettype none

module gs_fifo #(
    parameter WIDTH = 48,
    parameter DEPTH = 8     // a power of two, 2 or more
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

    localparam ADDR_W = $clog2(DEPTH);

    generate
        if (DEPTH < 2 || DEPTH != (1 << ADDR_W)) begin : g_illegal
            DEPTH_must_be_a_power_of_two bad ();
        end
    endgenerate

    // The pointers have a bit more than an address: equal is empty, equal but for that bit is full.
    reg  [ADDR_W:0] wr_ptr;
    reg  [ADDR_W:0] rd_ptr;
    reg             head_valid;
    wire            empty = wr_ptr == rd_ptr;
    wire            full  = wr_ptr[ADDR_W-1:0] == rd_ptr[ADDR_W-1:0] && wr_ptr[ADDR_W] != rd_ptr[ADDR_W];
    wire            push  = in_valid && !full;
    wire            pull  = !empty && (out_ready || !head_valid);

    assign in_ready  = !full;
    assign out_valid = head_valid;

    gs_ram #(
        .WIDTH(WIDTH),
        .DEPTH(DEPTH)
    ) u_ram (
        .clk(clk),
        .wr_en(push),
        .wr_addr(wr_ptr[ADDR_W-1:0]),
        .wr_data(in_data),
        .rd_en(pull),
        .rd_addr(rd_ptr[ADDR_W-1:0]),
        .rd_data(out_data)
    );

    always @(posedge clk) begin
        if (push) wr_ptr <= wr_ptr + 1'b1;
        if (pull) rd_ptr <= rd_ptr + 1'b1;
        if (out_ready || !head_valid) head_valid <= pull;
        if (rst) begin
            wr_ptr     <= {ADDR_W + 1{1'b0}};
            rd_ptr     <= {ADDR_W + 1{1'b0}};
            head_valid <= 1'b0;
        end
    end

endmodule

`default_nettype wire
