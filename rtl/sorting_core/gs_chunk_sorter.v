// gs_chunk_sorter: sorts a list chunk by chunk and merges it with a sorted list, or merges two sorted lists.
//
//   SORT:  a is cut into chunks (cmd_first entries, then CHUNK each), every chunk is sorted, and the sorted chunks, one
//          behind the other, are merged with b. MERGE: a and b are merged as they come. Both drop invalid entries.
//   one command is one output list; cmd_ready is high again when its end beat has left
//   a chunk of n entries: n + ceil(n / 2L) + 2 cycles for each pass from runs of L to runs of 2L, and a cycle for each
//   entry of the chunk and of b in the merge (golden/sorting_core/chunk_sorter.py)
//   a_ready and b_ready see both heads and out_ready combinationally
//
//   a ──► BSU ──► chunk buffer (2 banks) ──┬──► MSU+ ──► out
//                     ▲    work buffer ────┤     │
//                     └────────▲───────────│─────┘ passes
//                                      b ──┘

`default_nettype none
`include "gs_params.vh"

module gs_chunk_sorter #(
    parameter CHUNK   = `GS_CHUNK,    // entries in a chunk; a power of two, at least 4 * SORT_N
    parameter SORT_N  = `GS_SORT_N,
    parameter ENTRY_W = `GS_ENTRY_W,
    parameter NETWORK = 0             // of the BSU
) (
    input  wire                   clk,
    input  wire                   rst,

    // cmd: one output list
    input  wire                   cmd_valid,
    output wire                   cmd_ready,
    input  wire                   cmd_merge,  // 1 MERGE, 0 SORT
    input  wire [$clog2(CHUNK):0] cmd_first,  // SORT: entries in the first chunk, 1..CHUNK

    // a, b: list streams; b sorted, in MERGE a too
    input  wire                   a_valid,
    output wire                   a_ready,
    input  wire [ENTRY_W-1:0]     a_entry,
    input  wire                   a_last,
    input  wire                   b_valid,
    output wire                   b_ready,
    input  wire [ENTRY_W-1:0]     b_entry,
    input  wire                   b_last,

    // out: list stream
    output wire                   out_valid,
    input  wire                   out_ready,
    output wire [ENTRY_W-1:0]     out_entry,
    output wire                   out_last
);

    localparam CHUNK_W = $clog2(CHUNK) + 1;
    localparam HALF    = CHUNK / 2;
    localparam ADDR_W  = $clog2(HALF);
    localparam [ADDR_W:0] ONE = 1;
    localparam [ADDR_W:0] NONE = 0;
    localparam [CHUNK_W-1:0] CHUNK_ONE = 1;
    localparam [CHUNK_W-1:0] CHUNK_LEN = CHUNK;
    localparam [ADDR_W-1:0] GROUP_MASK = SORT_N - 1;

    generate
        if (CHUNK != (1 << (CHUNK_W - 1)) || CHUNK < 4 * SORT_N) begin : g_chunk
            CHUNK_must_be_a_power_of_two_of_at_least_4_SORT_N bad ();
        end
    endgenerate

    // What a chunk does: it is loaded into a bank (load_*) while the chunk before it is sorted and merged in the other.
    localparam [2:0] IDLE  = 3'd0;    // no chunk to work on
    localparam [2:0] PASS  = 3'd1;    // merges runs of L entries to runs of 2L
    localparam [2:0] TURN  = 3'd2;    // the last entry of a pass has been written
    localparam [2:0] FINAL = 3'd3;    // merges the sorted chunk with b
    localparam [2:0] MERGE = 3'd4;    // merges a with b
    reg  [2:0] state;
    reg        busy;                  // from the command to the end beat of its list

    wire       cmd_go = cmd_valid && cmd_ready;
    wire       msu_valid;
    assign cmd_ready = !busy && !msu_valid;

    // Loader: a through the BSU into the half banks of bank load_bank, runs of even number to half 0. A chunk ends when
    // it is full or with the list; the BSU gets an end beat either way.
    reg                load_on;       // the chunk takes entries
    reg                load_full;     // it waits for the sorter
    reg                load_list_end; // no chunk behind it
    reg                load_bank;
    reg  [CHUNK_W-1:0] load_left;     // entries until it is full
    reg                load_half;
    reg  [ADDR_W:0]    load_len_0;    // entries in half 0, 1
    reg  [ADDR_W:0]    load_len_1;
    wire               cut = load_left == 0;
    wire               bsu_in_ready;
    wire               bsu_in_last = cut || a_last;
    wire               bsu_in_go = load_on && (cut || a_valid) && bsu_in_ready;
    wire               bsu_valid;
    wire [ENTRY_W-1:0] bsu_entry;
    wire               bsu_last;
    wire               load_write = bsu_valid && !bsu_last;
    wire [ADDR_W:0]    load_len = load_half ? load_len_1 : load_len_0;
    wire [ADDR_W:0]    load_next = load_len + ONE;
    wire               chunk_take;

    gs_bitonic_sort_unit #(
        .SORT_N (SORT_N),
        .ENTRY_W(ENTRY_W),
        .NETWORK(NETWORK)
    ) bsu (
        .clk(clk),
        .rst(rst),
        .in_valid(load_on && (cut || a_valid)),
        .in_ready(bsu_in_ready),
        .in_entry(a_entry),
        .in_last(bsu_in_last),
        .out_valid(bsu_valid),
        .out_ready(1'b1),
        .out_entry(bsu_entry),
        .out_last(bsu_last)
    );

    always @(posedge clk) begin
        if (load_write) begin
            if (load_half) load_len_1 <= load_next;
            else load_len_0 <= load_next;
            if ((load_next[ADDR_W-1:0] & GROUP_MASK) == 0) load_half <= !load_half;
        end
        if (bsu_in_go && !bsu_in_last) load_left <= load_left - CHUNK_ONE;
        if (bsu_in_go && bsu_in_last) begin
            load_on       <= 1'b0;
            load_list_end <= !cut;
        end
        if (bsu_valid && bsu_last) load_full <= 1'b1;
        if (chunk_take) begin
            load_full <= 1'b0;
            load_bank <= !load_bank;
            load_on   <= !load_list_end;
            load_left <= CHUNK_LEN;
        end
        if (cmd_go) begin
            load_on   <= !cmd_merge;
            load_left <= cmd_first;
        end
        if (chunk_take || cmd_go) {load_half, load_len_1, load_len_0} <= {1'b0, NONE, NONE};
        if (rst) {load_on, load_full, load_bank} <= 3'b000;
    end

    // Sorter. The passes alternate between the chunk's bank (!load_bank) and the work buffer.
    reg                from_work;
    reg                list_end;
    reg  [ADDR_W-1:0]  run_mask;      // L - 1
    reg  [ADDR_W:0]    len_0;         // entries in the half banks that are read
    reg  [ADDR_W:0]    len_1;
    reg                put_half;      // and where those of the pass go
    reg  [ADDR_W:0]    put_len_0;
    reg  [ADDR_W:0]    put_len_1;
    wire [ADDR_W-1:0]  put_mask = {run_mask[ADDR_W-2:0], 1'b1};
    wire [ADDR_W:0]    put_len = put_half ? put_len_1 : put_len_0;
    wire [ADDR_W:0]    put_next = put_len + ONE;
    wire               passing = state == PASS || state == TURN;
    wire               put = passing && msu_valid && !msu_last;
    wire               sorted = put_len_1 == NONE || (&run_mask);

    wire               msu_ready = passing || out_ready;
    wire [ENTRY_W-1:0] msu_entry;
    wire               msu_last;
    wire               msu_a_ready;
    wire               msu_b_ready;
    wire               ends_go;       // the MSU+ takes two end beats

    // The readers of half 0 and 1: the next entry waits in the memory's output register, or an end beat stands there.
    reg  [1:0]         get_valid;
    reg  [1:0]         get_end;
    wire [1:0]         get_go;
    wire [1:0]         get_done;      // all entries have been read
    wire               get_on = state == PASS || state == FINAL;
    wire               chunk_done = state == FINAL && (&get_end) && !list_end && (!msu_valid || msu_ready);

    assign chunk_take = load_full && (state == IDLE || chunk_done);

    always @(posedge clk) begin
        if (put) begin
            if (put_half) put_len_1 <= put_next;
            else put_len_0 <= put_next;
            if ((put_next[ADDR_W-1:0] & put_mask) == 0) put_half <= !put_half;
        end
        case (state)
            PASS: if (ends_go && (&get_done)) state <= TURN;
            TURN: begin
                state     <= sorted ? FINAL : PASS;
                from_work <= !from_work;
                run_mask  <= put_mask;
                len_0     <= put_len_0;
                len_1     <= put_len_1;
            end
            FINAL: if (ends_go || chunk_done) state <= IDLE;
            MERGE: if (ends_go) state <= IDLE;
            default: if (cmd_go && cmd_merge) state <= MERGE;
        endcase
        if (state == TURN || chunk_take) {put_half, put_len_1, put_len_0} <= {1'b0, NONE, NONE};
        if (chunk_take) begin
            state     <= (load_len_1 == NONE) ? FINAL : PASS;
            from_work <= 1'b0;
            list_end  <= load_list_end;
            run_mask  <= GROUP_MASK;
            len_0     <= load_len_0;
            len_1     <= load_len_1;
        end
        if (cmd_go) busy <= 1'b1;
        if (ends_go && !passing) busy <= 1'b0;
        if (rst) begin
            state <= IDLE;
            busy  <= 1'b0;
        end
    end

    // Half h of the three buffers, and its reader.
    wire [2*ENTRY_W-1:0] get_entry;
    genvar h;
    genvar k;
    generate
        for (h = 0; h < 2; h = h + 1) begin : g_half
            reg  [ADDR_W:0]    addr;
            wire [ADDR_W:0]    len = (h == 0) ? len_0 : len_1;
            wire               at_end = addr == len;
            wire               at_border = state == PASS && get_valid[h] && (addr[ADDR_W-1:0] & run_mask) == 0;
            wire               step = get_on && (get_go[h] || (!get_valid[h] && !get_end[h]));
            wire               read = step && !at_end && !at_border;
            wire               load_here = load_write && load_half == h;
            wire               put_here = put && put_half == h;
            wire [3*ENTRY_W-1:0] words;

            always @(posedge clk) begin
                if (step) get_valid[h] <= read;
                if (step) get_end[h] <= !read;
                if (read) addr <= addr + ONE;
                if (rst || !get_on || chunk_take) {get_valid[h], get_end[h], addr} <= {2'b00, NONE};
            end

            // Buffer 0 and 1 are the banks, 2 is the work buffer.
            for (k = 0; k < 3; k = k + 1) begin : g_buffer
                wire loads = k < 2 && load_bank == (k == 1);
                wire reads = !loads && from_work == (k == 2);
                wire puts  = !loads && from_work != (k == 2);
                gs_ram #(
                    .WIDTH(ENTRY_W),
                    .DEPTH(HALF)
                ) ram (
                    .clk(clk),
                    .wr_en(loads ? load_here : puts && put_here),
                    .wr_addr(loads ? load_len[ADDR_W-1:0] : put_len[ADDR_W-1:0]),
                    .wr_data(loads ? bsu_entry : msu_entry),
                    .rd_en(reads && read),
                    .rd_addr(addr[ADDR_W-1:0]),
                    .rd_data(words[k*ENTRY_W +: ENTRY_W])
                );
            end

            assign get_done[h] = at_end;
            wire [ENTRY_W-1:0] bank = load_bank ? words[0 +: ENTRY_W] : words[ENTRY_W +: ENTRY_W];
            assign get_entry[h*ENTRY_W +: ENTRY_W] = from_work ? words[2*ENTRY_W +: ENTRY_W] : bank;
        end
    endgenerate

    // Heads of the MSU+. In FINAL half 1 follows half 0, and only the last chunk shows its end.
    wire [ENTRY_W-1:0] get_entry_1 = get_entry[ENTRY_W +: ENTRY_W];
    wire merging = state == MERGE;
    wire final_1 = state == FINAL && get_end[0];
    wire chunk_valid = final_1 ? get_valid[1] || (get_end[1] && list_end) : get_valid[0] || get_end[0];
    wire head_a_valid = merging ? a_valid : get_on && chunk_valid;
    wire head_a_last = merging ? a_last : final_1 ? get_end[1] : get_end[0];
    wire [ENTRY_W-1:0] head_a = merging ? a_entry : final_1 ? get_entry_1 : get_entry[0 +: ENTRY_W];
    wire head_b_valid = (state == PASS) ? get_valid[1] || get_end[1] : (merging || state == FINAL) && b_valid;
    wire head_b_last = (state == PASS) ? get_end[1] : b_last;
    wire [ENTRY_W-1:0] head_b = (state == PASS) ? get_entry_1 : b_entry;

    assign get_go[0] = !final_1 && msu_a_ready;
    assign get_go[1] = final_1 ? msu_a_ready : state == PASS && msu_b_ready;
    assign ends_go   = msu_a_ready && msu_b_ready;
    assign a_ready   = merging ? msu_a_ready : load_on && !cut && bsu_in_ready;
    assign b_ready   = (merging || state == FINAL) && msu_b_ready;

    gs_merge_sort_unit #(
        .ENTRY_W(ENTRY_W)
    ) msu (
        .clk(clk),
        .rst(rst),
        .cfg_keep(state == PASS),
        .a_valid(head_a_valid),
        .a_ready(msu_a_ready),
        .a_entry(head_a),
        .a_last(head_a_last),
        .b_valid(head_b_valid),
        .b_ready(msu_b_ready),
        .b_entry(head_b),
        .b_last(head_b_last),
        .out_valid(msu_valid),
        .out_ready(msu_ready),
        .out_entry(msu_entry),
        .out_last(msu_last)
    );

    assign out_valid = msu_valid && !passing;
    assign out_entry = msu_entry;
    assign out_last  = msu_last;

endmodule

`default_nettype wire
