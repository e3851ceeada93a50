// gs_axi_answers: tells a writer when all bursts of a list, and of the lists before it, have their B response.
//
//   fin in cycle 0: done in cycle 2, or one cycle after the list's last B; holds DONES + 1 lists

`default_nettype none

module gs_axi_answers #(
    parameter N_W   = 24,
    parameter CNT_W = 20,       // less than 2^(CNT_W-1) bursts may wait for their done
    parameter DONES = 2
) (
    input  wire           clk,
    input  wire           rst,

    // burst: a burst's last beat leaves, not later than the fin of its list
    input  wire           burst,

    // fin: a list has ended
    input  wire           fin_valid,
    output wire           fin_ready,
    input  wire [N_W-1:0] fin_n,

    // m_axi: responses
    input  wire           m_axi_bvalid,
    output wire           m_axi_bready,
    input  wire [1:0]     m_axi_bresp,

    // done: fin_n of each list, in order
    output wire           done_valid,
    input  wire           done_ready,
    output wire [N_W-1:0] done_n,

    // status: a burst was answered with SLVERR or DECERR; stays until rst
    output wire           error
);

    // Both count round and round. A list is done when `seen` has reached the number of bursts sent by its end.
    reg  [CNT_W-1:0] sent;
    reg  [CNT_W-1:0] seen;
    wire [CNT_W-1:0] sent_d = sent + {{CNT_W-1{1'b0}}, burst};
    wire             head_valid;
    wire [CNT_W-1:0] head_sent;
    wire [CNT_W-1:0] ahead = seen - head_sent;

    assign m_axi_bready = 1'b1;
    assign done_valid   = head_valid && !ahead[CNT_W-1];

    gs_fifo #(
        .WIDTH(CNT_W + N_W),
        .DEPTH(DONES)
    ) u_fins (
        .clk(clk),
        .rst(rst),
        .in_valid(fin_valid),
        .in_ready(fin_ready),
        .in_data({sent_d, fin_n}),
        .out_valid(head_valid),
        .out_ready(done_ready && !ahead[CNT_W-1]),
        .out_data({head_sent, done_n})
    );

    reg failed;
    assign error = failed;
    always @(posedge clk) begin
        sent <= sent_d;
        if (m_axi_bvalid) seen <= seen + 1'b1;
        if (m_axi_bvalid && m_axi_bresp[1]) failed <= 1'b1;
        if (rst) begin
            sent   <= {CNT_W{1'b0}};
            seen   <= {CNT_W{1'b0}};
            failed <= 1'b0;
        end
    end

    wire unused_ok = &{1'b0, m_axi_bresp[0]};

endmodule

`default_nettype wire
