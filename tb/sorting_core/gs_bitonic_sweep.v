// gs_bitonic_sweep: drives UNITS bitonic sort units with every group of SORT_N zeros and ones, and counts what is wrong.
//
//   Entry i of group g repeats bit i of g, so a sorted group is as many zeros as g has, then ones. Unit u gets the groups
//   whose upper bits are u; all units run in step.

`default_nettype none
`include "gs_params.vh"

module gs_bitonic_sweep #(
    parameter SORT_N  = `GS_SORT_N,
    parameter ENTRY_W = 48,
    parameter NETWORK = 0,
    parameter UNITS   = 8
) (
    input  wire             clk,
    input  wire             rst,
    output reg  [31:0]      groups,  // groups that have left each unit
    output wire [UNITS-1:0] fault,   // units that have sent a wrong entry
    output wire             done
);

    localparam POS_W   = $clog2(SORT_N);
    localparam UNIT_W  = $clog2(UNITS);
    localparam GROUP_W = SORT_N - UNIT_W;

    reg  [GROUP_W+POS_W:0] sent;
    reg  [GROUP_W+POS_W:0] seen;
    wire                   in_valid = !sent[GROUP_W+POS_W];
    wire [UNITS-1:0]       in_ready;
    wire [UNITS-1:0]       out_valid;

    assign done = seen[GROUP_W+POS_W];

    always @(posedge clk) begin
        if (in_valid && in_ready[0]) sent <= sent + 1'b1;
        if (out_valid[0]) seen <= seen + 1'b1;
        if (out_valid[0] && (&seen[POS_W-1:0])) groups <= groups + 32'd1;
        if (rst) begin
            sent   <= 0;
            seen   <= 0;
            groups <= 0;
        end
    end

    genvar u;
    generate
        for (u = 0; u < UNITS; u = u + 1) begin : g_unit
            localparam [UNIT_W-1:0] UNIT = u;
            wire [SORT_N-1:0]  group = {UNIT, sent[POS_W +: GROUP_W]};
            wire               in_bit = group[sent[POS_W-1:0]];
            wire [SORT_N-1:0]  leaving = {UNIT, seen[POS_W +: GROUP_W]};
            wire [ENTRY_W-1:0] out_entry;
            wire               out_last;

            integer       i;
            reg [POS_W:0] zeros;
            always @* begin
                zeros = 0;
                for (i = 0; i < SORT_N; i = i + 1) zeros = zeros + {{POS_W{1'b0}}, !leaving[i]};
            end
            wire want = {1'b0, seen[POS_W-1:0]} >= zeros;

            reg  wrong;
            wire differs = out_valid[u] && (out_last || out_entry != {ENTRY_W{want}});
            wire out_of_step = out_valid[u] != out_valid[0] || in_ready[u] != in_ready[0];
            always @(posedge clk) begin
                if (differs || out_of_step) wrong <= 1'b1;
                if (rst) wrong <= 1'b0;
            end
            assign fault[u] = wrong;

            gs_bitonic_sort_unit #(
                .SORT_N (SORT_N),
                .ENTRY_W(ENTRY_W),
                .NETWORK(NETWORK)
            ) dut (
                .clk(clk),
                .rst(rst),
                .in_valid(in_valid),
                .in_ready(in_ready[u]),
                .in_entry({ENTRY_W{in_bit}}),
                .in_last(1'b0),
                .out_valid(out_valid[u]),
                .out_ready(1'b1),
                .out_entry(out_entry),
                .out_last(out_last)
            );
        end
    endgenerate

endmodule

`default_nettype wire
