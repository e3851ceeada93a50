"""Why what docs/mutation.md lists is no missing test. Entries are found by words of the source line."""

# unit: (part of the source line, part of the mutant's name, reason)
SURVIVORS: dict[str, list[tuple[str, str, str]]] = {
    "gs_candidate_matrix": [
        (
            ".wr_en(mask_valid && write[i])",
            "const1 at logic_and.B[0], write[15]",
            "position 15 of a block is written 0 early; its own mask, or the batch's last one, comes before it is read",
        ),
    ],
    "gs_axi_list_reader": [
        (
            "always @(posedge clk) begin",
            "ar_left[15]",
            "tables of more than 43,690 entries: the bench reads 700 at most",
        ),
        ("always @(posedge clk) begin", "procdff.D[15]", "tables of more than 21,845 entries: the same"),
        (
            "always @(posedge clk) begin",
            "left[23]",
            "tables of more than 8 million entries; `capacity` ends at one million",
        ),
    ],
    "gs_axi_block_writer": [
        (
            "if (take) count <= count_d",
            "procmux.B[14]",
            "lists of 16,384 entries and more: the bench writes 1,030 at most",
        ),
    ],
    "gs_batch_buffer": [
        ("always @(posedge clk) begin", "held_x[1]", "a tile's origin is a multiple of its side"),
        (
            "wire [SLOT_W:0] to_slot",
            "to_slot[6]",
            "inverted behind 256 records of a batch that is not closed: it is before",
        ),
        (
            "written[out_bank]",
            "inv at or.Y[0]",
            "bank 0 is free when bank 1 is written: costs cycles, which the bench of gs_raster_core counts",
        ),
    ],
    "gs_late_buffer": [
        ("bank_xy [0:2]", "blend_y[1]", "a tile's origin is a multiple of its side"),
        ("geometry_slot <= test_slot", "procmux.A", "it counts in the one cycle behind its read only"),
        (
            "bank_xy[fill_bank] <= held_xy",
            "procmux.A[6]",
            "there Yosys is free to choose the address: it is none of the three",
        ),
        (
            ".rd_en(out_go && out_bank == b)",
            "logic_and.B[0]",
            "reads in more cycles; what is read when it counts is the same",
        ),
    ],
    "gs_subtile_blender": [
        (
            "gs_subtile_compute_unit scu (",
            "sat_stored",
            "without a subtile to store it stands at a tile's start, where nothing is done that could be called so",
        ),
    ],
    "gs_sort_lane": [
        ("gs_sort_sequencer #(", "job_scratch_addr[2]", "an address is a multiple of 8"),
        ("gs_sort_sequencer #(", "b_cmd_n[14]", "incoming lists of more than 32,768 entries: the bench has 1,500"),
        (
            "gs_sort_sequencer #(",
            "out_cmd_valid",
            "the writer takes a command with a list's first entry: one has waited for it since before",
        ),
        (
            "gs_sort_sequencer #(",
            "a_cmd_ready",
            "the reader is free, takes it and is busy: the sequencer goes on a cycle later",
        ),
        ("gs_sort_sequencer #(", "b_cmd_ready", "the reader is free whenever the sequencer has a command for it"),
    ],
    "gs_queue_blender": [
        ("if (go_blend)  left", "sub.A[8]", "256 goes by way of 511 to 254: as many steps"),
        ("gs_hit_queue #(", "mark_used", "asks for room that there is: the tester waits, nothing is lost"),
        ("gs_subtile_compute_unit scu (", "trace_valid", "trace only, and its lanes are 0 then"),
        (
            "always @(posedge clk) begin",
            "a2_store[0]",
            "without a subtile a fresh one is stored where none is loaded: it is not read",
        ),
    ],
    "gs_chunk_sorter": [
        (
            "wire [ADDR_W-1:0]  high = ",
            "high[2]",
            "a sorted run has eight entries at least: run_mask holds the bits 0 to 2",
        ),
    ],
    "gs_subtile_compute_unit": [
        ("s13_colours <= s9_what", "procmux.A", "they are taken on in the next cycle"),
        ("if (s12_last) begin", "sat_group", "it counts with sat_valid only, a cycle behind s12_last"),
    ],
    "gs_exp2_unit": [
        (
            "wire [SUM_W-1:0]     in_sum",
            "sub.B[5]",
            "below the binary point the minuend is all ones: no borrow leaves it, and these bits are dropped",
        ),
    ],
    "gs_candidate_tester": [
        ("always @(posedge clk) begin", "r2_y[1]", "a group's first row is a multiple of 8"),
        (
            "if (rst) begin",
            "procmux.Y[9]",
            "512 tests under way: a list has 256 at most, its results follow in ten cycles",
        ),
    ],
    "gs_group_finder": [
        ("s5_limit <= s3_bound", "s5_limit[1]", "inverted where the limit is below 0: nothing is hit either way"),
    ],
    "gs_group_tester": [
        ("if (start) list_used", "or.A[0]", "group 1 starts right behind group 0, whose list is still in use"),
        ("list_ram (", "list_en[2]", "reads in more cycles; what is read when it is asked for is the same"),
        ("assign test_issued", "logic_not.A[0]", "a batch without entries starts no group, so that none runs"),
        ("if (run) slot <=", "procmux.A[4]", "slot is 0 while no group runs"),
    ],
    "gs_late_sorter": [
        ("index_ram (", "wr_data[2]", "an index is written twice, unsorted and sorted: inverted twice"),
        ("index_ram (", "rd_data[2]", "an index is read twice, to be sorted and to go out: inverted twice"),
        (
            "s1_out_bank  <= out_bank",
            "procmux.S[0]",
            "the word is taken in the cycle behind out_en: later ones do not matter",
        ),
    ],
    "gs_pixel_blender": [
        ("times_t = ", "or.Y[5]", "of the lowest digit: seen where a product is within 2^-11 of a half, and none is"),
    ],
    "gs_power_unit": [
        (
            "if (in_valid) begin",
            "s1_a[",
            "it is inverted in each cycle that it waits, and read in the second and the fourth",
        ),
        ("if (in_valid) begin", "s1_dx[23]", "the same: read in the second"),
        ("always @(posedge clk) begin", "s5_near[0]", "the same: read in the second"),
        ("always @(posedge clk) begin", "s5_a[", "the same: read in the fourth"),
        ("s9_live = |start_q[12:9]", "reduce_or.A", "it saves power only: what stands at S9 is not looked at then"),
        ("always @(posedge clk) begin", "start_q[9]", "s9_live saves power only: what stands there is not looked at"),
    ],
    "gs_sort_sequencer": [
        (
            "always @(posedge clk) begin",
            "run[23]",
            "more than 8 million incoming entries, 65,536 commands; `capacity` ends at one million",
        ),
        ("wire [N_W-1:0]    rest_a", "rest_a[23]", "the same"),
    ],
}

# module: (part of the source line, reason)
NEVER_REACHED: dict[str, list[tuple[str, str]]] = {}
