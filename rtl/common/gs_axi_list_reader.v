// gs_axi_list_reader: reads a packed table from memory and sends it as a list stream.
//
//   cmd taken in cycle 0: first AR in cycle 1, one a cycle; an R beat's entry is on list_ one cycle later; one entry a
//   cycle; the end beat is in cycle 2 when n is 0. The next cmd is taken once the end beat has been taken.
//   m_axi_rready sees list_ready combinationally.
//
//   Entries lie in memory in whole bytes, packed: what is left of a beat waits for the next one, and an entry that is
//   all there needs none.

`default_nettype none
`include "gs_params.vh"

module gs_axi_list_reader #(
    parameter ENTRY_W = `GS_ENTRY_W,
    parameter ADDR_W  = 32,
    parameter N_W     = 24
) (
    input  wire               clk,
    input  wire               rst,

    // cmd: one table, at a multiple of 8 bytes
    input  wire               cmd_valid,
    output wire               cmd_ready,
    input  wire [ADDR_W-1:0]  cmd_addr,
    input  wire [N_W-1:0]     cmd_n,            // entries

    // m_axi: INCR bursts of 64-bit beats that end at multiples of 2 KB
    output wire               m_axi_arvalid,
    input  wire               m_axi_arready,
    output wire [ADDR_W-1:0]  m_axi_araddr,
    output wire [7:0]         m_axi_arlen,
    output wire [2:0]         m_axi_arsize,
    output wire [1:0]         m_axi_arburst,
    input  wire               m_axi_rvalid,
    output wire               m_axi_rready,
    input  wire [63:0]        m_axi_rdata,
    input  wire [1:0]         m_axi_rresp,
    input  wire               m_axi_rlast,

    // list: the entries, then the end beat
    output wire               list_valid,
    input  wire               list_ready,
    output wire [ENTRY_W-1:0] list_entry,
    output wire               list_last,

    // status: a beat came with SLVERR or DECERR; stays until rst
    output wire               error
);

    localparam LINE_W = ADDR_W - 3;             // an address in beats
    localparam BYTES  = (ENTRY_W + 7) / 8;      // of an entry in memory
    localparam SIZE_W = N_W + 4;                // a table in bytes
    localparam [3:0] ENTRY_STEP = BYTES[3:0];

    generate
        if (ENTRY_W > 64) begin : g_illegal
            ENTRY_W_must_be_64_at_most bad ();
        end
    endgenerate

    // AR: ar_left beats from ar_line are still to be asked for
    reg               busy;                     // beats are still to be put on list_
    reg               ar_valid;
    reg  [LINE_W-1:0] ar_line;
    reg  [N_W-1:0]    ar_left;
    wire              cmd_go    = cmd_valid && cmd_ready;
    wire [SIZE_W-1:0] cmd_wide  = {4'd0, cmd_n};
    wire [SIZE_W-1:0] cmd_bytes = (cmd_wide & {SIZE_W{ENTRY_STEP[0]}}) + (cmd_wide << 1 & {SIZE_W{ENTRY_STEP[1]}})
                                + (cmd_wide << 2 & {SIZE_W{ENTRY_STEP[2]}}) + (cmd_wide << 3 & {SIZE_W{ENTRY_STEP[3]}})
                                + {{SIZE_W-3{1'b0}}, 3'd7};             // rounded up to beats
    wire [8:0]        ar_room   = 9'd256 - {1'b0, ar_line[7:0]};
    wire              ar_final  = ar_left <= {{N_W-9{1'b0}}, ar_room};
    wire [8:0]        ar_beats  = ar_final ? ar_left[8:0] : ar_room;
    wire [8:0]        ar_len    = ar_beats - 9'd1;

    assign cmd_ready     = !busy && !list_valid;
    assign m_axi_arvalid = ar_valid;
    assign m_axi_araddr  = {ar_line, 3'd0};
    assign m_axi_arlen   = ar_len[7:0];
    assign m_axi_arsize  = 3'd3;
    assign m_axi_arburst = 2'b01;

    always @(posedge clk) begin
        if (cmd_go) begin
            ar_valid <= cmd_n != {N_W{1'b0}};
            ar_line  <= cmd_addr[ADDR_W-1:3];
            ar_left  <= cmd_bytes[N_W+2:3];
        end else if (ar_valid && m_axi_arready) begin
            ar_valid <= !ar_final;
            ar_line  <= ar_line + {{LINE_W-9{1'b0}}, ar_beats};
            ar_left  <= ar_left - {{N_W-9{1'b0}}, ar_beats};
        end
        if (rst) ar_valid <= 1'b0;
    end

    // Entries: `left` are still to be sent; rest holds `have` bytes of beats, and zeros above them
    reg  [N_W-1:0]     left;
    reg  [2:0]         have;
    reg  [55:0]        rest;
    reg                out_valid;
    reg                out_last;
    reg  [ENTRY_W-1:0] out_entry;
    wire               at_end  = left == {N_W{1'b0}};
    wire               no_beat = at_end || {1'b0, have} >= ENTRY_STEP;
    wire               out_go  = list_ready || !out_valid;
    wire               step    = busy && out_go && (no_beat || m_axi_rvalid);
    wire [119:0]       joined  = {64'd0, rest} | ({56'd0, m_axi_rdata & {64{!no_beat}}} << {have, 3'd0});

    assign m_axi_rready = busy && out_go && !no_beat;
    assign list_valid   = out_valid;
    assign list_last    = out_last;
    assign list_entry   = out_entry;

    always @(posedge clk) begin
        if (cmd_go) begin
            busy  <= 1'b1;
            left  <= cmd_n;
            have  <= 3'd0;
            rest  <= 56'd0;
        end else if (step) begin
            busy  <= !at_end;
            left  <= left - 1'b1;
            have  <= have - ENTRY_STEP[2:0];    // modulo 8: with a beat or without one
            rest  <= joined[8*BYTES +: 56];
        end
        if (step) begin
            out_entry <= joined[ENTRY_W-1:0];
            out_last  <= at_end;
        end
        if (out_go) out_valid <= step;
        if (rst) begin
            busy      <= 1'b0;
            out_valid <= 1'b0;
        end
    end

    reg failed;
    assign error = failed;
    always @(posedge clk) begin
        if (m_axi_rvalid && m_axi_rready && m_axi_rresp[1]) failed <= 1'b1;
        if (rst) failed <= 1'b0;
    end

    wire unused_ok = &{1'b0, cmd_addr[2:0], cmd_bytes, ar_len[8], joined, m_axi_rlast, m_axi_rresp[0]};

endmodule

`default_nettype wire
