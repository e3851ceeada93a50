// gs_bitonic_sort_unit: sorts a list in groups of SORT_N entries, ascending as unsigned numbers (BSU).
//
//   a group closes at SORT_N entries or at the end beat; the end beat follows the last group
//   SORT_N cycles to fill, SORT_N (NETWORK 0) or log2(SORT_N) * (log2(SORT_N) + 1) / 2 (NETWORK 1) to sort; the next
//   group fills while a sorted one leaves
//   in_ready sees the input beat and out_ready combinationally
//
//   NETWORK 0, ring: the cells rotate by one each cycle past compare-exchanges on fixed pairs of cells, so the pairs of
//   entries alternate as in an odd-even transposition sort; only the pair that joins the last slot to the first rests.
//   NETWORK 1, folded bitonic network: the partners come through multiplexers.

`default_nettype none
`include "gs_params.vh"

module gs_bitonic_sort_unit #(
    parameter SORT_N  = `GS_SORT_N,   // a power of two, at least 4
    parameter ENTRY_W = `GS_ENTRY_W,
    parameter NETWORK = 0             // 0 ring, 1 bitonic
) (
    input  wire               clk,
    input  wire               rst,

    // in: list stream
    input  wire               in_valid,
    output wire               in_ready,
    input  wire [ENTRY_W-1:0] in_entry,
    input  wire               in_last,

    // out: list stream with the same entries
    output wire               out_valid,
    input  wire               out_ready,
    output wire [ENTRY_W-1:0] out_entry,
    output wire               out_last
);

    localparam POS_W = $clog2(SORT_N);
    localparam BUS_W = SORT_N * ENTRY_W;
    localparam [POS_W-1:0] POS_ONE = 1;
    localparam [POS_W-1:0] POS_MAX = {POS_W{1'b1}};
    localparam [POS_W:0] COUNT_ONE = 1;

    generate
        if (SORT_N < 4 || SORT_N != (1 << POS_W)) begin : g_size
            SORT_N_must_be_a_power_of_two_of_at_least_4 bad ();
        end
    endgenerate

    // Slot p of the group passes the gate (the last cell) when pos is p: there it leaves, and slot p of the next group
    // enters at cell 0. In the first round of a group the old entries leave, and a slot that gets no entry gets
    // padding (all ones). The group counts its entries and shows no more than these, so padding never leaves: an entry
    // of all ones is the same word. In later rounds the cells only turn until the free slot is at the gate.
    reg                sorting;
    reg                first_round;
    reg  [POS_W-1:0]   pos;
    reg  [POS_W:0]     count;        // entries of the group that fills
    reg                closed;       // its end beat has come
    reg  [POS_W:0]     out_count;    // entries of the sorted group
    reg                out_end;      // an end beat follows it
    reg  [BUS_W-1:0]   cells;

    wire emit     = !sorting && first_round && {1'b0, pos} < out_count;
    wire emit_end = !sorting && !emit && out_end;
    wire in_place = count[POS_W-1:0] == pos;
    wire open     = !sorting && !closed;
    wire load     = open && in_valid && !in_last && in_place && (emit ? out_ready : !out_end);
    wire close    = open && in_valid && in_last && count != 0;
    wire pass_end = open && in_valid && in_last && count == 0 && !emit && !out_end;
    wire turn     = !sorting && (emit ? out_ready : !out_end && (load || close || closed || !in_place));
    wire filled   = turn && pos == POS_MAX && (load || close || closed);
    wire sorted;

    assign in_ready  = load || close || (pass_end && out_ready);
    assign out_valid = emit || emit_end || pass_end;
    assign out_entry = cells[BUS_W-1 -: ENTRY_W];
    assign out_last  = !emit;

    always @(posedge clk) begin
        if (turn || (sorting && NETWORK == 0)) pos <= pos + POS_ONE;
        if (load) count <= count + COUNT_ONE;
        if (close) closed <= 1'b1;
        if (turn && pos == POS_MAX) first_round <= 1'b0;
        if (emit_end && out_ready) out_end <= 1'b0;
        if (emit_end && count == 0) begin       // what is left in the cells is padding: start over
            pos       <= {POS_W{1'b0}};
            out_count <= {POS_W + 1{1'b0}};
        end
        if (filled) sorting <= 1'b1;
        if (sorted) begin
            sorting     <= 1'b0;
            first_round <= 1'b1;
            count       <= {POS_W + 1{1'b0}};
            closed      <= 1'b0;
            out_count   <= count;
            out_end     <= closed;
        end
        if (rst) begin
            sorting     <= 1'b0;
            first_round <= 1'b1;
            pos         <= {POS_W{1'b0}};
            count       <= {POS_W + 1{1'b0}};
            closed      <= 1'b0;
            out_count   <= {POS_W + 1{1'b0}};
            out_end     <= 1'b0;
        end
    end

    // What enters cell 0: the next entry, padding, or what leaves the last cell (`back`).
    wire [ENTRY_W-1:0] back;
    wire pad = !sorting && first_round && !load;
    wire [ENTRY_W-1:0] gate = (load ? in_entry : back) | {ENTRY_W{pad}};

    genvar i;
    generate
        if (NETWORK == 0) begin : g_ring
            // Cell 2i+1 holds the slot before that of cell 2i.
            wire [BUS_W-1:0] turned;
            for (i = 0; i < SORT_N / 2; i = i + 1) begin : g_pair
                localparam [POS_W-1:0] SEAM = 2 * i + 1;
                wire [ENTRY_W-1:0] upper = cells[2*i*ENTRY_W +: ENTRY_W];
                wire [ENTRY_W-1:0] lower = cells[(2*i+1)*ENTRY_W +: ENTRY_W];
                wire swap = sorting && pos != SEAM && upper < lower;
                assign turned[2*i*ENTRY_W +: ENTRY_W]     = swap ? lower : upper;
                assign turned[(2*i+1)*ENTRY_W +: ENTRY_W] = swap ? upper : lower;
            end
            assign sorted = sorting && pos == POS_MAX;
            assign back   = turned[BUS_W-1 -: ENTRY_W];
            always @(posedge clk) begin
                if (turn || sorting) cells <= {turned[BUS_W-ENTRY_W-1:0], gate};
            end
        end else begin : g_bitonic
            // Slots at distance 2^d are compared; blocks of 2^s slots ascend and descend in turn. One-hot d and s.
            reg [POS_W-1:0]        apart;
            reg [POS_W:0]          size;
            reg [BUS_W/2-1:0]      low;
            reg [BUS_W/2-1:0]      high;
            reg [SORT_N/2-1:0]     down;
            reg [BUS_W/2-1:0]      new_low;
            reg [BUS_W/2-1:0]      new_high;
            reg [BUS_W-1:0]        exchanged;
            integer p;
            integer d;
            integer s;

            assign sorted = sorting && apart[0] && size[POS_W];
            assign back   = out_entry;

            // Pair p at distance 2^d joins slot s, which is p with a zero put in as bit d, to slot s + 2^d. Slot s is
            // in cell SORT_N - 1 - s.
            always @* begin
                low  = {BUS_W / 2{1'b0}};
                high = {BUS_W / 2{1'b0}};
                down = {SORT_N / 2{1'b0}};
                for (p = 0; p < SORT_N / 2; p = p + 1) begin
                    for (d = 0; d < POS_W; d = d + 1) begin
                        s = ((p >> d) << (d + 1)) + (p & ((1 << d) - 1));
                        if (apart[d]) begin
                            low[p*ENTRY_W +: ENTRY_W]  = cells[(SORT_N-1-s)*ENTRY_W +: ENTRY_W];
                            high[p*ENTRY_W +: ENTRY_W] = cells[(SORT_N-1-s-(1<<d))*ENTRY_W +: ENTRY_W];
                            down[p] = |(size[POS_W-1:0] & s[POS_W-1:0]);
                        end
                    end
                end
                for (p = 0; p < SORT_N / 2; p = p + 1) begin
                    if ((high[p*ENTRY_W +: ENTRY_W] < low[p*ENTRY_W +: ENTRY_W]) != down[p]) begin
                        new_low[p*ENTRY_W +: ENTRY_W]  = high[p*ENTRY_W +: ENTRY_W];
                        new_high[p*ENTRY_W +: ENTRY_W] = low[p*ENTRY_W +: ENTRY_W];
                    end else begin
                        new_low[p*ENTRY_W +: ENTRY_W]  = low[p*ENTRY_W +: ENTRY_W];
                        new_high[p*ENTRY_W +: ENTRY_W] = high[p*ENTRY_W +: ENTRY_W];
                    end
                end
                exchanged = {BUS_W{1'b0}};
                for (p = 0; p < SORT_N / 2; p = p + 1) begin
                    for (d = 0; d < POS_W; d = d + 1) begin
                        s = ((p >> d) << (d + 1)) + (p & ((1 << d) - 1));
                        if (apart[d]) begin
                            exchanged[(SORT_N-1-s)*ENTRY_W +: ENTRY_W]        = new_low[p*ENTRY_W +: ENTRY_W];
                            exchanged[(SORT_N-1-s-(1<<d))*ENTRY_W +: ENTRY_W] = new_high[p*ENTRY_W +: ENTRY_W];
                        end
                    end
                end
            end

            always @(posedge clk) begin
                if (turn) cells <= {cells[BUS_W-ENTRY_W-1:0], gate};
                else if (sorting) cells <= exchanged;
                if (sorting) apart <= apart[0] ? size[POS_W-1:0] : apart >> 1;
                if (sorting && apart[0]) size <= size << 1;
                if (rst || sorted) begin
                    apart <= {{POS_W - 1{1'b0}}, 1'b1};
                    size <= {{POS_W - 1{1'b0}}, 2'b10};
                end
            end
        end
    endgenerate

endmodule

`default_nettype wire
