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
    "gs_block_buffer": [
        (
            "assign out_valid = leaving",
            "const1 at logic_or.A[0]",
            "a block leaves a cycle behind its end at the earliest, when its first entry waits in the memory's output",
        ),
    ],
    "gs_exp2_unit": [
        (
            "wire [SUM_W-1:0]     in_sum",
            "sub.B[5]",
            "below the binary point the minuend is all ones: no borrow leaves it, and these bits are dropped",
        ),
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
