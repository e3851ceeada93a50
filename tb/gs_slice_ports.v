// gs_slice_ports: gs_slice with a port of its own for each memory master, as most interconnects want them.

`default_nettype none
`include "gs_params.vh"

module gs_slice_ports (
    input wire clk, input wire rst,

    // configuration, tile, done, status: as gs_slice
    input wire [12:0] cfg_width, input wire [12:0] cfg_height, input wire [`GS_COLOUR_W-1:0] cfg_bg_red,
    input wire [`GS_COLOUR_W-1:0] cfg_bg_green, input wire [`GS_COLOUR_W-1:0] cfg_bg_blue,
    input wire [31:0] cfg_feature_addr, input wire [31:0] cfg_frame_addr, input wire [15:0] cfg_frame_stride,
    input wire [8:0] cfg_first,
    input wire tile_valid, output wire tile_ready, input wire [12:0] tile_x, input wire [12:0] tile_y,
    input wire [31:0] tile_table_addr, input wire [23:0] tile_table_n, input wire [31:0] tile_in_addr,
    input wire [23:0] tile_in_n, input wire [31:0] tile_scratch_addr, input wire [31:0] tile_out_addr,
    output wire done_valid, input wire done_ready, output wire [23:0] done_n, output wire error,

    // sort lane 0
    output wire [0:0] m_axi_sort0_arid, output wire m_axi_sort0_arvalid, input wire m_axi_sort0_arready,
    output wire [31:0] m_axi_sort0_araddr, output wire [7:0] m_axi_sort0_arlen, output wire [2:0] m_axi_sort0_arsize,
    output wire [1:0] m_axi_sort0_arburst,
    input wire [0:0] m_axi_sort0_rid, input wire m_axi_sort0_rvalid, output wire m_axi_sort0_rready,
    input wire [63:0] m_axi_sort0_rdata, input wire [1:0] m_axi_sort0_rresp, input wire m_axi_sort0_rlast,
    output wire [0:0] m_axi_sort0_awid, output wire m_axi_sort0_awvalid, input wire m_axi_sort0_awready,
    output wire [31:0] m_axi_sort0_awaddr, output wire [7:0] m_axi_sort0_awlen, output wire [2:0] m_axi_sort0_awsize,
    output wire [1:0] m_axi_sort0_awburst,
    output wire m_axi_sort0_wvalid, input wire m_axi_sort0_wready, output wire [63:0] m_axi_sort0_wdata,
    output wire [7:0] m_axi_sort0_wstrb, output wire m_axi_sort0_wlast,
    input wire [0:0] m_axi_sort0_bid, input wire m_axi_sort0_bvalid, output wire m_axi_sort0_bready,
    input wire [1:0] m_axi_sort0_bresp,
    output wire [0:0] m_axi_insert0_arid, output wire m_axi_insert0_arvalid, input wire m_axi_insert0_arready,
    output wire [31:0] m_axi_insert0_araddr, output wire [7:0] m_axi_insert0_arlen,
    output wire [2:0] m_axi_insert0_arsize, output wire [1:0] m_axi_insert0_arburst,
    input wire [0:0] m_axi_insert0_rid, input wire m_axi_insert0_rvalid, output wire m_axi_insert0_rready,
    input wire [63:0] m_axi_insert0_rdata, input wire [1:0] m_axi_insert0_rresp, input wire m_axi_insert0_rlast,

    // sort lane 1
    output wire [0:0] m_axi_sort1_arid, output wire m_axi_sort1_arvalid, input wire m_axi_sort1_arready,
    output wire [31:0] m_axi_sort1_araddr, output wire [7:0] m_axi_sort1_arlen, output wire [2:0] m_axi_sort1_arsize,
    output wire [1:0] m_axi_sort1_arburst,
    input wire [0:0] m_axi_sort1_rid, input wire m_axi_sort1_rvalid, output wire m_axi_sort1_rready,
    input wire [63:0] m_axi_sort1_rdata, input wire [1:0] m_axi_sort1_rresp, input wire m_axi_sort1_rlast,
    output wire [0:0] m_axi_sort1_awid, output wire m_axi_sort1_awvalid, input wire m_axi_sort1_awready,
    output wire [31:0] m_axi_sort1_awaddr, output wire [7:0] m_axi_sort1_awlen, output wire [2:0] m_axi_sort1_awsize,
    output wire [1:0] m_axi_sort1_awburst,
    output wire m_axi_sort1_wvalid, input wire m_axi_sort1_wready, output wire [63:0] m_axi_sort1_wdata,
    output wire [7:0] m_axi_sort1_wstrb, output wire m_axi_sort1_wlast,
    input wire [0:0] m_axi_sort1_bid, input wire m_axi_sort1_bvalid, output wire m_axi_sort1_bready,
    input wire [1:0] m_axi_sort1_bresp,
    output wire [0:0] m_axi_insert1_arid, output wire m_axi_insert1_arvalid, input wire m_axi_insert1_arready,
    output wire [31:0] m_axi_insert1_araddr, output wire [7:0] m_axi_insert1_arlen,
    output wire [2:0] m_axi_insert1_arsize, output wire [1:0] m_axi_insert1_arburst,
    input wire [0:0] m_axi_insert1_rid, input wire m_axi_insert1_rvalid, output wire m_axi_insert1_rready,
    input wire [63:0] m_axi_insert1_rdata, input wire [1:0] m_axi_insert1_rresp, input wire m_axi_insert1_rlast,

    // sort lane 2
    output wire [0:0] m_axi_sort2_arid, output wire m_axi_sort2_arvalid, input wire m_axi_sort2_arready,
    output wire [31:0] m_axi_sort2_araddr, output wire [7:0] m_axi_sort2_arlen, output wire [2:0] m_axi_sort2_arsize,
    output wire [1:0] m_axi_sort2_arburst,
    input wire [0:0] m_axi_sort2_rid, input wire m_axi_sort2_rvalid, output wire m_axi_sort2_rready,
    input wire [63:0] m_axi_sort2_rdata, input wire [1:0] m_axi_sort2_rresp, input wire m_axi_sort2_rlast,
    output wire [0:0] m_axi_sort2_awid, output wire m_axi_sort2_awvalid, input wire m_axi_sort2_awready,
    output wire [31:0] m_axi_sort2_awaddr, output wire [7:0] m_axi_sort2_awlen, output wire [2:0] m_axi_sort2_awsize,
    output wire [1:0] m_axi_sort2_awburst,
    output wire m_axi_sort2_wvalid, input wire m_axi_sort2_wready, output wire [63:0] m_axi_sort2_wdata,
    output wire [7:0] m_axi_sort2_wstrb, output wire m_axi_sort2_wlast,
    input wire [0:0] m_axi_sort2_bid, input wire m_axi_sort2_bvalid, output wire m_axi_sort2_bready,
    input wire [1:0] m_axi_sort2_bresp,
    output wire [0:0] m_axi_insert2_arid, output wire m_axi_insert2_arvalid, input wire m_axi_insert2_arready,
    output wire [31:0] m_axi_insert2_araddr, output wire [7:0] m_axi_insert2_arlen,
    output wire [2:0] m_axi_insert2_arsize, output wire [1:0] m_axi_insert2_arburst,
    input wire [0:0] m_axi_insert2_rid, input wire m_axi_insert2_rvalid, output wire m_axi_insert2_rready,
    input wire [63:0] m_axi_insert2_rdata, input wire [1:0] m_axi_insert2_rresp, input wire m_axi_insert2_rlast,

    // sort lane 3
    output wire [0:0] m_axi_sort3_arid, output wire m_axi_sort3_arvalid, input wire m_axi_sort3_arready,
    output wire [31:0] m_axi_sort3_araddr, output wire [7:0] m_axi_sort3_arlen, output wire [2:0] m_axi_sort3_arsize,
    output wire [1:0] m_axi_sort3_arburst,
    input wire [0:0] m_axi_sort3_rid, input wire m_axi_sort3_rvalid, output wire m_axi_sort3_rready,
    input wire [63:0] m_axi_sort3_rdata, input wire [1:0] m_axi_sort3_rresp, input wire m_axi_sort3_rlast,
    output wire [0:0] m_axi_sort3_awid, output wire m_axi_sort3_awvalid, input wire m_axi_sort3_awready,
    output wire [31:0] m_axi_sort3_awaddr, output wire [7:0] m_axi_sort3_awlen, output wire [2:0] m_axi_sort3_awsize,
    output wire [1:0] m_axi_sort3_awburst,
    output wire m_axi_sort3_wvalid, input wire m_axi_sort3_wready, output wire [63:0] m_axi_sort3_wdata,
    output wire [7:0] m_axi_sort3_wstrb, output wire m_axi_sort3_wlast,
    input wire [0:0] m_axi_sort3_bid, input wire m_axi_sort3_bvalid, output wire m_axi_sort3_bready,
    input wire [1:0] m_axi_sort3_bresp,
    output wire [0:0] m_axi_insert3_arid, output wire m_axi_insert3_arvalid, input wire m_axi_insert3_arready,
    output wire [31:0] m_axi_insert3_araddr, output wire [7:0] m_axi_insert3_arlen,
    output wire [2:0] m_axi_insert3_arsize, output wire [1:0] m_axi_insert3_arburst,
    input wire [0:0] m_axi_insert3_rid, input wire m_axi_insert3_rvalid, output wire m_axi_insert3_rready,
    input wire [63:0] m_axi_insert3_rdata, input wire [1:0] m_axi_insert3_rresp, input wire m_axi_insert3_rlast,

    // raster lane
    output wire [0:0] m_axi_table_arid, output wire m_axi_table_arvalid, input wire m_axi_table_arready,
    output wire [31:0] m_axi_table_araddr, output wire [7:0] m_axi_table_arlen, output wire [2:0] m_axi_table_arsize,
    output wire [1:0] m_axi_table_arburst,
    input wire [0:0] m_axi_table_rid, input wire m_axi_table_rvalid, output wire m_axi_table_rready,
    input wire [63:0] m_axi_table_rdata, input wire [1:0] m_axi_table_rresp, input wire m_axi_table_rlast,
    output wire [0:0] m_axi_table_awid, output wire m_axi_table_awvalid, input wire m_axi_table_awready,
    output wire [31:0] m_axi_table_awaddr, output wire [7:0] m_axi_table_awlen, output wire [2:0] m_axi_table_awsize,
    output wire [1:0] m_axi_table_awburst,
    output wire m_axi_table_wvalid, input wire m_axi_table_wready, output wire [63:0] m_axi_table_wdata,
    output wire [7:0] m_axi_table_wstrb, output wire m_axi_table_wlast,
    input wire [0:0] m_axi_table_bid, input wire m_axi_table_bvalid, output wire m_axi_table_bready,
    input wire [1:0] m_axi_table_bresp,
    output wire [0:0] m_axi_feature_arid, output wire m_axi_feature_arvalid, input wire m_axi_feature_arready,
    output wire [31:0] m_axi_feature_araddr, output wire [7:0] m_axi_feature_arlen,
    output wire [2:0] m_axi_feature_arsize, output wire [1:0] m_axi_feature_arburst,
    input wire [0:0] m_axi_feature_rid, input wire m_axi_feature_rvalid, output wire m_axi_feature_rready,
    input wire [63:0] m_axi_feature_rdata, input wire [1:0] m_axi_feature_rresp, input wire m_axi_feature_rlast,
    output wire [0:0] m_axi_pixel_awid, output wire m_axi_pixel_awvalid, input wire m_axi_pixel_awready,
    output wire [31:0] m_axi_pixel_awaddr, output wire [7:0] m_axi_pixel_awlen, output wire [2:0] m_axi_pixel_awsize,
    output wire [1:0] m_axi_pixel_awburst,
    output wire m_axi_pixel_wvalid, input wire m_axi_pixel_wready, output wire [127:0] m_axi_pixel_wdata,
    output wire [15:0] m_axi_pixel_wstrb, output wire m_axi_pixel_wlast,
    input wire [0:0] m_axi_pixel_bid, input wire m_axi_pixel_bvalid, output wire m_axi_pixel_bready,
    input wire [1:0] m_axi_pixel_bresp
);

    assign m_axi_sort0_arid = 1'b0;
    assign m_axi_insert0_arid = 1'b0;
    assign m_axi_sort0_awid = 1'b0;
    assign m_axi_sort1_arid = 1'b0;
    assign m_axi_insert1_arid = 1'b0;
    assign m_axi_sort1_awid = 1'b0;
    assign m_axi_sort2_arid = 1'b0;
    assign m_axi_insert2_arid = 1'b0;
    assign m_axi_sort2_awid = 1'b0;
    assign m_axi_sort3_arid = 1'b0;
    assign m_axi_insert3_arid = 1'b0;
    assign m_axi_sort3_awid = 1'b0;
    assign m_axi_table_arid = 1'b0;
    assign m_axi_table_awid = 1'b0;
    assign m_axi_feature_arid = 1'b0;
    assign m_axi_pixel_awid = 1'b0;
    wire unused_ids = &{1'b0, m_axi_sort0_rid, m_axi_sort0_bid, m_axi_sort1_rid, m_axi_sort1_bid, m_axi_sort2_rid,
                            m_axi_sort2_bid, m_axi_sort3_rid, m_axi_sort3_bid, m_axi_table_rid, m_axi_table_bid,
                            m_axi_insert0_rid, m_axi_insert1_rid, m_axi_insert2_rid, m_axi_insert3_rid,
                            m_axi_feature_rid, m_axi_pixel_bid};

    wire [3:0] trace_sort_done;
    wire trace_itu_valid;
    wire [3:0] trace_itu_group;
    wire [7:0] trace_itu_slot;
    wire [3:0] trace_itu_hits;
    wire trace_px_valid;
    wire [12*`GS_ACC_W-1:0] trace_px_rgb;
    wire [3:0] trace_blend_valid;
    wire [63:0] trace_blend;
    wire trace_tile_done;
    wire unused_traces = &{1'b0, trace_sort_done, trace_itu_valid, trace_itu_group, trace_itu_slot, trace_itu_hits,
                           trace_px_valid, trace_px_rgb, trace_blend_valid, trace_blend, trace_tile_done};

    gs_slice slice (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height), .cfg_bg_red(cfg_bg_red),
        .cfg_bg_green(cfg_bg_green), .cfg_bg_blue(cfg_bg_blue), .cfg_feature_addr(cfg_feature_addr),
        .cfg_frame_addr(cfg_frame_addr), .cfg_frame_stride(cfg_frame_stride), .cfg_first(cfg_first),
        .tile_valid(tile_valid), .tile_ready(tile_ready), .tile_x(tile_x), .tile_y(tile_y),
        .tile_table_addr(tile_table_addr), .tile_table_n(tile_table_n), .tile_in_addr(tile_in_addr),
        .tile_in_n(tile_in_n), .tile_scratch_addr(tile_scratch_addr), .tile_out_addr(tile_out_addr),
        .done_valid(done_valid), .done_ready(done_ready), .done_n(done_n), .error(error),
        .m_axi_sort_arvalid({m_axi_sort3_arvalid, m_axi_sort2_arvalid, m_axi_sort1_arvalid, m_axi_sort0_arvalid}),
        .m_axi_sort_arready({m_axi_sort3_arready, m_axi_sort2_arready, m_axi_sort1_arready, m_axi_sort0_arready}),
        .m_axi_sort_araddr({m_axi_sort3_araddr, m_axi_sort2_araddr, m_axi_sort1_araddr, m_axi_sort0_araddr}),
        .m_axi_sort_arlen({m_axi_sort3_arlen, m_axi_sort2_arlen, m_axi_sort1_arlen, m_axi_sort0_arlen}),
        .m_axi_sort_arsize({m_axi_sort3_arsize, m_axi_sort2_arsize, m_axi_sort1_arsize, m_axi_sort0_arsize}),
        .m_axi_sort_arburst({m_axi_sort3_arburst, m_axi_sort2_arburst, m_axi_sort1_arburst, m_axi_sort0_arburst}),
        .m_axi_sort_rvalid({m_axi_sort3_rvalid, m_axi_sort2_rvalid, m_axi_sort1_rvalid, m_axi_sort0_rvalid}),
        .m_axi_sort_rready({m_axi_sort3_rready, m_axi_sort2_rready, m_axi_sort1_rready, m_axi_sort0_rready}),
        .m_axi_sort_rdata({m_axi_sort3_rdata, m_axi_sort2_rdata, m_axi_sort1_rdata, m_axi_sort0_rdata}),
        .m_axi_sort_rresp({m_axi_sort3_rresp, m_axi_sort2_rresp, m_axi_sort1_rresp, m_axi_sort0_rresp}),
        .m_axi_sort_rlast({m_axi_sort3_rlast, m_axi_sort2_rlast, m_axi_sort1_rlast, m_axi_sort0_rlast}),
        .m_axi_sort_awvalid({m_axi_sort3_awvalid, m_axi_sort2_awvalid, m_axi_sort1_awvalid, m_axi_sort0_awvalid}),
        .m_axi_sort_awready({m_axi_sort3_awready, m_axi_sort2_awready, m_axi_sort1_awready, m_axi_sort0_awready}),
        .m_axi_sort_awaddr({m_axi_sort3_awaddr, m_axi_sort2_awaddr, m_axi_sort1_awaddr, m_axi_sort0_awaddr}),
        .m_axi_sort_awlen({m_axi_sort3_awlen, m_axi_sort2_awlen, m_axi_sort1_awlen, m_axi_sort0_awlen}),
        .m_axi_sort_awsize({m_axi_sort3_awsize, m_axi_sort2_awsize, m_axi_sort1_awsize, m_axi_sort0_awsize}),
        .m_axi_sort_awburst({m_axi_sort3_awburst, m_axi_sort2_awburst, m_axi_sort1_awburst, m_axi_sort0_awburst}),
        .m_axi_sort_wvalid({m_axi_sort3_wvalid, m_axi_sort2_wvalid, m_axi_sort1_wvalid, m_axi_sort0_wvalid}),
        .m_axi_sort_wready({m_axi_sort3_wready, m_axi_sort2_wready, m_axi_sort1_wready, m_axi_sort0_wready}),
        .m_axi_sort_wdata({m_axi_sort3_wdata, m_axi_sort2_wdata, m_axi_sort1_wdata, m_axi_sort0_wdata}),
        .m_axi_sort_wstrb({m_axi_sort3_wstrb, m_axi_sort2_wstrb, m_axi_sort1_wstrb, m_axi_sort0_wstrb}),
        .m_axi_sort_wlast({m_axi_sort3_wlast, m_axi_sort2_wlast, m_axi_sort1_wlast, m_axi_sort0_wlast}),
        .m_axi_sort_bvalid({m_axi_sort3_bvalid, m_axi_sort2_bvalid, m_axi_sort1_bvalid, m_axi_sort0_bvalid}),
        .m_axi_sort_bready({m_axi_sort3_bready, m_axi_sort2_bready, m_axi_sort1_bready, m_axi_sort0_bready}),
        .m_axi_sort_bresp({m_axi_sort3_bresp, m_axi_sort2_bresp, m_axi_sort1_bresp, m_axi_sort0_bresp}),
        .m_axi_insert_arvalid({
            m_axi_insert3_arvalid, m_axi_insert2_arvalid, m_axi_insert1_arvalid, m_axi_insert0_arvalid
        }),
        .m_axi_insert_arready({
            m_axi_insert3_arready, m_axi_insert2_arready, m_axi_insert1_arready, m_axi_insert0_arready
        }),
        .m_axi_insert_araddr({m_axi_insert3_araddr, m_axi_insert2_araddr, m_axi_insert1_araddr, m_axi_insert0_araddr}),
        .m_axi_insert_arlen({m_axi_insert3_arlen, m_axi_insert2_arlen, m_axi_insert1_arlen, m_axi_insert0_arlen}),
        .m_axi_insert_arsize({m_axi_insert3_arsize, m_axi_insert2_arsize, m_axi_insert1_arsize, m_axi_insert0_arsize}),
        .m_axi_insert_arburst({
            m_axi_insert3_arburst, m_axi_insert2_arburst, m_axi_insert1_arburst, m_axi_insert0_arburst
        }),
        .m_axi_insert_rvalid({m_axi_insert3_rvalid, m_axi_insert2_rvalid, m_axi_insert1_rvalid, m_axi_insert0_rvalid}),
        .m_axi_insert_rready({m_axi_insert3_rready, m_axi_insert2_rready, m_axi_insert1_rready, m_axi_insert0_rready}),
        .m_axi_insert_rdata({m_axi_insert3_rdata, m_axi_insert2_rdata, m_axi_insert1_rdata, m_axi_insert0_rdata}),
        .m_axi_insert_rresp({m_axi_insert3_rresp, m_axi_insert2_rresp, m_axi_insert1_rresp, m_axi_insert0_rresp}),
        .m_axi_insert_rlast({m_axi_insert3_rlast, m_axi_insert2_rlast, m_axi_insert1_rlast, m_axi_insert0_rlast}),
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
        .trace_sort_done(trace_sort_done), .trace_itu_valid(trace_itu_valid), .trace_itu_group(trace_itu_group),
        .trace_itu_slot(trace_itu_slot), .trace_itu_hits(trace_itu_hits), .trace_px_valid(trace_px_valid),
        .trace_px_rgb(trace_px_rgb), .trace_blend_valid(trace_blend_valid), .trace_blend(trace_blend),
        .trace_tile_done(trace_tile_done)
    );

endmodule

`default_nettype wire
