// gs_candidate_matrix: masks of groups, one an entry, in; for each group words of one bit an entry out.
//
//   one mask a cycle, never stalls; a word one cycle behind its address; done one cycle behind the batch's last mask
//
//   Position i of every block of 16 entries has its own RAM of masks, so that turning the matrix is a matter of wires: a word
//   is the same bit of 16 masks. The last mask of a batch clears the masks behind it in its block.

`default_nettype none
`include "gs_params.vh"

module gs_candidate_matrix #(
    parameter CHUNK  = `GS_CHUNK,
    parameter GROUPS = `GS_GROUPS,
    parameter BANKS  = 3,  // batches kept
    parameter BLOCK  = 16  // entries in a word
) (
    input  wire                             clk,
    input  wire                             rst,

    // mask: the groups that an entry may hit, entries of a batch in order; the bank holds through a batch
    input  wire                             mask_valid,
    input  wire [GROUPS-1:0]                mask_bits,
    input  wire [$clog2(BANKS)-1:0]         mask_bank,
    input  wire                             mask_last,  // of the batch

    // cand: bit i is entry BLOCK*cand_block + i; one cycle behind cand_en, and then until the next one
    input  wire                             cand_en,
    input  wire [$clog2(BANKS)-1:0]         cand_bank,
    input  wire [$clog2(GROUPS)-1:0]        cand_group,
    input  wire [$clog2(CHUNK/BLOCK)-1:0]   cand_block,
    output wire [BLOCK-1:0]                 cand_bits,

    // done: pulse; from this cycle on the batch can be read
    output reg                              done
);

    localparam POS_W   = $clog2(CHUNK);
    localparam BLOCK_W = $clog2(BLOCK);
    localparam DEPTH   = BANKS*(CHUNK/BLOCK);

    generate
        if (CHUNK % BLOCK != 0 || CHUNK/BLOCK < 2 || 1 << POS_W != CHUNK) begin : g_rule
            CHUNK_must_be_a_power_of_two_and_at_least_two_blocks bad ();
        end
    endgenerate

    reg [POS_W-1:0] pos;
    always @(posedge clk) begin
        done <= mask_valid && mask_last && !rst;
        if (mask_valid) pos <= mask_last ? {POS_W{1'b0}} : pos + {{POS_W-1{1'b0}}, 1'b1};
        if (rst) pos <= {POS_W{1'b0}};
    end

    reg [$clog2(GROUPS)-1:0] group;
    always @(posedge clk) if (cand_en) group <= cand_group;

    // Positions of the block that are written: this one, and with the last mask all behind it.
    wire [BLOCK-1:0] here  = {{BLOCK-1{1'b0}}, 1'b1} << pos[BLOCK_W-1:0];
    wire [BLOCK-1:0] write = mask_last ? ~here + {{BLOCK-1{1'b0}}, 1'b1} : here;

    genvar i;
    generate
        for (i = 0; i < BLOCK; i = i + 1) begin : g_position
            wire [GROUPS-1:0] word;
            gs_ram #(.WIDTH(GROUPS), .DEPTH(DEPTH)) mask_ram (
                .clk(clk),
                .wr_en(mask_valid && write[i]), .wr_addr({mask_bank, pos[POS_W-1:BLOCK_W]}),
                .wr_data(mask_bits & {GROUPS{here[i]}}),
                .rd_en(cand_en), .rd_addr({cand_bank, cand_block}), .rd_data(word)
            );
            assign cand_bits[i] = word[group];
        end
    endgenerate

endmodule

`default_nettype wire
