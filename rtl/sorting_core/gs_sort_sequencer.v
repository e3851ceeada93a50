// gs_sort_sequencer: runs one tile's sort as a sequence of commands to a sorting core and its DMA units.
//
//   1. SORT   incoming                        -> scratch                chunks of CHUNK in order; none without incoming
//   2. MERGE  two runs at a time, to and fro  -> incoming, scratch ...  until one run is left
//   3. SORT   table, merged with that run     -> out                    none without a table: then 1 or 2 ends in out
//
//   A command makes one list; the next one starts when the block writer has written it.
//   job in cycle 0: first command in cycle 2. written in cycle 0: next command, or done, in cycle 2. A job without any
//   entry: done in cycle 2, nothing read or written. The next job may run while a done waits.

`default_nettype none
`include "gs_params.vh"

module gs_sort_sequencer #(
    parameter CHUNK       = `GS_CHUNK,
    parameter ENTRY_BYTES = `GS_ENTRY_BYTES,
    parameter ADDR_W      = 32,
    parameter N_W         = 24
) (
    input  wire              clk,
    input  wire              rst,

    // job: one tile. The incoming and scratch regions hold job_in_n entries each and are overwritten
    input  wire              job_valid,
    output wire              job_ready,
    input  wire [ADDR_W-1:0] job_table_addr,
    input  wire [N_W-1:0]    job_table_n,
    input  wire [ADDR_W-1:0] job_in_addr,
    input  wire [N_W-1:0]    job_in_n,          // none of them marked invalid
    input  wire [ADDR_W-1:0] job_scratch_addr,
    input  wire [ADDR_W-1:0] job_out_addr,
    input  wire [8:0]        job_first,         // entries of the table's first chunk

    // a, b: the two lists to read
    output wire              a_valid,
    input  wire              a_ready,
    output wire [ADDR_W-1:0] a_addr,
    output wire [N_W-1:0]    a_n,
    output wire              b_valid,
    input  wire              b_ready,
    output wire [ADDR_W-1:0] b_addr,
    output wire [N_W-1:0]    b_n,

    // core: what to do with them
    output wire              core_valid,
    input  wire              core_ready,
    output wire              core_merge,
    output wire [8:0]        core_first,

    // out: where the result goes; written: it is there, with n entries
    output wire              out_valid,
    input  wire              out_ready,
    output wire [ADDR_W-1:0] out_addr,
    input  wire              written_valid,
    output wire              written_ready,
    input  wire [N_W-1:0]    written_n,

    // done: the job's table is in memory; n entries
    output wire              done_valid,
    input  wire              done_ready,
    output wire [N_W-1:0]    done_n
);

    localparam IDLE = 2'd0;
    localparam PLAN = 2'd1;     // choose the next command
    localparam WORK = 2'd2;     // until its list is written
    localparam DONE = 2'd3;     // until done is free

    localparam SORT_IN    = 2'd0;
    localparam MERGE_IN   = 2'd1;
    localparam SORT_TABLE = 2'd2;

    localparam [N_W:0]      RUN_N     = CHUNK;
    localparam [ADDR_W-1:0] RUN_BYTES = CHUNK * ENTRY_BYTES;

    // The job
    reg  [ADDR_W-1:0] table_addr;
    reg  [N_W-1:0]    table_n;
    reg  [N_W-1:0]    in_n;
    reg  [ADDR_W-1:0] goal_addr;
    reg  [8:0]        first;

    // Where it stands: the runs lie at src_addr; a pass has `left` entries still to read, `offset` bytes behind it
    reg  [1:0]        state;
    reg  [1:0]        pass;
    reg  [ADDR_W-1:0] src_addr;
    reg  [ADDR_W-1:0] dst_addr;
    reg  [N_W:0]      run;
    reg  [ADDR_W-1:0] run_bytes;
    reg  [N_W-1:0]    left;
    reg  [ADDR_W-1:0] offset;
    reg  [N_W-1:0]    total;

    wire              job_go   = job_valid && state == IDLE;
    wire              no_table = table_n == {N_W{1'b0}};
    wire              one_run  = {1'b0, in_n} <= (pass == SORT_IN ? run : {run[N_W-1:0], 1'b0});    // behind this pass
    wire              to_goal  = pass == SORT_TABLE || (no_table && one_run);
    wire              pass_end = left == {N_W{1'b0}};

    // The next MERGE reads two runs, the last one may be short and its partner missing
    wire [N_W-1:0]    run_a  = {1'b0, left} <= run ? left : run[N_W-1:0];
    wire [N_W-1:0]    rest_a = left - run_a;
    wire [N_W-1:0]    run_b  = {1'b0, rest_a} <= run ? rest_a : run[N_W-1:0];
    wire [N_W-1:0]    rest_b = rest_a - run_b;

    reg  [ADDR_W-1:0] cmd_a_addr;
    reg  [N_W-1:0]    cmd_a_n;
    reg  [ADDR_W-1:0] cmd_b_addr;
    reg  [N_W-1:0]    cmd_b_n;
    reg  [ADDR_W-1:0] cmd_out_addr;
    always @(posedge clk) begin
        if (state == PLAN) begin
            cmd_a_addr   <= pass == SORT_TABLE ? table_addr : src_addr + offset;
            cmd_a_n      <= pass == SORT_TABLE ? table_n : pass == MERGE_IN ? run_a : in_n;
            cmd_b_addr   <= pass == SORT_TABLE ? src_addr : src_addr + offset + run_bytes;
            cmd_b_n      <= pass == SORT_TABLE ? in_n : pass == MERGE_IN ? run_b : {N_W{1'b0}};
            cmd_out_addr <= (to_goal ? goal_addr : dst_addr) + offset;
        end
    end

    reg  [3:0] wanted;          // units that have not taken the command: out, core, b, a
    assign a_valid       = wanted[0];
    assign a_addr        = cmd_a_addr;
    assign a_n           = cmd_a_n;
    assign b_valid       = wanted[1];
    assign b_addr        = cmd_b_addr;
    assign b_n           = cmd_b_n;
    assign core_valid    = wanted[2];
    assign core_merge    = pass == MERGE_IN;
    assign core_first    = pass == SORT_TABLE ? first : RUN_N[8:0];
    assign out_valid     = wanted[3];
    assign out_addr      = cmd_out_addr;
    assign written_ready = state == WORK;

    reg           slot_valid;
    reg [N_W-1:0] slot_n;
    assign job_ready  = state == IDLE;
    assign done_valid = slot_valid;
    assign done_n     = slot_n;

    always @(posedge clk) begin
        wanted <= wanted & ~{out_ready, core_ready, b_ready, a_ready};
        if (done_ready) slot_valid <= 1'b0;
        case (state)
            IDLE: if (job_go) begin
                table_addr <= job_table_addr;
                table_n    <= job_table_n;
                src_addr   <= job_in_addr;
                dst_addr   <= job_scratch_addr;
                in_n       <= job_in_n;
                goal_addr  <= job_out_addr;
                first      <= job_first;
                run        <= RUN_N;
                run_bytes  <= RUN_BYTES;
                offset     <= {ADDR_W{1'b0}};
                total      <= {N_W{1'b0}};
                pass       <= job_in_n == {N_W{1'b0}} ? SORT_TABLE : SORT_IN;
                state      <= job_in_n == {N_W{1'b0}} && job_table_n == {N_W{1'b0}} ? DONE : PLAN;
            end
            PLAN: begin
                wanted <= 4'b1111;
                left   <= pass == MERGE_IN ? rest_b : {N_W{1'b0}};
                offset <= offset + {run_bytes[ADDR_W-2:0], 1'b0};
                state  <= WORK;
            end
            WORK: if (written_valid) begin
                total <= written_n;
                state <= to_goal ? DONE : PLAN;
                if (pass_end) begin
                    pass     <= one_run ? SORT_TABLE : MERGE_IN;
                    src_addr <= dst_addr;
                    dst_addr <= src_addr;
                    left     <= in_n;
                    offset   <= {ADDR_W{1'b0}};
                    if (pass == MERGE_IN) run       <= {run[N_W-1:0], 1'b0};
                    if (pass == MERGE_IN) run_bytes <= {run_bytes[ADDR_W-2:0], 1'b0};
                end
            end
            default: if (done_ready || !slot_valid) begin
                slot_valid <= 1'b1;
                slot_n     <= total;
                state      <= IDLE;
            end
        endcase
        if (rst) begin
            state      <= IDLE;
            wanted     <= 4'b0000;
            slot_valid <= 1'b0;
        end
    end

endmodule

`default_nettype wire
