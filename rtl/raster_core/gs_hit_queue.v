// gs_hit_queue: the hits of one SCU, list by list, and behind each list a mark.
//
//   a hit and a mark a cycle; a mark is shown MARK_DELAY = 2 cycles behind its close; a slot comes one cycle behind slot_en
//
//   Nothing here waits: the tester looks at slot_used and mark_used before it begins what may come here.

`default_nettype none
`include "gs_params.vh"

module gs_hit_queue #(
    parameter CHUNK = `GS_CHUNK,
    parameter QUEUE = `GS_QUEUE,  // slots
    parameter MARKS = `GS_MARKS
) (
    input  wire                     clk,
    input  wire                     rst,

    // push: a hit of the list being filled
    input  wire                     push_valid,
    input  wire [$clog2(CHUNK)-1:0] push_slot,

    // close: the list is complete with this cycle's push
    input  wire                     close,
    input  wire                     close_void,  // it stands for a batch without entries
    input  wire                     close_end,   // last one of a tile

    // mark: of the oldest list; mark_skip, with mark_ready: drop its slots
    output wire                     mark_valid,
    input  wire                     mark_ready,
    input  wire                     mark_skip,
    output wire                     mark_void,
    output wire                     mark_end,
    output wire [$clog2(CHUNK):0]   mark_count,

    // slot: read one of a list whose mark is or was at the head, and drop it
    input  wire                     slot_en,
    output wire [$clog2(CHUNK)-1:0] slot,

    // of complete lists: slots and marks that wait
    output reg  [$clog2(QUEUE):0]   slot_used,
    output reg  [$clog2(MARKS):0]   mark_used
);

    localparam SLOT_W = $clog2(CHUNK);
    localparam ADDR_W = $clog2(QUEUE);
    localparam MARK_W = $clog2(MARKS);

    generate
        if (QUEUE != (1 << ADDR_W) || QUEUE < CHUNK) begin : g_rule
            QUEUE_must_be_a_power_of_two_and_hold_a_CHUNK bad ();
        end
    endgenerate

    reg  [SLOT_W:0]   count;  // pushes of the list so far, no more than CHUNK
    reg  [ADDR_W-1:0] wr_ptr;
    reg  [ADDR_W-1:0] rd_ptr;
    wire [SLOT_W:0]   count_now = count + {{SLOT_W{1'b0}}, push_valid};
    wire [ADDR_W:0]   wide_add;
    wire [ADDR_W:0]   wide_drop;
    wire              mark_take = mark_valid && mark_ready;
    wire [SLOT_W:0]   add       = close ? count_now : {SLOT_W+1{1'b0}};
    wire [SLOT_W:0]   drop      = mark_take && mark_skip ? mark_count : {{SLOT_W{1'b0}}, slot_en};
    generate
        if (ADDR_W > SLOT_W) begin : g_wide
            assign wide_add  = {{ADDR_W-SLOT_W{1'b0}}, add};
            assign wide_drop = {{ADDR_W-SLOT_W{1'b0}}, drop};
        end else begin : g_same
            assign wide_add  = add;
            assign wide_drop = drop;
        end
    endgenerate
    always @(posedge clk) begin
        count     <= close ? {SLOT_W+1{1'b0}} : count_now;
        wr_ptr    <= wr_ptr + {{ADDR_W-1{1'b0}}, push_valid};
        rd_ptr    <= rd_ptr + wide_drop[ADDR_W-1:0];
        slot_used <= slot_used + wide_add - wide_drop;
        mark_used <= mark_used + {{MARK_W{1'b0}}, close} - {{MARK_W{1'b0}}, mark_take};
        if (rst) begin
            count     <= {SLOT_W+1{1'b0}};
            wr_ptr    <= {ADDR_W{1'b0}};
            rd_ptr    <= {ADDR_W{1'b0}};
            slot_used <= {ADDR_W+1{1'b0}};
            mark_used <= {MARK_W+1{1'b0}};
        end
    end

    gs_ram #(.WIDTH(SLOT_W), .DEPTH(QUEUE)) slot_ram (
        .clk(clk),
        .wr_en(push_valid), .wr_addr(wr_ptr), .wr_data(push_slot),
        .rd_en(slot_en), .rd_addr(rd_ptr), .rd_data(slot)
    );

    wire unused_ready;
    gs_fifo #(.WIDTH(SLOT_W + 3), .DEPTH(MARKS)) mark_fifo (
        .clk(clk), .rst(rst),
        .in_valid(close), .in_ready(unused_ready), .in_data({close_void, close_end, count_now}),
        .out_valid(mark_valid), .out_ready(mark_ready), .out_data({mark_void, mark_end, mark_count})
    );

    wire unused_ok = &{1'b0, unused_ready};

endmodule

`default_nettype wire
