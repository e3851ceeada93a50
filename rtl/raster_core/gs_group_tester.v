// gs_group_tester: tests a batch group by group against four subtiles at once, and lists the hits of each subtile.
//
//   one entry a cycle, one cycle between groups; a hit arrives LATENCY = 10 cycles behind the read of its geometry
//
//   R  read      geometry of the slot                           1 cycle
//   T  test      gs_group_test_unit                          9 cycles
//
//   Two sets of lists: one is filled while the other is blended. The set of group g is g & 1.

`default_nettype none
`include "gs_params.vh"

module gs_group_tester #(
    parameter CHUNK      = `GS_CHUNK,
    parameter UNITS      = `GS_UNITS,
    parameter GROUPS     = `GS_GROUPS,
    parameter SUBTILE    = `GS_SUBTILE,
    parameter GEOMETRY_W = `GS_GEOMETRY_W,
    parameter PIXEL_W    = 13  // bits of a pixel coordinate
) (
    input  wire                              clk,
    input  wire                              rst,
    input  wire [PIXEL_W-1:0]                cfg_width,   // of the picture, pixels
    input  wire [PIXEL_W-1:0]                cfg_height,

    // test: the batch, as gs_batch_buffer gives it
    input  wire                              test_valid,
    input  wire [$clog2(CHUNK):0]            test_n,
    input  wire [PIXEL_W-1:0]                test_x,
    input  wire [PIXEL_W-1:0]                test_y,
    output wire                              test_issued,
    output wire                              geometry_en,
    output wire [$clog2(CHUNK)-1:0]          geometry_slot,
    input  wire [GEOMETRY_W-1:0]             geometry,

    // hit: result of each test
    output wire                              hit_valid,
    output wire [UNITS-1:0]                  hit_units,
    output wire                              hit_first,   // of the first group
    output wire                              hit_last,    // last slot of the last group
    output wire [$clog2(GROUPS)-1:0]         hit_group,
    output wire [$clog2(CHUNK)-1:0]          hit_slot,

    // list: a group's finished lists hold until the pulse list_done; a slot one cycle behind its position
    output wire                              list_valid,
    output wire [UNITS*($clog2(CHUNK)+1)-1:0] list_count,
    input  wire                              list_done,
    input  wire [UNITS-1:0]                  list_en,
    input  wire [UNITS*$clog2(CHUNK)-1:0]    list_pos,
    output wire [UNITS*$clog2(CHUNK)-1:0]    list_slot
);

    localparam SLOT_W  = $clog2(CHUNK);
    localparam GROUP_W = $clog2(GROUPS);
    localparam LATENCY = 10;
    localparam SPAN_W  = 2 + $clog2(SUBTILE);  // bits of a pixel column in a group

    generate
        if (UNITS != 4 || GROUPS != 16 || SUBTILE != 8) begin : g_rule
            UNITS_must_be_4_and_GROUPS_16_and_SUBTILE_8 bad ();
        end
    endgenerate

    // Issue: a group starts when its set of lists is free.
    reg                run;
    reg  [GROUP_W-1:0] group;
    reg  [SLOT_W-1:0]  slot;
    reg  [1:0]         list_used;
    wire               empty     = test_n == {SLOT_W+1{1'b0}};
    wire               start     = !run && test_valid && !empty && !list_used[group[0]];
    wire [SLOT_W:0]    slot_next = {1'b0, slot} + {{SLOT_W{1'b0}}, 1'b1};
    wire               group_end = run && slot_next == test_n;
    assign test_issued   = (group_end && group == {GROUP_W{1'b1}}) || (!run && test_valid && empty);
    assign geometry_en   = run;
    assign geometry_slot = slot;
    always @(posedge clk) begin
        if (start) run <= 1'b1;
        if (group_end) run <= 1'b0;
        if (run) slot <= slot_next[SLOT_W-1:0];
        if (group_end) slot <= {SLOT_W{1'b0}};
        if (group_end) group <= group + {{GROUP_W-1{1'b0}}, 1'b1};
        if (rst) begin
            run   <= 1'b0;
            slot  <= {SLOT_W{1'b0}};
            group <= {GROUP_W{1'b0}};
        end
    end

    // First pixel of the group
    wire [PIXEL_W-1:0] group_x = {test_x[PIXEL_W-1:SPAN_W+1], group[0], {SPAN_W{1'b0}}};
    wire [PIXEL_W-1:0] group_y = {test_y[PIXEL_W-1:SPAN_W+1], group[GROUP_W-1:1], {SPAN_W-2{1'b0}}};

    // R read
    reg               r_valid;
    reg [PIXEL_W-1:0] r_x;
    reg [PIXEL_W-1:0] r_y;
    always @(posedge clk) begin
        r_valid <= run && !rst;
        r_x     <= group_x;
        r_y     <= group_y;
    end

    // T test. The mark of a group's last one travels beside.
    gs_group_test_unit test_unit (
        .clk(clk), .rst(rst), .cfg_width(cfg_width), .cfg_height(cfg_height),
        .in_valid(r_valid), .in_x(r_x), .in_y(r_y), .in_geometry(geometry),
        .out_valid(hit_valid), .out_hits(hit_units)
    );
    reg [LATENCY-1:0] ends;  // newest on top
    always @(posedge clk) ends <= {group_end, ends[LATENCY-1:1]};
    wire t_end = ends[0];

    reg [GROUP_W-1:0] t_group;
    reg [SLOT_W-1:0]  t_slot;
    assign hit_first = t_group == {GROUP_W{1'b0}};
    assign hit_last  = t_end && t_group == {GROUP_W{1'b1}};
    assign hit_group = t_group;
    assign hit_slot  = t_slot;
    always @(posedge clk) begin
        if (hit_valid) t_slot <= t_end ? {SLOT_W{1'b0}} : t_slot + {{SLOT_W-1{1'b0}}, 1'b1};
        if (hit_valid && t_end) t_group <= t_group + {{GROUP_W-1{1'b0}}, 1'b1};
        if (rst) begin
            t_slot  <= {SLOT_W{1'b0}};
            t_group <= {GROUP_W{1'b0}};
        end
    end

    // Lists
    reg       read_set;
    reg [1:0] list_full;
    assign list_valid = list_full[read_set];
    always @(posedge clk) begin
        if (start) list_used[group[0]] <= 1'b1;
        if (hit_valid && t_end) list_full[t_group[0]] <= 1'b1;
        if (list_done) list_used[read_set] <= 1'b0;
        if (list_done) list_full[read_set] <= 1'b0;
        if (list_done) read_set <= !read_set;
        if (rst) begin
            list_used <= 2'b00;
            list_full <= 2'b00;
            read_set  <= 1'b0;
        end
    end
    genvar s;
    generate
        for (s = 0; s < UNITS; s = s + 1) begin : g_list
            reg  [SLOT_W:0] count_0;
            reg  [SLOT_W:0] count_1;
            wire [SLOT_W:0] count = t_group[0] ? count_1 : count_0;
            wire            put   = hit_valid && hit_units[s];
            assign list_count[s*(SLOT_W+1) +: SLOT_W+1] = read_set ? count_1 : count_0;
            always @(posedge clk) begin
                if (put && !t_group[0]) count_0 <= count_0 + {{SLOT_W{1'b0}}, 1'b1};
                if (put && t_group[0])  count_1 <= count_1 + {{SLOT_W{1'b0}}, 1'b1};
                if (rst || (list_done && !read_set)) count_0 <= {SLOT_W+1{1'b0}};
                if (rst || (list_done && read_set))  count_1 <= {SLOT_W+1{1'b0}};
            end
            gs_ram #(.WIDTH(SLOT_W), .DEPTH(2*CHUNK)) list_ram (
                .clk(clk),
                .wr_en(put), .wr_addr({t_group[0], count[SLOT_W-1:0]}), .wr_data(t_slot),
                .rd_en(list_en[s]), .rd_addr({read_set, list_pos[s*SLOT_W +: SLOT_W]}),
                .rd_data(list_slot[s*SLOT_W +: SLOT_W])
            );
            wire unused_count_ok = &{1'b0, count[SLOT_W]};
        end
    endgenerate

    wire unused_ok = &{1'b0, test_x[SPAN_W:0], test_y[SPAN_W:0]};

endmodule

`default_nettype wire
