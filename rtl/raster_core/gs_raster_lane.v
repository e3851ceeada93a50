// gs_raster_lane: the raster core with what brings its tables and features and takes its tables and pixels to memory.
//
//   start ─► list reader ─► raster core ─┬─► block writer, over the table just read ─┬─► done
//                           ▲    │       └─► pixel writer ───────────────────────────┘
//                           │    └─► queue ─► record reader ─┐
//                           └────────────────────────────────┘
//   Up to TILES tiles lie between start and done. start_ready sees registers only.
//   Cycles of a tile: golden/raster_core/raster_lane.py

`default_nettype none
`include "gs_params.vh"

module gs_raster_lane #(
    parameter TILES  = 8,               // a power of two
    parameter ADDR_W = 32,
    parameter N_W    = 24
) (
    input  wire                    clk,
    input  wire                    rst,

    // configuration: static while tiles are under way
    input  wire [12:0]             cfg_width,           // pixels
    input  wire [12:0]             cfg_height,
    input  wire [`GS_COLOUR_W-1:0] cfg_bg_red,          // UQ3.COLOUR_F
    input  wire [`GS_COLOUR_W-1:0] cfg_bg_green,
    input  wire [`GS_COLOUR_W-1:0] cfg_bg_blue,
    input  wire [ADDR_W-1:0]       cfg_feature_addr,    // of record 0, a multiple of 8
    input  wire [ADDR_W-1:0]       cfg_frame_addr,      // of pixel (0, 0), a multiple of 16
    input  wire [15:0]             cfg_frame_stride,    // bytes from row to row, a multiple of 16

    // start: origin of a tile in tiles; its sorted table, n valid entries at a multiple of 8 bytes
    input  wire                    start_valid,
    output wire                    start_ready,
    input  wire [6:0]              start_column,
    input  wire [6:0]              start_row,
    input  wire [ADDR_W-4:0]       start_line,          // byte address / 8
    input  wire [N_W-1:0]          start_n,

    // done: table and pixels are in memory; n entries
    output wire                    done_valid,
    input  wire                    done_ready,
    output wire [N_W-1:0]          done_n,

    // m_axi_table: read the table and write it back
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

    // trace: of the raster core; may be left open
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

    localparam COUNT_W = $clog2(TILES) + 1;
    localparam LINE_W  = ADDR_W - 3;
    localparam [COUNT_W-1:0] TILES_N = TILES;

    generate
        if (TILES < 2 || TILES != (1 << (COUNT_W - 1))) begin : g_illegal
            TILES_must_be_a_power_of_two bad ();
        end
    endgenerate

    // The raster core takes the tile and the list reader its table in one cycle, and the writers get their commands:
    // both are free behind the table's last beat
    reg  [COUNT_W-1:0] started;         // tiles between start and done: the queues never fill
    wire               raster_tile_ready;
    wire               table_cmd_ready;
    wire               start_go = start_valid && start_ready;
    wire               done_go  = done_valid && done_ready;
    assign start_ready = started != TILES_N && raster_tile_ready && table_cmd_ready;

    always @(posedge clk) begin
        started <= started + {{COUNT_W-1{1'b0}}, start_go} - {{COUNT_W-1{1'b0}}, done_go};
        if (rst) started <= {COUNT_W{1'b0}};
    end

    wire                   entry_valid;
    wire                   entry_ready;
    wire [`GS_ENTRY_W-1:0] entry_word;
    wire                   entry_last;
    wire                   table_error;
    gs_axi_list_reader #(.ADDR_W(ADDR_W), .N_W(N_W)) table_reader (
        .clk(clk), .rst(rst),
        .cmd_valid(start_go), .cmd_ready(table_cmd_ready),
        .cmd_addr({start_line, 3'd0}), .cmd_n(start_n),
        .m_axi_arvalid(m_axi_table_arvalid), .m_axi_arready(m_axi_table_arready), .m_axi_araddr(m_axi_table_araddr),
        .m_axi_arlen(m_axi_table_arlen), .m_axi_arsize(m_axi_table_arsize), .m_axi_arburst(m_axi_table_arburst),
        .m_axi_rvalid(m_axi_table_rvalid), .m_axi_rready(m_axi_table_rready), .m_axi_rdata(m_axi_table_rdata),
        .m_axi_rresp(m_axi_table_rresp), .m_axi_rlast(m_axi_table_rlast),
        .list_valid(entry_valid), .list_ready(entry_ready), .list_entry(entry_word), .list_last(entry_last),
        .error(table_error)
    );

    // The queue takes up the second bursts of records that cross a border
    wire                    req_valid;
    wire                    req_ready;
    wire [`GS_INDEX_W-1:0]  req_index;
    wire                    idx_valid;
    wire                    idx_ready;
    wire [`GS_INDEX_W-1:0]  idx_index;
    wire                    feat_valid;
    wire                    feat_ready;
    wire [`GS_RECORD_W-1:0] feat_record;
    wire                    feature_error;
    gs_fifo #(.WIDTH(`GS_INDEX_W), .DEPTH(32)) request_queue (
        .clk(clk), .rst(rst),
        .in_valid(req_valid), .in_ready(req_ready), .in_data(req_index),
        .out_valid(idx_valid), .out_ready(idx_ready), .out_data(idx_index)
    );
    gs_axi_record_reader #(.ADDR_W(ADDR_W)) record_reader (
        .clk(clk), .rst(rst), .cfg_addr(cfg_feature_addr),
        .idx_valid(idx_valid), .idx_ready(idx_ready), .idx_index(idx_index),
        .m_axi_arvalid(m_axi_feature_arvalid), .m_axi_arready(m_axi_feature_arready),
        .m_axi_araddr(m_axi_feature_araddr), .m_axi_arlen(m_axi_feature_arlen), .m_axi_arsize(m_axi_feature_arsize),
        .m_axi_arburst(m_axi_feature_arburst), .m_axi_rvalid(m_axi_feature_rvalid),
        .m_axi_rready(m_axi_feature_rready), .m_axi_rdata(m_axi_feature_rdata), .m_axi_rresp(m_axi_feature_rresp),
        .m_axi_rlast(m_axi_feature_rlast),
        .rec_valid(feat_valid), .rec_ready(feat_ready), .rec_record(feat_record), .error(feature_error)
    );

    wire                   upd_valid;
    wire                   upd_ready;
    wire [`GS_ENTRY_W-1:0] upd_word;
    wire [8:0]             upd_len;
    wire                   upd_last;
    wire                   px_valid;
    wire                   px_ready;
    wire [127:0]           px_data;
    wire [15:0]            px_strb;
    wire                   px_last;
    gs_raster_core raster_core (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height),
        .cfg_bg_red(cfg_bg_red), .cfg_bg_green(cfg_bg_green), .cfg_bg_blue(cfg_bg_blue),
        .tile_valid(start_go), .tile_ready(raster_tile_ready),
        .tile_x({start_column, 6'd0}), .tile_y({start_row, 6'd0}),
        .entry_valid(entry_valid), .entry_ready(entry_ready), .entry_last(entry_last), .entry_word(entry_word),
        .feat_valid(feat_valid), .feat_ready(feat_ready), .feat_record(feat_record),
        .feat_req_valid(req_valid), .feat_req_ready(req_ready), .feat_req_index(req_index),
        .upd_valid(upd_valid), .upd_ready(upd_ready), .upd_word(upd_word), .upd_len(upd_len), .upd_last(upd_last),
        .px_valid(px_valid), .px_ready(px_ready), .px_data(px_data), .px_strb(px_strb), .px_last(px_last),
        .trace_itu_valid(trace_itu_valid), .trace_itu_group(trace_itu_group), .trace_itu_slot(trace_itu_slot),
        .trace_itu_hits(trace_itu_hits), .trace_px_rgb(trace_px_rgb), .trace_blend_valid(trace_blend_valid),
        .trace_blend(trace_blend), .trace_tile_done(trace_tile_done)
    );
    assign trace_px_valid = px_valid && px_ready;

    wire              out_valid;
    wire              out_ready;
    wire [LINE_W-1:0] out_line;
    wire              origin_valid;
    wire              origin_ready;
    wire [6:0]        origin_column;
    wire [6:0]        origin_row;
    wire [1:0]        queues_ready;
    gs_fifo #(.WIDTH(LINE_W), .DEPTH(TILES)) out_queue (
        .clk(clk), .rst(rst), .in_valid(start_go), .in_ready(queues_ready[0]), .in_data(start_line),
        .out_valid(out_valid), .out_ready(out_ready), .out_data(out_line)
    );
    gs_fifo #(.WIDTH(14), .DEPTH(TILES)) origin_queue (
        .clk(clk), .rst(rst), .in_valid(start_go), .in_ready(queues_ready[1]), .in_data({start_row, start_column}),
        .out_valid(origin_valid), .out_ready(origin_ready), .out_data({origin_row, origin_column})
    );

    wire table_done;
    wire pixel_done;
    wire update_error;
    wire pixel_error;
    assign done_valid = table_done && pixel_done;
    gs_axi_block_writer #(.ADDR_W(ADDR_W), .N_W(N_W), .DONES(TILES)) table_writer (
        .clk(clk), .rst(rst), .cmd_valid(out_valid), .cmd_ready(out_ready), .cmd_addr({out_line, 3'd0}),
        .blk_valid(upd_valid), .blk_ready(upd_ready), .blk_entry(upd_word), .blk_len(upd_len), .blk_last(upd_last),
        .m_axi_awvalid(m_axi_table_awvalid), .m_axi_awready(m_axi_table_awready), .m_axi_awaddr(m_axi_table_awaddr),
        .m_axi_awlen(m_axi_table_awlen), .m_axi_awsize(m_axi_table_awsize), .m_axi_awburst(m_axi_table_awburst),
        .m_axi_wvalid(m_axi_table_wvalid), .m_axi_wready(m_axi_table_wready), .m_axi_wdata(m_axi_table_wdata),
        .m_axi_wstrb(m_axi_table_wstrb), .m_axi_wlast(m_axi_table_wlast), .m_axi_bvalid(m_axi_table_bvalid),
        .m_axi_bready(m_axi_table_bready), .m_axi_bresp(m_axi_table_bresp),
        .done_valid(table_done), .done_ready(done_go), .done_n(done_n), .error(update_error)
    );
    gs_axi_pixel_writer #(.ADDR_W(ADDR_W), .DONES(TILES)) pixel_writer (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_addr(cfg_frame_addr), .cfg_stride(cfg_frame_stride),
        .cmd_valid(origin_valid), .cmd_ready(origin_ready),
        .cmd_x({origin_column, 6'd0}), .cmd_y({origin_row, 6'd0}),
        .px_valid(px_valid), .px_ready(px_ready), .px_data(px_data), .px_strb(px_strb), .px_last(px_last),
        .m_axi_awvalid(m_axi_pixel_awvalid), .m_axi_awready(m_axi_pixel_awready), .m_axi_awaddr(m_axi_pixel_awaddr),
        .m_axi_awlen(m_axi_pixel_awlen), .m_axi_awsize(m_axi_pixel_awsize), .m_axi_awburst(m_axi_pixel_awburst),
        .m_axi_wvalid(m_axi_pixel_wvalid), .m_axi_wready(m_axi_pixel_wready), .m_axi_wdata(m_axi_pixel_wdata),
        .m_axi_wstrb(m_axi_pixel_wstrb), .m_axi_wlast(m_axi_pixel_wlast), .m_axi_bvalid(m_axi_pixel_bvalid),
        .m_axi_bready(m_axi_pixel_bready), .m_axi_bresp(m_axi_pixel_bresp),
        .done_valid(pixel_done), .done_ready(done_go), .error(pixel_error)
    );

    assign error = table_error || feature_error || update_error || pixel_error;

    wire unused_ok = &{1'b0, queues_ready};

endmodule

`default_nettype wire
