// gs_slice: sorts the tables of a frame's tiles on four sorting cores and rasterises them on one raster core.
//
//   tile ─┬─► sort lane c: tiles c, c + CORES, ... ─┬─► raster lane: tiles in order ─► done
//         └─► queue: origin and output ─────────────┘
//
//   Up to two tiles a sorting core lie between tile and start, up to TILES between start and done. A tile's done is
//   offered when its table and pixels are written, B responses included. Exact cycles: golden/slice.py.
//   Port buses of the sorting cores hold one field per core, core 0 lowest. Every burst is INCR and stays within 4 KB.

`default_nettype none
`include "gs_params.vh"

module gs_slice #(
    parameter CORES  = `GS_SORT_CORES,  // a power of two
    parameter TILES  = 8,               // a power of two
    parameter ADDR_W = 32,
    parameter N_W    = 24
) (
    input  wire                    clk,
    input  wire                    rst,

    // configuration: static while a frame is under way
    input  wire [12:0]             cfg_width,           // pixels
    input  wire [12:0]             cfg_height,
    input  wire [`GS_COLOUR_W-1:0] cfg_bg_red,          // UQ3.COLOUR_F
    input  wire [`GS_COLOUR_W-1:0] cfg_bg_green,
    input  wire [`GS_COLOUR_W-1:0] cfg_bg_blue,
    input  wire [ADDR_W-1:0]       cfg_feature_addr,    // of record 0, a multiple of 8
    input  wire [ADDR_W-1:0]       cfg_frame_addr,      // of pixel (0, 0), a multiple of 16
    input  wire [15:0]             cfg_frame_stride,    // bytes from row to row, a multiple of 16
    input  wire [8:0]              cfg_first,           // entries of a table's first chunk in this frame, 1..256

    // tile: pixel origin, multiples of 64; byte addresses, multiples of 8; entries
    input  wire                    tile_valid,
    output wire                    tile_ready,
    input  wire [12:0]             tile_x,
    input  wire [12:0]             tile_y,
    input  wire [ADDR_W-1:0]       tile_table_addr,     // last frame's table
    input  wire [N_W-1:0]          tile_table_n,
    input  wire [ADDR_W-1:0]       tile_in_addr,        // incoming entries; overwritten when they are more than 256
    input  wire [N_W-1:0]          tile_in_n,
    input  wire [ADDR_W-1:0]       tile_scratch_addr,   // room for tile_in_n entries
    input  wire [ADDR_W-1:0]       tile_out_addr,       // room for tile_table_n + tile_in_n entries

    // done: a tile is finished, in the order of tile; entries of its new table
    output wire                    done_valid,
    input  wire                    done_ready,
    output wire [N_W-1:0]          done_n,

    // m_axi_sort: read list a, write the sorted list
    output wire [CORES-1:0]        m_axi_sort_arvalid,
    input  wire [CORES-1:0]        m_axi_sort_arready,
    output wire [CORES*ADDR_W-1:0] m_axi_sort_araddr,
    output wire [CORES*8-1:0]      m_axi_sort_arlen,
    output wire [CORES*3-1:0]      m_axi_sort_arsize,
    output wire [CORES*2-1:0]      m_axi_sort_arburst,
    input  wire [CORES-1:0]        m_axi_sort_rvalid,
    output wire [CORES-1:0]        m_axi_sort_rready,
    input  wire [CORES*64-1:0]     m_axi_sort_rdata,
    input  wire [CORES*2-1:0]      m_axi_sort_rresp,
    input  wire [CORES-1:0]        m_axi_sort_rlast,
    output wire [CORES-1:0]        m_axi_sort_awvalid,
    input  wire [CORES-1:0]        m_axi_sort_awready,
    output wire [CORES*ADDR_W-1:0] m_axi_sort_awaddr,
    output wire [CORES*8-1:0]      m_axi_sort_awlen,
    output wire [CORES*3-1:0]      m_axi_sort_awsize,
    output wire [CORES*2-1:0]      m_axi_sort_awburst,
    output wire [CORES-1:0]        m_axi_sort_wvalid,
    input  wire [CORES-1:0]        m_axi_sort_wready,
    output wire [CORES*64-1:0]     m_axi_sort_wdata,
    output wire [CORES*8-1:0]      m_axi_sort_wstrb,
    output wire [CORES-1:0]        m_axi_sort_wlast,
    input  wire [CORES-1:0]        m_axi_sort_bvalid,
    output wire [CORES-1:0]        m_axi_sort_bready,
    input  wire [CORES*2-1:0]      m_axi_sort_bresp,

    // m_axi_insert: read list b
    output wire [CORES-1:0]        m_axi_insert_arvalid,
    input  wire [CORES-1:0]        m_axi_insert_arready,
    output wire [CORES*ADDR_W-1:0] m_axi_insert_araddr,
    output wire [CORES*8-1:0]      m_axi_insert_arlen,
    output wire [CORES*3-1:0]      m_axi_insert_arsize,
    output wire [CORES*2-1:0]      m_axi_insert_arburst,
    input  wire [CORES-1:0]        m_axi_insert_rvalid,
    output wire [CORES-1:0]        m_axi_insert_rready,
    input  wire [CORES*64-1:0]     m_axi_insert_rdata,
    input  wire [CORES*2-1:0]      m_axi_insert_rresp,
    input  wire [CORES-1:0]        m_axi_insert_rlast,

    // m_axi_table: the raster core reads a sorted table and writes it back
    output wire                    m_axi_table_arvalid,
    input  wire                    m_axi_table_arready,
    output wire [ADDR_W-1:0]       m_axi_table_araddr,
    output wire [7:0]              m_axi_table_arlen,
    output wire [2:0]              m_axi_table_arsize,
    output wire [1:0]              m_axi_table_arburst,
    input  wire                    m_axi_table_rvalid,
    output wire                    m_axi_table_rready,
    input  wire [63:0]             m_axi_table_rdata,
    input  wire [1:0]              m_axi_table_rresp,
    input  wire                    m_axi_table_rlast,
    output wire                    m_axi_table_awvalid,
    input  wire                    m_axi_table_awready,
    output wire [ADDR_W-1:0]       m_axi_table_awaddr,
    output wire [7:0]              m_axi_table_awlen,
    output wire [2:0]              m_axi_table_awsize,
    output wire [1:0]              m_axi_table_awburst,
    output wire                    m_axi_table_wvalid,
    input  wire                    m_axi_table_wready,
    output wire [63:0]             m_axi_table_wdata,
    output wire [7:0]              m_axi_table_wstrb,
    output wire                    m_axi_table_wlast,
    input  wire                    m_axi_table_bvalid,
    output wire                    m_axi_table_bready,
    input  wire [1:0]              m_axi_table_bresp,

    // m_axi_feature: records
    output wire                    m_axi_feature_arvalid,
    input  wire                    m_axi_feature_arready,
    output wire [ADDR_W-1:0]       m_axi_feature_araddr,
    output wire [7:0]              m_axi_feature_arlen,
    output wire [2:0]              m_axi_feature_arsize,
    output wire [1:0]              m_axi_feature_arburst,
    input  wire                    m_axi_feature_rvalid,
    output wire                    m_axi_feature_rready,
    input  wire [63:0]             m_axi_feature_rdata,
    input  wire [1:0]              m_axi_feature_rresp,
    input  wire                    m_axi_feature_rlast,

    // m_axi_pixel: the picture
    output wire                    m_axi_pixel_awvalid,
    input  wire                    m_axi_pixel_awready,
    output wire [ADDR_W-1:0]       m_axi_pixel_awaddr,
    output wire [7:0]              m_axi_pixel_awlen,
    output wire [2:0]              m_axi_pixel_awsize,
    output wire [1:0]              m_axi_pixel_awburst,
    output wire                    m_axi_pixel_wvalid,
    input  wire                    m_axi_pixel_wready,
    output wire [127:0]            m_axi_pixel_wdata,
    output wire [15:0]             m_axi_pixel_wstrb,
    output wire                    m_axi_pixel_wlast,
    input  wire                    m_axi_pixel_bvalid,
    output wire                    m_axi_pixel_bready,
    input  wire [1:0]              m_axi_pixel_bresp,

    // status: a memory port had an error answer; stays until rst
    output wire                    error,

    // trace: may be left open
    output wire [CORES-1:0]        trace_sort_done,     // first cycle in which a lane's sorted table is in memory
    output wire                    trace_itu_valid,
    output wire [3:0]              trace_itu_group,
    output wire [7:0]              trace_itu_slot,
    output wire [3:0]              trace_itu_hits,
    output wire                    trace_px_valid,      // four pixels move to the pixel writer
    output wire [12*`GS_ACC_W-1:0] trace_px_rgb,        // UQ3.ACC_F
    output wire [3:0]              trace_blend_valid,
    output wire [63:0]             trace_blend,
    output wire                    trace_tile_done
);

    localparam CORE_W = $clog2(CORES);
    localparam LINE_W = ADDR_W - 3;
    localparam [CORE_W-1:0] CORE_1 = 1;

    generate
        if (CORES < 2 || CORES != (1 << CORE_W)) begin : g_illegal
            CORES_must_be_a_power_of_two bad ();
        end
    endgenerate

    // Tiles go to the sort lanes in turn; their origin and output wait in a queue that never fills
    reg  [CORE_W-1:0]    to_lane;
    reg  [CORE_W-1:0]    from_lane;
    wire [CORES-1:0]     lane_ready;
    wire [CORES-1:0]     lane_done;
    wire [CORES*N_W-1:0] lane_n;
    wire [CORES-1:0]     lane_taken;
    wire [CORES-1:0]     lane_error;
    reg  [CORES-1:0]     lane_seen;           // its done is not new
    wire                 tile_go = tile_valid && tile_ready;
    wire                 start_valid;
    wire                 start_ready;
    wire                 start_go = start_valid && start_ready;
    assign tile_ready      = lane_ready[to_lane];
    assign trace_sort_done = lane_done & ~lane_seen;

    always @(posedge clk) begin
        if (tile_go)  to_lane   <= to_lane + CORE_1;
        if (start_go) from_lane <= from_lane + CORE_1;
        lane_seen <= lane_done & ~lane_taken & {CORES{!rst}};
        if (rst) to_lane   <= {CORE_W{1'b0}};
        if (rst) from_lane <= {CORE_W{1'b0}};
    end

    genvar c;
    generate
        for (c = 0; c < CORES; c = c + 1) begin : g_lane
            assign lane_taken[c] = start_go && from_lane == c;
            gs_sort_lane #(.ADDR_W(ADDR_W), .N_W(N_W)) lane (
                .clk(clk), .rst(rst),
                .job_valid(tile_valid && to_lane == c), .job_ready(lane_ready[c]),
                .job_table_addr(tile_table_addr), .job_table_n(tile_table_n),
                .job_in_addr(tile_in_addr), .job_in_n(tile_in_n),
                .job_scratch_addr(tile_scratch_addr), .job_out_addr(tile_out_addr), .job_first(cfg_first),
                .done_valid(lane_done[c]), .done_ready(lane_taken[c]), .done_n(lane_n[c*N_W +: N_W]),
                .m_axi_a_arvalid(m_axi_sort_arvalid[c]), .m_axi_a_arready(m_axi_sort_arready[c]),
                .m_axi_a_araddr(m_axi_sort_araddr[c*ADDR_W +: ADDR_W]), .m_axi_a_arlen(m_axi_sort_arlen[c*8 +: 8]),
                .m_axi_a_arsize(m_axi_sort_arsize[c*3 +: 3]), .m_axi_a_arburst(m_axi_sort_arburst[c*2 +: 2]),
                .m_axi_a_rvalid(m_axi_sort_rvalid[c]), .m_axi_a_rready(m_axi_sort_rready[c]),
                .m_axi_a_rdata(m_axi_sort_rdata[c*64 +: 64]), .m_axi_a_rresp(m_axi_sort_rresp[c*2 +: 2]),
                .m_axi_a_rlast(m_axi_sort_rlast[c]), .m_axi_a_awvalid(m_axi_sort_awvalid[c]),
                .m_axi_a_awready(m_axi_sort_awready[c]), .m_axi_a_awaddr(m_axi_sort_awaddr[c*ADDR_W +: ADDR_W]),
                .m_axi_a_awlen(m_axi_sort_awlen[c*8 +: 8]), .m_axi_a_awsize(m_axi_sort_awsize[c*3 +: 3]),
                .m_axi_a_awburst(m_axi_sort_awburst[c*2 +: 2]), .m_axi_a_wvalid(m_axi_sort_wvalid[c]),
                .m_axi_a_wready(m_axi_sort_wready[c]), .m_axi_a_wdata(m_axi_sort_wdata[c*64 +: 64]),
                .m_axi_a_wstrb(m_axi_sort_wstrb[c*8 +: 8]), .m_axi_a_wlast(m_axi_sort_wlast[c]),
                .m_axi_a_bvalid(m_axi_sort_bvalid[c]), .m_axi_a_bready(m_axi_sort_bready[c]),
                .m_axi_a_bresp(m_axi_sort_bresp[c*2 +: 2]),
                .m_axi_b_arvalid(m_axi_insert_arvalid[c]), .m_axi_b_arready(m_axi_insert_arready[c]),
                .m_axi_b_araddr(m_axi_insert_araddr[c*ADDR_W +: ADDR_W]),
                .m_axi_b_arlen(m_axi_insert_arlen[c*8 +: 8]), .m_axi_b_arsize(m_axi_insert_arsize[c*3 +: 3]),
                .m_axi_b_arburst(m_axi_insert_arburst[c*2 +: 2]), .m_axi_b_rvalid(m_axi_insert_rvalid[c]),
                .m_axi_b_rready(m_axi_insert_rready[c]), .m_axi_b_rdata(m_axi_insert_rdata[c*64 +: 64]),
                .m_axi_b_rresp(m_axi_insert_rresp[c*2 +: 2]), .m_axi_b_rlast(m_axi_insert_rlast[c]),
                .error(lane_error[c])
            );
        end
    endgenerate

    wire              queue_valid;
    wire              queue_ready;
    wire [6:0]        start_column;
    wire [6:0]        start_row;
    wire [LINE_W-1:0] start_line;
    gs_fifo #(.WIDTH(14 + LINE_W), .DEPTH(2*CORES)) tile_queue (
        .clk(clk), .rst(rst),
        .in_valid(tile_go), .in_ready(queue_ready), .in_data({tile_y[12:6], tile_x[12:6], tile_out_addr[ADDR_W-1:3]}),
        .out_valid(queue_valid), .out_ready(start_go), .out_data({start_row, start_column, start_line})
    );

    assign start_valid = queue_valid && lane_done[from_lane];
    wire raster_error;
    gs_raster_lane #(.TILES(TILES), .ADDR_W(ADDR_W), .N_W(N_W)) raster_lane (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height),
        .cfg_bg_red(cfg_bg_red), .cfg_bg_green(cfg_bg_green), .cfg_bg_blue(cfg_bg_blue),
        .cfg_feature_addr(cfg_feature_addr), .cfg_frame_addr(cfg_frame_addr), .cfg_frame_stride(cfg_frame_stride),
        .start_valid(start_valid), .start_ready(start_ready), .start_column(start_column), .start_row(start_row),
        .start_line(start_line), .start_n(lane_n[from_lane*N_W +: N_W]),
        .done_valid(done_valid), .done_ready(done_ready), .done_n(done_n),
        .m_axi_table_arvalid(m_axi_table_arvalid), .m_axi_table_arready(m_axi_table_arready),
        .m_axi_table_araddr(m_axi_table_araddr), .m_axi_table_arlen(m_axi_table_arlen),
        .m_axi_table_arsize(m_axi_table_arsize), .m_axi_table_arburst(m_axi_table_arburst),
        .m_axi_table_rvalid(m_axi_table_rvalid), .m_axi_table_rready(m_axi_table_rready),
        .m_axi_table_rdata(m_axi_table_rdata), .m_axi_table_rresp(m_axi_table_rresp),
        .m_axi_table_rlast(m_axi_table_rlast), .m_axi_table_awvalid(m_axi_table_awvalid),
        .m_axi_table_awready(m_axi_table_awready), .m_axi_table_awaddr(m_axi_table_awaddr),
        .m_axi_table_awlen(m_axi_table_awlen), .m_axi_table_awsize(m_axi_table_awsize),
        .m_axi_table_awburst(m_axi_table_awburst), .m_axi_table_wvalid(m_axi_table_wvalid),
        .m_axi_table_wready(m_axi_table_wready), .m_axi_table_wdata(m_axi_table_wdata),
        .m_axi_table_wstrb(m_axi_table_wstrb), .m_axi_table_wlast(m_axi_table_wlast),
        .m_axi_table_bvalid(m_axi_table_bvalid), .m_axi_table_bready(m_axi_table_bready),
        .m_axi_table_bresp(m_axi_table_bresp),
        .m_axi_feature_arvalid(m_axi_feature_arvalid), .m_axi_feature_arready(m_axi_feature_arready),
        .m_axi_feature_araddr(m_axi_feature_araddr), .m_axi_feature_arlen(m_axi_feature_arlen),
        .m_axi_feature_arsize(m_axi_feature_arsize), .m_axi_feature_arburst(m_axi_feature_arburst),
        .m_axi_feature_rvalid(m_axi_feature_rvalid), .m_axi_feature_rready(m_axi_feature_rready),
        .m_axi_feature_rdata(m_axi_feature_rdata), .m_axi_feature_rresp(m_axi_feature_rresp),
        .m_axi_feature_rlast(m_axi_feature_rlast),
        .m_axi_pixel_awvalid(m_axi_pixel_awvalid), .m_axi_pixel_awready(m_axi_pixel_awready),
        .m_axi_pixel_awaddr(m_axi_pixel_awaddr), .m_axi_pixel_awlen(m_axi_pixel_awlen),
        .m_axi_pixel_awsize(m_axi_pixel_awsize), .m_axi_pixel_awburst(m_axi_pixel_awburst),
        .m_axi_pixel_wvalid(m_axi_pixel_wvalid), .m_axi_pixel_wready(m_axi_pixel_wready),
        .m_axi_pixel_wdata(m_axi_pixel_wdata), .m_axi_pixel_wstrb(m_axi_pixel_wstrb),
        .m_axi_pixel_wlast(m_axi_pixel_wlast), .m_axi_pixel_bvalid(m_axi_pixel_bvalid),
        .m_axi_pixel_bready(m_axi_pixel_bready), .m_axi_pixel_bresp(m_axi_pixel_bresp),
        .error(raster_error),
        .trace_itu_valid(trace_itu_valid), .trace_itu_group(trace_itu_group), .trace_itu_slot(trace_itu_slot),
        .trace_itu_hits(trace_itu_hits), .trace_px_valid(trace_px_valid), .trace_px_rgb(trace_px_rgb),
        .trace_blend_valid(trace_blend_valid), .trace_blend(trace_blend), .trace_tile_done(trace_tile_done)
    );

    assign error = (|lane_error) || raster_error;

    wire unused_ok = &{1'b0, tile_x[5:0], tile_y[5:0], tile_out_addr[2:0], queue_ready};

endmodule

`default_nettype wire
