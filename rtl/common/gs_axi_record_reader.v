// gs_axi_record_reader: fetches feature records by their index.
//
//   idx taken in cycle 0: AR in cycle 1 (and 2, for a record across a 4 KB border); the record is on rec_ one cycle
//   after its last beat. One index a cycle but for border records, one record every RECORD_W / 64 cycles.
//   Any number of reads may be under way. m_axi_rready sees rec_ready combinationally.

`default_nettype none
`include "gs_params.vh"

module gs_axi_record_reader #(
    parameter RECORD_W = `GS_RECORD_W,  // whole beats
    parameter INDEX_W  = `GS_INDEX_W,
    parameter ADDR_W   = 32
) (
    input  wire                clk,
    input  wire                rst,

    // configuration: address of record 0, a multiple of 8; static while reads are under way
    input  wire [ADDR_W-1:0]   cfg_addr,

    // idx: which record
    input  wire                idx_valid,
    output wire                idx_ready,
    input  wire [INDEX_W-1:0]  idx_index,

    // m_axi: INCR bursts of 64-bit beats
    output wire                m_axi_arvalid,
    input  wire                m_axi_arready,
    output wire [ADDR_W-1:0]   m_axi_araddr,
    output wire [7:0]          m_axi_arlen,
    output wire [2:0]          m_axi_arsize,
    output wire [1:0]          m_axi_arburst,
    input  wire                m_axi_rvalid,
    output wire                m_axi_rready,
    input  wire [63:0]         m_axi_rdata,
    input  wire [1:0]          m_axi_rresp,
    input  wire                m_axi_rlast,

    // rec: the records, in the order of the indices
    output wire                rec_valid,
    input  wire                rec_ready,
    output wire [RECORD_W-1:0] rec_record,

    // status: a beat came with SLVERR or DECERR; stays until rst
    output wire                error
);

    localparam LINE_W = ADDR_W - 3;             // an address in beats
    localparam BEATS  = RECORD_W / 64;
    localparam BEAT_W = $clog2(BEATS);
    localparam LEFT_W = $clog2(BEATS + 1);
    localparam [LINE_W-1:0] RECORD_LINES = BEATS;
    localparam [LEFT_W-1:0] ALL_BEATS    = BEATS[LEFT_W-1:0];
    localparam              LAST         = BEATS - 1;
    localparam [BEAT_W-1:0] LAST_BEAT    = LAST[BEAT_W-1:0];

    generate
        if (RECORD_W % 64 != 0 || BEATS < 2 || BEATS > 8) begin : g_illegal
            RECORD_W_must_be_2_to_8_beats_of_64 bad ();
        end
    endgenerate

    // AR: ar_left beats from ar_line, fewer than that when the border comes first
    reg               ar_valid;
    reg  [LINE_W-1:0] ar_line;
    reg  [LEFT_W-1:0] ar_left;
    wire [9:0]        ar_lines = 10'd512 - {1'b0, ar_line[8:0]};    // in front of the border
    wire              ar_final = {{10-LEFT_W{1'b0}}, ar_left} <= ar_lines;
    wire [LEFT_W-1:0] ar_beats = ar_final ? ar_left : ar_lines[LEFT_W-1:0];
    wire [LEFT_W-1:0] ar_len   = ar_beats - {{LEFT_W-1{1'b0}}, 1'b1};
    wire              idx_go   = !ar_valid || (m_axi_arready && ar_final);
    wire [LINE_W-1:0] idx_wide = {{LINE_W-INDEX_W{1'b0}}, idx_index};

    assign idx_ready     = idx_go;
    assign m_axi_arvalid = ar_valid;
    assign m_axi_araddr  = {ar_line, 3'd0};
    assign m_axi_arlen   = {{8-LEFT_W{1'b0}}, ar_len};
    assign m_axi_arsize  = 3'd3;
    assign m_axi_arburst = 2'b01;

    always @(posedge clk) begin
        if (idx_go) begin
            ar_valid <= idx_valid;
            ar_line  <= cfg_addr[ADDR_W-1:3] + idx_wide * RECORD_LINES;
            ar_left  <= ALL_BEATS;
        end else if (m_axi_arready) begin
            ar_line  <= ar_line + {{LINE_W-LEFT_W{1'b0}}, ar_beats};
            ar_left  <= ar_left - ar_beats;
        end
        if (rst) ar_valid <= 1'b0;
    end

    // R: beats come in at the top, so that the first of a record ends at the bottom
    reg                full;
    reg [BEAT_W-1:0]   beat;
    reg [RECORD_W-1:0] record;
    wire               beat_go = m_axi_rvalid && m_axi_rready;

    assign m_axi_rready = rec_ready || !full;
    assign rec_valid    = full;
    assign rec_record   = record;

    always @(posedge clk) begin
        if (beat_go) beat   <= beat == LAST_BEAT ? {BEAT_W{1'b0}} : beat + {{BEAT_W-1{1'b0}}, 1'b1};
        if (beat_go) record <= {m_axi_rdata, record[RECORD_W-1:64]};
        if (m_axi_rready) full <= beat_go && beat == LAST_BEAT;
        if (rst) begin
            beat <= {BEAT_W{1'b0}};
            full <= 1'b0;
        end
    end

    reg failed;
    assign error = failed;
    always @(posedge clk) begin
        if (beat_go && m_axi_rresp[1]) failed <= 1'b1;
        if (rst) failed <= 1'b0;
    end

    wire unused_ok = &{1'b0, cfg_addr[2:0], ar_lines, m_axi_rlast, m_axi_rresp[0]};

endmodule

`default_nettype wire
