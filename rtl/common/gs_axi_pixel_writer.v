// gs_axi_pixel_writer: writes the live pixels of a tile, row by row, into the picture in memory.
//
//   One beat a cycle, also from tile to tile, as long as AW and W are ready. A row's AW follows its first beat by one
//   cycle (and two, across a 4 KB border), a W beat its px_ beat by one. done: two cycles after the tile's last beat, or
//   one after its last B. A cmd is ready for its tile's first beat one cycle later. px_ready sees m_axi_awready and
//   m_axi_wready combinationally.
//
//   byte address of pixel (x, y): cfg_addr + y * cfg_stride + 4 * x

`default_nettype none
`include "gs_params.vh"

module gs_axi_pixel_writer #(
    parameter TILE   = `GS_TILE,        // 64: pixels along a tile's side
    parameter ADDR_W = 32,
    parameter DONES  = 8                // tiles that may wait for their B responses
) (
    input  wire              clk,
    input  wire              rst,

    // configuration: static while a tile is under way
    input  wire [12:0]       cfg_width,     // pixels
    input  wire [ADDR_W-1:0] cfg_addr,      // bytes, a multiple of 16
    input  wire [15:0]       cfg_stride,    // bytes from row to row, a multiple of 16

    // cmd: origin of the next tile, multiples of TILE
    input  wire              cmd_valid,
    output wire              cmd_ready,
    input  wire [12:0]       cmd_x,
    input  wire [12:0]       cmd_y,

    // px: the tile's live pixels, four a beat; a row ends at the tile's or the picture's border
    input  wire              px_valid,
    output wire              px_ready,
    input  wire [127:0]      px_data,
    input  wire [15:0]       px_strb,
    input  wire              px_last,

    // m_axi: one or two INCR bursts of 128-bit beats a row
    output wire              m_axi_awvalid,
    input  wire              m_axi_awready,
    output wire [ADDR_W-1:0] m_axi_awaddr,
    output wire [7:0]        m_axi_awlen,
    output wire [2:0]        m_axi_awsize,
    output wire [1:0]        m_axi_awburst,
    output wire              m_axi_wvalid,
    input  wire              m_axi_wready,
    output wire [127:0]      m_axi_wdata,
    output wire [15:0]       m_axi_wstrb,
    output wire              m_axi_wlast,
    input  wire              m_axi_bvalid,
    output wire              m_axi_bready,
    input  wire [1:0]        m_axi_bresp,

    // done: the tile is in memory
    output wire              done_valid,
    input  wire              done_ready,

    // status: a burst was answered with SLVERR or DECERR; stays until rst
    output wire              error
);

    localparam LINE_W = ADDR_W - 4;             // an address in beats

    generate
        if (TILE != 64) begin : g_illegal
            TILE_must_be_64 bad ();
        end
    endgenerate

    // Next tile: where its first row starts and how many beats a row has, worked out ahead. Rows come in steps of 64, so
    // the six low bits of the address see the column alone, and the others are one sum with the multiplier's rows.
    reg               next_valid;
    reg  [LINE_W-1:0] next_line;
    reg  [4:0]        next_beats;
    wire              start;                    // the tile's first beat
    wire [18:0]       rows    = {12'd0, cmd_y[12:6]} * {7'd0, cfg_stride[15:4]};    // 64 rows each, in beats
    wire [6:0]        low     = {1'b0, cfg_addr[9:4]} + {1'b0, cmd_x[7:2]};
    wire [LINE_W-7:0] high    = cfg_addr[ADDR_W-1:10] + {{LINE_W-25{1'b0}}, rows} + {{LINE_W-11{1'b0}}, cmd_x[12:8]}
                              + {{LINE_W-7{1'b0}}, low[6]};
    wire [12:0]       cols    = cfg_width - cmd_x;
    wire [12:0]       cols_up = cols + 13'd3;

    assign cmd_ready = start || !next_valid;
    always @(posedge clk) begin
        if (cmd_ready) begin
            next_valid <= cmd_valid;
            next_line  <= {high, low[5:0]};
            next_beats <= cols > 13'd64 ? 5'd16 : cols_up[6:2];
        end
        if (rst) next_valid <= 1'b0;
    end

    // A beat is taken when W moves and a tile may end; a row's first also needs AW
    reg               in_tile;
    reg               in_row;
    reg  [3:0]        row_left;                 // beats of the row behind the next one
    reg  [4:0]        row_beats;
    reg  [LINE_W-1:0] row_line;                 // of the next row
    reg               w_valid;
    wire              aw_free;
    wire              fin_ready;
    wire              w_go     = (m_axi_wready || !w_valid) && fin_ready;
    wire              take     = px_valid && px_ready;
    wire              open     = take && !in_row;
    wire [4:0]        beats    = in_tile ? row_beats : next_beats;
    wire [LINE_W-1:0] line     = in_tile ? row_line : next_line;
    wire              close    = in_row ? row_left == 4'd0 : beats == 5'd1;
    wire [4:0]        left_d   = in_row ? {1'b0, row_left} - 5'd1 : beats - 5'd2;

    assign px_ready = w_go && (in_row || (aw_free && (in_tile || next_valid)));
    assign start    = open && !in_tile;
    always @(posedge clk) begin
        if (take) begin
            in_row   <= !close;
            in_tile  <= !px_last;
            row_left <= left_d[3:0];
        end
        if (start) row_beats <= next_beats;
        if (open) row_line <= line + {{LINE_W-12{1'b0}}, cfg_stride[15:4]};
        if (rst) in_row  <= 1'b0;
        if (rst) in_tile <= 1'b0;
    end

    // W
    reg  [127:0] w_data;
    reg  [15:0]  w_strb;
    reg          w_last;
    reg  [7:0]   w_pos;                         // of the next beat in its 4 KB
    wire [7:0]   pos      = in_row ? w_pos : line[7:0];
    wire         w_last_d = close || (&pos);

    assign m_axi_wvalid = w_valid;
    assign m_axi_wdata  = w_data;
    assign m_axi_wstrb  = w_strb;
    assign m_axi_wlast  = w_last;

    always @(posedge clk) begin
        if (take) w_pos <= pos + 8'd1;
        if (w_go) begin
            w_valid <= take;
            w_last  <= w_last_d;
            w_data  <= px_data;
            w_strb  <= px_strb;
        end else if (m_axi_wready) begin
            w_valid <= 1'b0;
        end
        if (rst) w_valid <= 1'b0;
    end

    // AW: aw_left beats from aw_line
    reg               aw_valid;
    reg  [LINE_W-1:0] aw_line;
    reg  [4:0]        aw_left;
    wire [8:0]        aw_room  = 9'd256 - {1'b0, aw_line[7:0]};
    wire              aw_final = {4'd0, aw_left} <= aw_room;
    wire [4:0]        aw_beats = aw_final ? aw_left : aw_room[4:0];

    assign aw_free       = !aw_valid || (m_axi_awready && aw_final);
    assign m_axi_awvalid = aw_valid;
    assign m_axi_awaddr  = {aw_line, 4'd0};
    assign m_axi_awlen   = {3'd0, aw_beats - 5'd1};
    assign m_axi_awsize  = 3'd4;
    assign m_axi_awburst = 2'b01;

    always @(posedge clk) begin
        if (open) begin
            aw_valid <= 1'b1;
            aw_line  <= line;
            aw_left  <= beats;
        end else if (aw_valid && m_axi_awready) begin
            aw_valid <= !aw_final;
            aw_line  <= aw_line + {{LINE_W-5{1'b0}}, aw_beats};
            aw_left  <= aw_left - aw_beats;
        end
        if (rst) aw_valid <= 1'b0;
    end

    wire done_n;
    gs_axi_answers #(
        .N_W(1),
        .CNT_W(12),
        .DONES(DONES)
    ) u_answers (
        .clk(clk),
        .rst(rst),
        .burst(take && w_last_d),
        .fin_valid(take && px_last),
        .fin_ready(fin_ready),
        .fin_n(1'b0),
        .m_axi_bvalid(m_axi_bvalid),
        .m_axi_bready(m_axi_bready),
        .m_axi_bresp(m_axi_bresp),
        .done_valid(done_valid),
        .done_ready(done_ready),
        .done_n(done_n),
        .error(error)
    );

    wire unused_ok = &{1'b0, done_n, cfg_addr[3:0], cfg_stride[3:0], cmd_x[1:0], cmd_y[5:0], cols_up[12:7],
                       cols_up[1:0], left_d[4], aw_room[8:5]};

endmodule

`default_nettype wire
