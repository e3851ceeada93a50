// gs_row_reach: how far from u = 0 an ellipse reaches in a row of pixels: sqrt(limit - v^2), not below it by more than a code.
//
//   latency LATENCY = 4, one row per cycle, never stalls; no valid bit
//
//   S1 distance  |v|, v = v0 + j*c             exact, then floor, sat to UQ2.ITU_F
//   S2 square    limit - |v|^2                 exact; negative: the row is empty
//   S3 root      the high digits               exact
//   S4 root      the low digits                floor

`default_nettype none
`include "gs_params.vh"

module gs_row_reach #(
    parameter ITU_F  = `GS_ITU_F,
    parameter EDGE_F = `GS_EDGE_F
) (
    input  wire               clk,

    // in: an ellipse in a row
    input  wire [EDGE_F+8:0]  in_v_high,  // SQ5.(EDGE_F+3): parts of v in the group's first row
    input  wire [EDGE_F+5:0]  in_v_low,   // SQ2.(EDGE_F+3)
    input  wire [EDGE_F+6:0]  in_step,    // UQ4.(EDGE_F+3): from there to this row

    // limit: of u^2 + v^2, one cycle behind its row
    input  wire [2*ITU_F+4:0] in_limit,   // SQ4.(2*ITU_F)

    // out
    output wire               out_empty,
    output wire [ITU_F+1:0]   out_reach   // UQ2.ITU_F
);

    localparam V_F    = EDGE_F + 3;
    localparam V_W    = V_F + 7;         // SQ6.V_F
    localparam ITU_W  = ITU_F + 2;       // digits of the root
    localparam REST_W = 2*ITU_W + 2;     // SQ5.(2*ITU_F): a negative limit less the largest |v|^2
    localparam HIGH   = (2*ITU_W + 2) / 3;  // digits of S3

    // S1 distance. ~v is |v| - 1, which ITU_MARGIN allows for.
    wire [V_W-1:0] in_v    = {in_v_high[EDGE_F+8], in_v_high} + {{4{in_v_low[EDGE_F+5]}}, in_v_low} + {3'b000, in_step};
    wire [V_W-2:0] in_flip = in_v[V_W-2:0] ^ {V_W-1{in_v[V_W-1]}};
    reg [ITU_W-1:0] s1_distance;
    always @(posedge clk)
        s1_distance <= in_flip[V_F-ITU_F +: ITU_W] | {ITU_W{|in_flip[V_W-2:V_F+2]}};

    // S2 square
    reg [REST_W-1:0] s2_rest;
    always @(posedge clk)
        s2_rest <= {in_limit[REST_W-2], in_limit} - {{ITU_W+2{1'b0}}, s1_distance} * {{ITU_W+2{1'b0}}, s1_distance};

    // S3, S4 root, digit by digit: digit d is set when the remainder holds 4*root + 1.
    reg s3_empty;
    reg s4_empty;
    always @(posedge clk) begin
        s3_empty <= s2_rest[REST_W-1];
        s4_empty <= s3_empty;
    end
    genvar d;
    generate
        for (d = 0; d < ITU_W; d = d + 1) begin : g_digit
            wire [d+2:0]                  left;   // remainder and the next two bits
            wire [d+2:0]                  least;  // 4*root + 1
            wire [2*(ITU_W-d)-1:0]        bits;   // not yet used, these two on top
            if (d == 0) begin : g_first
                assign bits  = s2_rest[2*ITU_W-1:0];
                assign left  = {1'b0, bits[2*ITU_W-1 -: 2]};
                assign least = 3'b001;
            end
            else if (d == HIGH) begin : g_stage
                reg [d:0]              s3_remainder;
                reg [d-1:0]            s3_root;
                reg [2*(ITU_W-d)-1:0]  s3_bits;
                always @(posedge clk) begin
                    s3_remainder <= g_digit[d-1].remainder;
                    s3_root      <= g_digit[d-1].root;
                    s3_bits      <= g_digit[d-1].bits[2*(ITU_W-d)-1:0];
                end
                assign bits  = s3_bits;
                assign left  = {s3_remainder, bits[2*(ITU_W-d)-1 -: 2]};
                assign least = {1'b0, s3_root, 2'b01};
            end
            else begin : g_next
                assign bits  = g_digit[d-1].bits[2*(ITU_W-d)-1:0];
                assign left  = {g_digit[d-1].remainder, bits[2*(ITU_W-d)-1 -: 2]};
                assign least = {1'b0, g_digit[d-1].root, 2'b01};
            end
            wire [d+3:0] rest = {1'b0, left} - {1'b0, least};
            wire         set  = !rest[d+3];
            wire [d+1:0] remainder = set ? rest[d+1:0] : left[d+1:0];
            wire [d:0]   root;
            if (d == 0) begin : g_root
                assign root = set;
            end
            else begin : g_root
                assign root = {least[d+1:2], set};
            end
            wire unused_ok = &{1'b0, rest[d+2]};
        end
    endgenerate
    reg [ITU_W-1:0] s4_root;
    always @(posedge clk) s4_root <= g_digit[ITU_W-1].root;
    assign out_empty = s4_empty;
    assign out_reach = s4_root;

    wire unused_ok = &{1'b0, in_flip[V_F-ITU_F-1:0], s2_rest[REST_W-2], g_digit[ITU_W-1].remainder};

endmodule

`default_nettype wire
