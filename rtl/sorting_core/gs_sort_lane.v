// gs_sort_lane: a sorting core with what sorts a tile's table from memory to memory.
//
//   job ─► sequencer ─┬─► list readers a, b ─► sorting core ─► block writer ─► written
//                     └────◄───────────────────────────────────────────────────┘
//   Cycles of a job: golden/sorting_core/sort_lane.py. The next job may run while a done waits.

`default_nettype none
`include "gs_params.vh"

module gs_sort_lane #(
    parameter CHUNK  = `GS_CHUNK,
    parameter ADDR_W = 32,
    parameter N_W    = 24
) (
    input  wire              clk,
    input  wire              rst,

    // job: one tile, as gs_sort_sequencer takes it
    input  wire              job_valid,
    output wire              job_ready,
    input  wire [ADDR_W-1:0] job_table_addr,
    input  wire [N_W-1:0]    job_table_n,
    input  wire [ADDR_W-1:0] job_in_addr,
    input  wire [N_W-1:0]    job_in_n,
    input  wire [ADDR_W-1:0] job_scratch_addr,
    input  wire [ADDR_W-1:0] job_out_addr,
    input  wire [8:0]        job_first,

    // done: the job's table is in memory; n entries
    output wire              done_valid,
    input  wire              done_ready,
    output wire [N_W-1:0]    done_n,

    // m_axi_a: read list a, write the result
    output wire              m_axi_a_arvalid,
    input  wire              m_axi_a_arready,
    output wire [ADDR_W-1:0] m_axi_a_araddr,
    output wire [7:0]        m_axi_a_arlen,
    output wire [2:0]        m_axi_a_arsize,
    output wire [1:0]        m_axi_a_arburst,
    input  wire              m_axi_a_rvalid,
    output wire              m_axi_a_rready,
    input  wire [63:0]       m_axi_a_rdata,
    input  wire [1:0]        m_axi_a_rresp,
    input  wire              m_axi_a_rlast,
    output wire              m_axi_a_awvalid,
    input  wire              m_axi_a_awready,
    output wire [ADDR_W-1:0] m_axi_a_awaddr,
    output wire [7:0]        m_axi_a_awlen,
    output wire [2:0]        m_axi_a_awsize,
    output wire [1:0]        m_axi_a_awburst,
    output wire              m_axi_a_wvalid,
    input  wire              m_axi_a_wready,
    output wire [63:0]       m_axi_a_wdata,
    output wire [7:0]        m_axi_a_wstrb,
    output wire              m_axi_a_wlast,
    input  wire              m_axi_a_bvalid,
    output wire              m_axi_a_bready,
    input  wire [1:0]        m_axi_a_bresp,

    // m_axi_b: read list b
    output wire              m_axi_b_arvalid,
    input  wire              m_axi_b_arready,
    output wire [ADDR_W-1:0] m_axi_b_araddr,
    output wire [7:0]        m_axi_b_arlen,
    output wire [2:0]        m_axi_b_arsize,
    output wire [1:0]        m_axi_b_arburst,
    input  wire              m_axi_b_rvalid,
    output wire              m_axi_b_rready,
    input  wire [63:0]       m_axi_b_rdata,
    input  wire [1:0]        m_axi_b_rresp,
    input  wire              m_axi_b_rlast,

    // status: a memory port had an error answer; stays until rst
    output wire              error
);

    wire              a_cmd_valid;
    wire              a_cmd_ready;
    wire [ADDR_W-1:0] a_cmd_addr;
    wire [N_W-1:0]    a_cmd_n;
    wire              b_cmd_valid;
    wire              b_cmd_ready;
    wire [ADDR_W-1:0] b_cmd_addr;
    wire [N_W-1:0]    b_cmd_n;
    wire              core_valid;
    wire              core_ready;
    wire              core_merge;
    wire [8:0]        core_first;
    wire              out_cmd_valid;
    wire              out_cmd_ready;
    wire [ADDR_W-1:0] out_cmd_addr;
    wire              written_valid;
    wire              written_ready;
    wire [N_W-1:0]    written_n;

    gs_sort_sequencer #(.CHUNK(CHUNK), .ADDR_W(ADDR_W), .N_W(N_W)) sequencer (
        .clk(clk), .rst(rst),
        .job_valid(job_valid), .job_ready(job_ready), .job_table_addr(job_table_addr), .job_table_n(job_table_n),
        .job_in_addr(job_in_addr), .job_in_n(job_in_n), .job_scratch_addr(job_scratch_addr),
        .job_out_addr(job_out_addr), .job_first(job_first),
        .a_valid(a_cmd_valid), .a_ready(a_cmd_ready), .a_addr(a_cmd_addr), .a_n(a_cmd_n),
        .b_valid(b_cmd_valid), .b_ready(b_cmd_ready), .b_addr(b_cmd_addr), .b_n(b_cmd_n),
        .core_valid(core_valid), .core_ready(core_ready), .core_merge(core_merge), .core_first(core_first),
        .out_valid(out_cmd_valid), .out_ready(out_cmd_ready), .out_addr(out_cmd_addr),
        .written_valid(written_valid), .written_ready(written_ready), .written_n(written_n),
        .done_valid(done_valid), .done_ready(done_ready), .done_n(done_n)
    );

    wire                  a_valid;
    wire                  a_ready;
    wire [`GS_ENTRY_W-1:0] a_entry;
    wire                  a_last;
    wire                  a_error;
    gs_axi_list_reader #(.ADDR_W(ADDR_W), .N_W(N_W)) reader_a (
        .clk(clk), .rst(rst),
        .cmd_valid(a_cmd_valid), .cmd_ready(a_cmd_ready), .cmd_addr(a_cmd_addr), .cmd_n(a_cmd_n),
        .m_axi_arvalid(m_axi_a_arvalid), .m_axi_arready(m_axi_a_arready), .m_axi_araddr(m_axi_a_araddr),
        .m_axi_arlen(m_axi_a_arlen), .m_axi_arsize(m_axi_a_arsize), .m_axi_arburst(m_axi_a_arburst),
        .m_axi_rvalid(m_axi_a_rvalid), .m_axi_rready(m_axi_a_rready), .m_axi_rdata(m_axi_a_rdata),
        .m_axi_rresp(m_axi_a_rresp), .m_axi_rlast(m_axi_a_rlast),
        .list_valid(a_valid), .list_ready(a_ready), .list_entry(a_entry), .list_last(a_last), .error(a_error)
    );

    wire                  b_valid;
    wire                  b_ready;
    wire [`GS_ENTRY_W-1:0] b_entry;
    wire                  b_last;
    wire                  b_error;
    gs_axi_list_reader #(.ADDR_W(ADDR_W), .N_W(N_W)) reader_b (
        .clk(clk), .rst(rst),
        .cmd_valid(b_cmd_valid), .cmd_ready(b_cmd_ready), .cmd_addr(b_cmd_addr), .cmd_n(b_cmd_n),
        .m_axi_arvalid(m_axi_b_arvalid), .m_axi_arready(m_axi_b_arready), .m_axi_araddr(m_axi_b_araddr),
        .m_axi_arlen(m_axi_b_arlen), .m_axi_arsize(m_axi_b_arsize), .m_axi_arburst(m_axi_b_arburst),
        .m_axi_rvalid(m_axi_b_rvalid), .m_axi_rready(m_axi_b_rready), .m_axi_rdata(m_axi_b_rdata),
        .m_axi_rresp(m_axi_b_rresp), .m_axi_rlast(m_axi_b_rlast),
        .list_valid(b_valid), .list_ready(b_ready), .list_entry(b_entry), .list_last(b_last), .error(b_error)
    );

    wire                   out_valid;
    wire                   out_ready;
    wire [`GS_ENTRY_W-1:0] out_entry;
    wire [8:0]             out_len;
    wire                   out_last;
    gs_sorting_core #(.CHUNK(CHUNK)) sorting_core (
        .clk(clk), .rst(rst),
        .cmd_valid(core_valid), .cmd_ready(core_ready), .cmd_merge(core_merge), .cmd_first(core_first),
        .a_valid(a_valid), .a_ready(a_ready), .a_entry(a_entry), .a_last(a_last),
        .b_valid(b_valid), .b_ready(b_ready), .b_entry(b_entry), .b_last(b_last),
        .out_valid(out_valid), .out_ready(out_ready), .out_entry(out_entry), .out_len(out_len), .out_last(out_last)
    );

    wire out_error;
    gs_axi_block_writer #(.ADDR_W(ADDR_W), .N_W(N_W)) writer (
        .clk(clk), .rst(rst),
        .cmd_valid(out_cmd_valid), .cmd_ready(out_cmd_ready), .cmd_addr(out_cmd_addr),
        .blk_valid(out_valid), .blk_ready(out_ready), .blk_entry(out_entry), .blk_len(out_len), .blk_last(out_last),
        .m_axi_awvalid(m_axi_a_awvalid), .m_axi_awready(m_axi_a_awready), .m_axi_awaddr(m_axi_a_awaddr),
        .m_axi_awlen(m_axi_a_awlen), .m_axi_awsize(m_axi_a_awsize), .m_axi_awburst(m_axi_a_awburst),
        .m_axi_wvalid(m_axi_a_wvalid), .m_axi_wready(m_axi_a_wready), .m_axi_wdata(m_axi_a_wdata),
        .m_axi_wstrb(m_axi_a_wstrb), .m_axi_wlast(m_axi_a_wlast), .m_axi_bvalid(m_axi_a_bvalid),
        .m_axi_bready(m_axi_a_bready), .m_axi_bresp(m_axi_a_bresp),
        .done_valid(written_valid), .done_ready(written_ready), .done_n(written_n), .error(out_error)
    );

    assign error = a_error || b_error || out_error;

endmodule

`default_nettype wire
