// gs_chunk_sorter: sorts a list chunk by chunk and merges it with a sorted list, or merges two sorted lists.
//
//   SORT:  a is cut into chunks (cmd_first entries, then CHUNK each), every chunk is sorted, and the sorted chunks, one
//          behind the other, are merged with b. MERGE: a and b are merged as they come. Both drop invalid entries.
//   one command is one output list; cmd_ready is high again when its end beat has left
//   a chunk of n entries: n + 2 cycles for each pass from runs of L to runs of 4L while there are more than two runs, and
//   a cycle for each entry of the chunk and of b in the merge (golden/sorting_core/chunk_sorter.py)
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

    localparam POS_W  = $clog2(CHUNK);
    localparam ADDR_W = POS_W - 2;                      // of a quarter of a buffer
    localparam SORT_W = $clog2(SORT_N);
    localparam [POS_W:0] NONE = 0;
    localparam [POS_W:0] ONE = 1;
    localparam [POS_W:0] CHUNK_LEN = ONE << POS_W;
    localparam [POS_W:0] TWO_RUNS = ONE << (SORT_W + 1);
    localparam [POS_W-1:0] POS_ONE = 1;
    localparam [ADDR_W:0] ADDR_ONE = 1;
    localparam [ADDR_W:0] SORTED = (ADDR_ONE << SORT_W) - ADDR_ONE;  // run_mask of what the BSU gives

    generate
        if (CHUNK != (1 << POS_W) || CHUNK < 4 * SORT_N) begin : g_chunk
            CHUNK_must_be_a_power_of_two_of_at_least_4_SORT_N bad ();
        end
    endgenerate

    // What a chunk does: it is loaded into a bank (load_*) while the chunk before it is sorted and merged in the other.
    localparam [2:0] IDLE  = 3'b000;  // no chunk to work on
    localparam [2:0] PASS  = 3'b001;  // merges runs of L entries to runs of 4L
    localparam [2:0] FINAL = 3'b010;  // merges the last two runs with b
    localparam [2:0] MERGE = 3'b100;  // merges a with b
    reg  [2:0] state;
    reg        busy;                  // from the command to the end beat of its list
    wire       passing = state[0];
    wire       ending  = state[1];
    wire       merging = state[2];
    wire       get_on  = passing || ending;

    wire       cmd_go = cmd_valid && cmd_ready;
    wire       msu_valid;
    assign cmd_ready = !busy && !msu_valid;

    // Loader: a through the BSU into bank load_bank. A chunk ends when it is full or with the list; the BSU gets an end
    // beat either way.
    reg                load_on;       // the chunk takes entries
    reg                load_full;     // it waits for the sorter
    reg                load_list_end; // no chunk behind it
    reg                load_bank;
    reg  [POS_W:0]     load_left;     // entries until it is full
    reg  [POS_W:0]     load_n;        // entries written
    wire               cut = load_left == NONE;
    wire               bsu_in_valid = load_on && (cut || a_valid);
    wire               bsu_in_ready;
    wire               bsu_in_last = cut || a_last;
    wire               bsu_in_go = bsu_in_valid && bsu_in_ready;
    wire               bsu_valid;
    wire [ENTRY_W-1:0] bsu_entry;
    wire               bsu_last;
    wire               load_write = bsu_valid && !bsu_last;
    wire               chunk_take;
    wire               load_new = chunk_take || cmd_go;

    gs_bitonic_sort_unit #(.SORT_N(SORT_N), .ENTRY_W(ENTRY_W), .NETWORK(NETWORK)) bsu (
        .clk(clk), .rst(rst),
        .in_valid(bsu_in_valid), .in_ready(bsu_in_ready), .in_entry(a_entry), .in_last(bsu_in_last),
        .out_valid(bsu_valid), .out_ready(1'b1), .out_entry(bsu_entry), .out_last(bsu_last)
    );

    always @(posedge clk) begin
        if (load_new || load_write) load_n <= load_new ? NONE : load_n + ONE;
        if (bsu_in_go && !bsu_in_last) load_left <= load_left - ONE;
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
        if (rst) {load_on, load_full, load_bank} <= 3'b000;
    end

    // Where entry pos of a chunk is. Run r is in quarter 0, 2, 1, 3 of the buffer for r mod 4 = 0, 1, 2, 3, behind run
    // r - 4; runs of half a chunk and more fill the quarters one behind the other. So two runs are always in quarters 0
    // and then 1, and in 2 and then 3. With a mask of L - 1, cut to CHUNK / 2 - 1, bit q1 of pos is bit 1 of the quarter,
    // bit q0 is bit 0, and the address is what is left.
    function [POS_W-1:0] q1;
        input [ADDR_W:0] mask;
        begin
            q1 = {mask, 1'b1} & ~{1'b0, mask};
        end
    endfunction
    function [POS_W-1:0] q0;
        input [ADDR_W:0] mask;
        begin
            q0 = mask[ADDR_W] ? {2'b01, {ADDR_W{1'b0}}} : {mask[ADDR_W-1:0], 2'b11} & ~{1'b0, mask[ADDR_W-1:0], 1'b1};
        end
    endfunction
    function [POS_W-1:0] place;       // {quarter, address}
        input [POS_W-1:0] pos;
        input [ADDR_W:0]  mask;
        begin
            place = {|(pos & q1(mask)), |(pos & q0(mask)),
                     (pos[ADDR_W-1:0] & mask[ADDR_W-1:0]) | (pos[POS_W-1:2] & ~mask[ADDR_W-1:0])};
        end
    endfunction

    // Sorter. The passes alternate between the chunk's bank (!load_bank) and the work buffer.
    reg  [2:0]         get_from;      // the buffer that is read: bank 0, bank 1, the work buffer
    reg                list_end;      // no chunk behind this one
    reg  [POS_W:0]     n;             // entries of the chunk
    reg  [ADDR_W:0]    run_mask;      // L - 1, at most CHUNK / 2 - 1
    reg  [POS_W-1:0]   put_pos;       // entries that the pass has written
    wire [POS_W-1:0]   run_q1 = q1(run_mask);
    wire [POS_W-1:0]   run_q0 = q0(run_mask);
    wire [ADDR_W:0]    put_mask = {run_mask[ADDR_W-2:0], 2'b11};
    wire [POS_W-1:0]   put_place = place(put_pos, put_mask);
    wire [POS_W-1:0]   load_place = place(load_n[POS_W-1:0], SORTED);

    wire               msu_ready = passing || out_ready;
    wire [ENTRY_W-1:0] msu_entry;
    wire               msu_last;
    wire [3:0]         msu_go;        // the MSU+ takes its head
    wire               ends_go = msu_go[0] && msu_go[3];

    // The readers of the quarters: the next entry waits in the memory's output register (primed).
    reg                primed;
    reg  [3:0]         done;          // no entry waits, all have been read
    reg  [3:0]         passed;        // FINAL, and it is done
    reg  [3:0]         odd;           // the one that waits is of an odd group of four runs
    reg                odd_group;     // the group that was merged last was one
    wire               all_done = primed && (&done);
    wire               put_over = passing && all_done;  // the last entry of the pass is written
    wire               chunk_done = ending && all_done && !list_end && (!msu_valid || msu_ready);
    wire               two_runs = (put_pos[POS_W-1:1] & ~put_mask) == {ADDR_W + 1{1'b0}};  // at most, of the last entry

    assign chunk_take = load_full && (state == IDLE || chunk_done);
    wire               restart = put_over || chunk_take;

    // A group is over when each quarter is done or shows an entry of the next one, whose merge then begins at once.
    wire               group_over = &(done | (odd ^ {4{odd_group}}));
    wire               odd_now = odd_group ^ group_over;
    wire [3:0]         live = ~done & ~(odd ^ {4{odd_now}});

    always @(posedge clk) begin
        if (restart || (passing && msu_valid)) put_pos <= restart ? {POS_W{1'b0}} : put_pos + POS_ONE;
        if (get_on) primed <= 1'b1;
        if (passing && primed) odd_group <= odd_now;
        if (chunk_done || ends_go) state <= IDLE;
        if (cmd_go && cmd_merge) state <= MERGE;
        if (put_over) begin
            state     <= two_runs ? FINAL : PASS;
            get_from  <= !get_from[2] ? 3'b100 : load_bank ? 3'b001 : 3'b010;
            run_mask  <= put_mask;
        end
        if (chunk_take) begin
            state     <= (load_n > TWO_RUNS) ? PASS : FINAL;
            get_from  <= load_bank ? 3'b010 : 3'b001;
            list_end  <= load_list_end;
            run_mask  <= SORTED;
            n         <= load_n;
        end
        if (restart) {primed, odd_group} <= 2'b00;
        if (cmd_go) busy <= 1'b1;
        if (ends_go) busy <= 1'b0;
        if (rst) begin
            state  <= IDLE;
            busy   <= 1'b0;
            primed <= 1'b0;
        end
    end

    // Quarter q of the three buffers, and its reader. Buffer 0 and 1 are the banks, 2 is the work buffer.
    wire [3:0]           get_go;
    wire [4*ENTRY_W-1:0] get_entry;
    genvar q;
    genvar k;
    generate
        for (q = 0; q < 4; q = q + 1) begin : g_quarter
            localparam [1:0] QUARTER = q;
            reg  [ADDR_W:0]    addr;
            wire [ADDR_W-1:0]  low = addr[ADDR_W-1:0] & run_mask[ADDR_W-1:0];
            wire [ADDR_W-1:0]  high = addr[ADDR_W-1:0] & ~run_mask[ADDR_W-1:0];
            wire [POS_W-1:0]   pos = {2'b00, low} | {high, 2'b00} | ({POS_W{QUARTER[1]}} & run_q1) |
                                     ({POS_W{QUARTER[0]}} & run_q0);
            wire               at_end = addr[ADDR_W] || {1'b0, pos} >= n;
            wire               step = get_go[q] || (get_on && !primed);
            wire               load_here = load_write && load_place[POS_W-1:ADDR_W] == QUARTER;
            wire               put_here = passing && msu_valid && put_place[POS_W-1:ADDR_W] == QUARTER;
            wire [3*ENTRY_W-1:0] words;

            always @(posedge clk) begin
                if (step) done[q] <= at_end;
                if (step) passed[q] <= at_end && ending;
                if (step) odd[q] <= |({1'b0, addr} & run_q1);
                if (restart || (step && !at_end)) addr <= restart ? {ADDR_W + 1{1'b0}} : addr + ADDR_ONE;
            end

            for (k = 0; k < 3; k = k + 1) begin : g_buffer
                wire loads = k < 2 && load_bank == (k == 1);
                wire puts  = !loads && !get_from[k];
                gs_ram #(.WIDTH(ENTRY_W), .DEPTH(CHUNK / 4)) ram (
                    .clk(clk),
                    .wr_en(loads ? load_here : puts && put_here),
                    .wr_addr(loads ? load_place[ADDR_W-1:0] : put_place[ADDR_W-1:0]),
                    .wr_data(loads ? bsu_entry : msu_entry),
                    .rd_en(get_from[k] && step), .rd_addr(addr[ADDR_W-1:0]), .rd_data(words[k*ENTRY_W +: ENTRY_W])
                );
            end

            assign get_entry[q*ENTRY_W +: ENTRY_W] = ({ENTRY_W{get_from[0]}} & words[0 +: ENTRY_W]) |
                                                     ({ENTRY_W{get_from[1]}} & words[ENTRY_W +: ENTRY_W]) |
                                                     ({ENTRY_W{get_from[2]}} & words[2*ENTRY_W +: ENTRY_W]);
        end
    endgenerate

    // Heads of the MSU+. PASS: quarters 0, 2, 1, 3. FINAL: quarter 0 and behind it 1, 2 and behind it 3, none, b; only the
    // last chunk shows its end. MERGE: none, none, a, b.
    wire [ENTRY_W-1:0] head_0 = passed[0] ? get_entry[ENTRY_W +: ENTRY_W] : get_entry[0 +: ENTRY_W];
    wire [ENTRY_W-1:0] head_1 = passed[2] ? get_entry[3*ENTRY_W +: ENTRY_W] : get_entry[2*ENTRY_W +: ENTRY_W];
    wire [ENTRY_W-1:0] head_2 = passing ? get_entry[ENTRY_W +: ENTRY_W] : a_entry;
    wire [ENTRY_W-1:0] head_3 = passing ? get_entry[3*ENTRY_W +: ENTRY_W] : b_entry;
    wire runs_valid = merging || (get_on && primed && (!(&done) || (!passing && list_end)));
    wire [3:0] head_last = passing ? ~{live[3], live[1], live[2], live[0]}
                         : {b_last, a_last || !merging, merging || (&passed[3:2]), merging || (&passed[1:0])};

    assign get_go  = {(msu_go[3] && passing) || (msu_go[1] && passed[2]), msu_go[1] && !passed[2],
                      (msu_go[2] && passing) || (msu_go[0] && passed[0]), msu_go[0] && !passed[0]};
    assign a_ready = merging ? msu_go[2] : load_on && !cut && bsu_in_ready;
    assign b_ready = !passing && msu_go[3];

    gs_merge_sort_unit #(.ENTRY_W(ENTRY_W)) msu (
        .clk(clk), .rst(rst),
        .cfg_keep(passing),
        .a_valid(runs_valid), .a_ready(msu_go[0]), .a_entry(head_0), .a_last(head_last[0]),
        .b_valid(runs_valid), .b_ready(msu_go[1]), .b_entry(head_1), .b_last(head_last[1]),
        .c_valid(!merging || a_valid), .c_ready(msu_go[2]), .c_entry(head_2), .c_last(head_last[2]),
        .d_valid(passing || b_valid), .d_ready(msu_go[3]), .d_entry(head_3), .d_last(head_last[3]),
        .out_valid(msu_valid), .out_ready(msu_ready), .out_entry(msu_entry), .out_last(msu_last)
    );

    assign out_valid = msu_valid && !passing;
    assign out_entry = msu_entry;
    assign out_last  = msu_last;

endmodule

`default_nettype wire
